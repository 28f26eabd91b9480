"""Ray tracing -> array response -> spectrum -> dataset folder.

``spectrum`` (angular grid, array manifold, beamforming) and ``dataset`` (the NeRF² folder) import without the ray
tracer, so that learning from measured data does not need it.
"""
