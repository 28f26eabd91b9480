"""The part of diffuse reflection in the responses: one path for every source, patch and target."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Complex, Float, Int
from scipy.spatial.distance import cdist

from scenes.scene.description import SPEED_OF_LIGHT
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.terms import Interaction, Terms
from simulate.rays.scattering.patch_fields import PatchFields, PatchScene
from simulate.rays.scattering.patches import patches_of
from simulate.spectra.band import enough_frequencies, interpolated

FREQUENCIES_MORE = 10
"""Number of frequencies beyond those that the delays need. They make the error of the interpolation negligible."""

LANES = 400_000
"""Ways between a target and a patch that are followed at a time. This bounds the memory."""


class Scattering:
    """Waves that are reflected diffusely once, and otherwise go straight, also through objects.

    The patches and their phases are drawn once, so the field at a target depends only on its position.
    """

    def __init__(self, ray_scene: RayScene, seed: int):
        patches = patches_of(ray_scene, ray_scene.propagation.patches, seed)
        self._ray_scene, self._scene = ray_scene, PatchScene(ray_scene, patches)
        self._objects = ray_scene.object_of_face[patches.faces]

    def responses(self, sources: Antennas, targets: Antennas) -> Complex[np.ndarray, "targets sources"]:
        """The sum of all paths from each source to each target."""
        return self._responses(self._scene, sources, targets)

    def band_responses(
        self, sources: Antennas, targets: Antennas, frequencies: Float[np.ndarray, " subcarriers"]
    ) -> Complex[np.ndarray, "targets sources subcarriers"]:
        """The sum of all paths from each source to each target, at each subcarrier.

        The sum is computed at as many frequencies as its delays need, and is interpolated between them.
        """
        points = self._scene.patches.points
        longest = sum(cdist(each.positions, points).max(initial=0) for each in (sources, targets))
        at = enough_frequencies(frequencies, longest / SPEED_OF_LIGHT, FREQUENCIES_MORE)
        scenes = [PatchScene(self._ray_scene, self._scene.patches, frequency) for frequency in at]
        found = np.stack([self._responses(each, sources, targets) for each in scenes], axis=-1)
        return interpolated(at, found, frequencies, delay=longest / SPEED_OF_LIGHT / 2)

    def _responses(
        self, scene: PatchScene, sources: Antennas, targets: Antennas
    ) -> Complex[np.ndarray, "targets sources"]:
        result = np.zeros((len(targets), len(sources)), np.complex128)
        for start, _, sent, taken in self._batches(scene, sources, targets):
            for number, each in enumerate(taken, start):
                result[number] += (sent * each).sum(axis=(1, 2))
        return result * scene.wavelength / (4 * np.pi)

    def terms(self, sources: Antennas, targets: Antennas) -> Iterator[Terms]:
        """The single paths whose sum ``responses`` returns, in batches."""
        for start, patches, sent, taken in self._batches(self._scene, sources, targets):
            for number, each in enumerate(taken, start):
                responses = (sent * each).sum(axis=2) * self._scene.wavelength / (4 * np.pi)
                source, which = np.nonzero(responses)
                ends = sources.positions[source], targets.positions[np.full(len(source), number)]
                yield Terms(
                    targets=np.full(len(source), number),
                    sources=source,
                    responses=responses[source, which],
                    vertices=np.stack([ends[0], self._scene.patches.points[patches[which]], ends[1]], axis=1),
                    objects=self._objects[patches[which], None],
                    kinds=np.full((len(source), 1), int(Interaction.SCATTERING)),
                )

    def _batches(
        self, scene: PatchScene, sources: Antennas, targets: Antennas
    ) -> Iterator[
        tuple[int, Int[np.ndarray, " k"], Complex[np.ndarray, "sources k 2"], Complex[np.ndarray, "batch k 2"]]
    ]:
        """The results of ``_pairs`` for batches of targets, each with the index of the first target."""
        if not len(scene.patches):
            return
        scattered = scene.scattered(sources)
        batch = max(1, LANES // len(scene.patches))
        for start in range(0, len(targets), batch):
            received = scene.received(targets.subset(np.arange(start, min(start + batch, len(targets)))))
            for found in self._pairs(scattered, received):
                yield start, *found

    def _pairs(
        self, scattered: PatchFields, received: PatchFields
    ) -> Iterator[tuple[Int[np.ndarray, " k"], Complex[np.ndarray, "sources k 2"], Complex[np.ndarray, "targets k 2"]]]:
        """Patches, the waves that they scatter, and the share that targets receive.

        A patch scatters to the side from which the wave came.
        """
        for side in (1, -1):
            first, second = scattered.side == side, received.side == side
            patches = np.nonzero(first.any(axis=0))[0]
            if len(patches):
                yield (
                    patches,
                    np.where(first[:, patches, None], scattered.components[:, patches], 0),
                    np.where(second[:, patches, None], received.components[:, patches], 0),
                )
