"""Rays against full wave: the ray tracer's responses compared with a full-wave dataset's at the same positions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Complex, Float, Int

from learn.data.metrics import Scores, score
from learn.evaluation.crossvalidate import correlation
from scenes.files.errors import InputError, require_whole
from scenes.scene.description import Scene
from scenes.storage.scene_yaml import read_scene
from simulate.dataset.dataset import Dataset, require_fixed_array
from simulate.dataset.dataset_folder import at_its_frequency, read_dataset
from simulate.positions.positions import MOST_POSITIONS
from simulate.rays.core.propagation import Propagation
from simulate.rays.expected_correlation import (
    Expected,
    expected_correlation,
    expected_of,
    power_shares,
    tried_positions,
)
from simulate.spectra.spectrum import evenly, picture, spectrum_of


@dataclass(frozen=True)
class EngineComparison:
    """Responses by rays and by full wave at the same K positions."""

    name: str  # name of the full-wave dataset's folder
    positions: Float[np.ndarray, "K 3"]  # [K, 3] transmitter positions, metres, world frame
    rays: Complex[np.ndarray, "K elements"]  # [K, elements] element responses by rays
    full_wave: Complex[np.ndarray, "K elements"]  # [K, elements] element responses by full wave
    correlation: Float[np.ndarray, " K"]  # [K] correlation ``|⟨rays, full wave⟩| / (‖rays‖ ‖full wave‖)``, 0…1
    level_error_db: Float[np.ndarray, " K"]  # [K] power of the rays' responses over that of the full wave's, dB
    scores: Scores  # scores of the rays' spectra against those of the full wave
    # what correlation over all elements and positions together was to expect, if it is known
    expected: Expected | None = None

    def metrics(self) -> dict[str, Any]:
        """The numbers in engines.json and in the output of ``bisplat engines``.

        The correlation over all elements and positions together also counts phase errors that differ from position to
        position. The median over the positions does not.
        """
        together = correlation(self.rays.reshape(1, -1), self.full_wave.reshape(1, -1))[0]
        expected = {} if self.expected is None else {"correlation_expected": self.expected.middle}
        return {
            "correlation_rays": float(np.median(self.correlation)),
            "correlation_rays_together": float(together),
            **expected,
            "ssim_rays": float(np.median(self.scores.ssim)),
            "aoa_error_deg": float(np.median(self.scores.aoa_error)),
            "level_error_db": float(np.median(np.abs(self.level_error_db))),
            "level_bias_db": float(np.median(self.level_error_db)),
            "positions": len(self.positions),
        }


def compare_engines(folder: Path | str, propagation: Propagation, positions: int, seed: int = 1) -> EngineComparison:
    """Trace the positions of a full-wave dataset by rays, between short dipoles as in full wave."""
    require_whole(1, MOST_POSITIONS, positions=positions)
    dataset = read_dataset(folder)
    require_fixed_array(dataset, "the comparison of engines")
    scene = scene_for_rays(dataset)
    from simulate.rays.tracer import Tracer

    chosen = evenly(np.arange(len(dataset.names)), positions)
    tracer = Tracer(scene, propagation, None, seed)
    compared = compare_responses(dataset, chosen, tracer.responses(dataset.positions[chosen]))
    return replace(compared, expected=expected_correlation(tracer, scene, scene.transmitter.region))


def expect_of_rays(scene: Scene) -> dict[str, Any]:
    """What ``bisplat engines`` prints of a scene: how near default rays are expected to come to full wave, and why."""
    from simulate.rays.tracer import Tracer

    shares = power_shares(Tracer(scene, Propagation()), tried_positions(scene, scene.transmitter.region))
    low, middle, high = expected_of(shares) or (None, None, None)
    return {
        "correlation_expected": middle,
        "correlation_low": low,
        "correlation_high": high,
        "power_reflected": shares.reflected,
        "power_diffracted_at_sheets": shares.at_sheets,
        "power_diffracted_at_conductors": shares.at_conductors,
    }


def compare_responses(
    dataset: Dataset, chosen: Int[np.ndarray, " K"], rays: Complex[np.ndarray, "K elements"]
) -> EngineComparison:
    """Compare responses by rays with those of a full-wave dataset."""
    assert dataset.responses is not None
    full_wave = dataset.responses[chosen]
    traced = spectrum_of(picture(dataset.beamformer.spectrum(rays)))
    power = np.linalg.norm(rays, axis=1) / np.maximum(np.linalg.norm(full_wave, axis=1), 1e-30)
    return EngineComparison(
        name=dataset.folder.resolve().name,
        positions=dataset.positions[chosen],
        rays=rays,
        full_wave=full_wave,
        correlation=correlation(rays, full_wave),
        level_error_db=20 * np.log10(np.maximum(power, 1e-15)),
        scores=score(traced, spectrum_of(dataset.pictures[chosen]), dataset.grid, dataset.array),
    )


def scene_for_rays(dataset: Dataset) -> Scene:
    """The scene in which a full-wave dataset was simulated, with short dipoles as antennas."""
    if dataset.metadata.get("engine") != "fullwave":
        raise InputError(f"{dataset.folder}: expected a dataset simulated with --engine fullwave, found another one")
    errors = {name: value for name, value in dataset.metadata["measurement"].items() if value and name != "seed"}
    if errors:
        raise InputError(
            f"{dataset.folder}: expected a dataset without measurement errors, which would count as errors of the "
            f"rays, found {errors}"
        )
    scene = at_its_frequency(read_scene(dataset.folder / dataset.metadata["scene_file"]), dataset)
    return replace(
        scene,
        gateway=replace(scene.gateway, pattern="dipole"),
        transmitter=replace(scene.transmitter, pattern="dipole"),
    )
