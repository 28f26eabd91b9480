"""The fingerprint of a scene."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:  # its import takes long, and the help of the command line does not need it
    from scenes.scene.description import Scene


def scene_digest(scene: Scene) -> str:
    """SHA-256 of everything that responses in a scene depend on: meshes, materials, frequency, antennas, region.

    Args:
        scene: the scene.
    """
    digest = hashlib.sha256()
    for item in scene.objects:
        digest.update(f"{item.name} {scene.materials[item.material]} {item.thickness}".encode())
        digest.update(np.ascontiguousarray(item.mesh.vertices).tobytes())
        digest.update(np.ascontiguousarray(item.mesh.faces).tobytes())
    digest.update(f"{scene.frequency} {scene.gateway} {scene.transmitter}".encode())
    return digest.hexdigest()
