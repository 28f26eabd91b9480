"""Ray tracing -> element responses -> spectrum -> dataset folder.

``spectra`` (angular grid, array manifold, beamforming) and ``dataset`` (the NeRF² folder) do not import the ray tracer,
since learning from measured data does not need it.
"""
