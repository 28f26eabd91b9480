"""A scene in the ray tracer's form, with what is followed in it: what every step of the tracing needs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Int

from scenes.description import Scene
from simulate.planes import Planes
from simulate.propagation import Propagation
from simulate.ray_tracer import rt
from simulate.sionna_scene import build_scene, sionna_names


@dataclass(frozen=True)
class RayScene:
    """A scene, the same scene in Sionna RT, and the propagation that is followed in it.

    Attributes:
        description: the scene as the user described it.
        sionna: its objects and radio materials in Sionna RT.
        propagation: the mechanisms that are followed, and how far.
    """

    description: Scene
    sionna: rt.Scene
    propagation: Propagation

    @classmethod
    def of(cls, scene: Scene, propagation: Propagation) -> RayScene:
        """Build a scene in Sionna RT.

        Args:
            scene: the scene's description.
            propagation: the mechanisms to follow.

        Returns:
            Both, with the Sionna RT scene.
        """
        return cls(scene, build_scene(scene), propagation)

    @cached_property
    def identifiers(self) -> Int[np.ndarray, " objects"]:
        """Sionna RT's identifier of each object of the description, in the description's order."""
        return np.array([int(self.sionna.objects[name].object_id) for name in sionna_names(self.description)])

    @cached_property
    def planes(self) -> Planes:
        """The planes that the objects' triangles lie in."""
        return Planes(self.description, self.identifiers.tolist())
