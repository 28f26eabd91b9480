"""Cross-validation: the model's prediction against fresh ray tracing, at positions no dataset holds."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Complex, Float
from scipy.spatial import cKDTree

from learn.metrics import Scores, score
from learn.reports.figures import draw_error_map, draw_error_over_distance, draw_examples, draw_examples_polar
from learn.reports.pages import write_crossvalidation
from learn.training.run_folder import load_run
from scenes.atomic import write_atomically
from scenes.description import Scene
from scenes.errors import InputError
from simulate.array import PlanarArray
from simulate.dataset import Dataset, read_dataset
from simulate.placement import free_positions
from simulate.request import propagation_of
from simulate.spectrum import picture

if TYPE_CHECKING:  # the tracer is imported where it is used
    from simulate.trace import Tracer


@dataclass(frozen=True)
class CrossValidation:
    """Prediction and fresh tracing at the same new positions."""

    positions: Float[np.ndarray, "K 3"]
    prediction: Float[np.ndarray, "K 90 360"]
    truth: Float[np.ndarray, "K 90 360"]
    scores: Scores
    correlation: Float[np.ndarray, " K"] | None

    def metrics(self) -> dict[str, Any]:
        """The figures of ``bisplat crossvalidate --json``."""
        figures: dict[str, Any] = {**self.scores.summary(), "positions": len(self.positions)}
        if self.correlation is not None:
            figures["channel_correlation_median"] = float(np.median(self.correlation))
        return figures


def crossvalidate(folder: Path, scene: Scene, count: int, seed: int, tracer: Tracer | None = None) -> CrossValidation:
    """Compare a run with fresh ray tracing and write crossvalidation.html, .json and figures to its folder.

    Args:
        folder: the run.
        scene: the place the run's dataset was simulated in.
        count: number of fresh positions, uniform in the box of the positions trained on.
        seed: draws them.
        tracer: of the scene, where the caller has one; None: made here, as the dataset's metadata say.

    Raises:
        InputError: bad run or dataset, or a scene without a gateway where the dataset's is, or with another array.
    """
    run = load_run(folder)
    dataset = read_dataset(run.config.dataset)
    scene = seen_by(dataset, scene)
    gateway = scene.gateway
    if PlanarArray.of(gateway) != run.array:
        raise InputError(
            f"{scene.name}: expected the array of the run, {run.array}, found {gateway.rows} × {gateway.columns} "
            f"elements {gateway.spacing} wavelengths apart"
        )
    known = dataset.positions[run.split(dataset).known]
    region = np.stack([known.min(axis=0), known.max(axis=0)])
    positions = free_positions(scene, region, count, np.random.default_rng(seed))
    if tracer is None:
        from simulate.trace import Tracer

        propagation, seed_of_rays = propagation_of(dataset.metadata)
        tracer = Tracer(scene, propagation, region, seed_of_rays)
    responses = tracer.responses(positions)
    truth = picture(run.array.spectrum(responses)) / np.float32(255)
    prediction = run.predict(positions)
    result = CrossValidation(
        positions,
        prediction.spectra,
        truth,
        score(prediction.spectra, truth),
        _correlation(prediction.responses, responses),
    )

    write_atomically(folder / "crossvalidation.json", (json.dumps(result.metrics(), indent=2) + "\n").encode())
    scores = result.scores
    draw_error_map(positions, scores.ssim, scores.aoa_error, known, folder / "crossvalidation_map.png")
    distance = cKDTree(known).query(positions)[0]
    draw_error_over_distance(distance, scores.ssim, scores.aoa_error, folder / "crossvalidation_distance.png")
    draw_examples(prediction.spectra, truth, result.scores.ssim, folder / "crossvalidation_examples.png")
    draw_examples_polar(prediction.spectra, truth, result.scores.ssim, folder / "crossvalidation_polar.png")
    write_crossvalidation(result, scene.name, folder)
    return result


def seen_by(dataset: Dataset, scene: Scene) -> Scene:
    """The scene as the dataset's gateway has it."""
    for seen in scene.by_gateway().values():
        gateway = seen.gateway
        moved = np.linalg.norm(np.subtract(gateway.position, dataset.gateway_position))
        alike = abs(np.dot(gateway.orientation, dataset.gateway_orientation))  # q and −q are one orientation
        if moved < 1e-3 and alike > 1 - 1e-5:
            return seen
    raise InputError(
        f"{scene.name}: expected a gateway at {dataset.gateway_position.round(3).tolist()}, oriented as in "
        f"{dataset.folder / 'gateway_info.yml'}, found {list(scene.gateway.position)}"
    )


def _correlation(
    predicted: Complex[np.ndarray, "K elements"] | None, responses: Complex[np.ndarray, "K elements"]
) -> Float[np.ndarray, " K"] | None:
    """|⟨ŷ, y⟩| / (‖ŷ‖ ‖y‖) over the elements: blind to the common factor that pictures do not determine."""
    if predicted is None:
        return None
    norms = np.linalg.norm(predicted, axis=1) * np.linalg.norm(responses, axis=1)
    return np.abs((predicted.conj() * responses).sum(axis=1)) / np.maximum(norms, 1e-30)
