"""Scenes: descriptions, meshes, radio materials, built-in places, mesh import.

This package imports neither the ray tracer nor torch.
"""
