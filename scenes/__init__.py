"""Scenes: descriptions, meshes, radio materials, built-in places, mesh import.

This package imports neither the ray tracer nor torch.
"""

from scenes.description import Gateway, Scene, SceneObject, Transmitter
from scenes.errors import InputError
from scenes.scene_yaml import load_scene

__all__ = ["Gateway", "InputError", "Scene", "SceneObject", "Transmitter", "load_scene"]
