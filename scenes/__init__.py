"""The places: descriptions, meshes, radio materials, built-in rooms, mesh import.

Needs neither the ray tracer nor torch.
"""
