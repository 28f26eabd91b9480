"""What diffuse reflection adds to the responses: every source, patch and target once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Complex, Float, Int

from simulate.ray_scene import RayScene
from simulate.scattering.patch_fields import PatchFields, PatchScene
from simulate.scattering.patches import patches_of
from simulate.sionna_scene import Antennas

LANES = 400_000
"""Ways between a target and a patch followed at once: bounds the memory."""


class Scattering:
    """Waves that are reflected diffusely once on their way, and otherwise go straight, also through objects.

    The field at a target is a function of its position alone: the patches and their phases are drawn once.

    Args:
        ray_scene: the scene, with the propagation to follow.
        seed: of the patches.
    """

    def __init__(self, ray_scene: RayScene, seed: int):
        propagation = ray_scene.propagation
        self._scene = PatchScene(ray_scene, patches_of(ray_scene, propagation.patches, seed))
        self._most_passes = self._scene.most_passes

    def responses(self, sources: Antennas, targets: Antennas) -> Complex[np.ndarray, "targets sources"]:
        """The sum of all paths from each source to each target.

        Args:
            sources: where the paths begin.
            targets: where they end.
        """
        result = np.zeros((len(targets), len(sources)), np.complex128)
        if not len(self._scene.patches):
            return result
        scattered = self._scene.scattered(sources)
        batch = max(1, LANES // len(self._scene.patches))
        for start in range(0, len(targets), batch):
            received = self._scene.received(targets.subset(np.arange(start, min(start + batch, len(targets)))))
            for _, sent, taken in self._pairs(scattered, received):
                for number, each in enumerate(taken, start):
                    result[number] += (sent * each).sum(axis=(1, 2))
        return result * self._scene.wavelength / (4 * np.pi)

    def paths(self, source: Antennas, target: Antennas) -> Iterator[tuple[Float[np.ndarray, "3 3"], complex]]:
        """The paths between one source and one target: vertices (source, patch, target; metres) and response.

        Args:
            source: where the paths begin.
            target: where they end.
        """
        if not len(self._scene.patches):
            return
        points = self._scene.patches.points
        for patches, sent, taken in self._pairs(self._scene.scattered(source), self._scene.received(target)):
            responses = (sent * taken).sum(axis=(0, 2)) * self._scene.wavelength / (4 * np.pi)
            for patch, response in zip(patches[responses != 0], responses[responses != 0], strict=True):
                yield np.stack([source.positions[0], points[patch], target.positions[0]]), response

    def _pairs(
        self, scattered: PatchFields, received: PatchFields
    ) -> Iterator[tuple[Int[np.ndarray, " k"], Complex[np.ndarray, "sources k 2"], Complex[np.ndarray, "targets k 2"]]]:
        """Patches, what they scatter and what of it is received, for all ways that are allowed.

        A patch scatters to the side that its wave came from, and a path passes through so many objects at most.
        """
        for side in (1, -1):
            for passed in range(self._most_passes + 1):
                first = (scattered.side == side) & (scattered.passed == passed)
                patches = np.nonzero(first.any(axis=0))[0]
                if not len(patches):
                    continue
                second = (received.side == side) & (received.passed <= self._most_passes - passed)
                yield (
                    patches,
                    np.where(first[:, patches, None], scattered.components[:, patches], 0),
                    np.where(second[:, patches, None], received.components[:, patches], 0),
                )
