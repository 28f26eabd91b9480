"""Scenes: descriptions, meshes, radio materials, built-in scenes, import of meshes.

This package imports neither the ray tracer nor PyTorch.
"""
