"""A digest of a scene, to tell whether two scenes are the same."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:  # a slow import that the help of the command line does not need
    from scenes.scene.description import Scene


def scene_digest(scene: Scene) -> str:
    """The SHA-256 of all that the element responses depend on: meshes, materials, frequency, antennas, region."""
    digest = hashlib.sha256()
    for item in scene.objects:
        material = replace(scene.materials[item.material], name=item.material)  # as it is read from a file
        thickness = None if item.thickness is None else float(item.thickness)
        digest.update(f"{item.name} {material} {thickness}".encode())
        digest.update(np.ascontiguousarray(item.mesh.vertices).tobytes())
        digest.update(np.ascontiguousarray(item.mesh.faces).tobytes())
    digest.update(f"{float(scene.frequency)} {scene.gateway} {scene.transmitter}".encode())
    return digest.hexdigest()
