"""Cross-validation: a model's predictions compared with a fresh simulation at positions that are in no dataset."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from learn.data.metrics import Scores, require_scorable, require_some, score, varies
from learn.data.same_receiver import other_array, require_same_frequency
from learn.data.split_distances import SplitDistances
from learn.quantities.complex_scores import correlation
from learn.training.config import Origin
from learn.training.run_folder import Run, SpectrumRun, load_spectra
from scenes.files.errors import (
    InputError,
    require_instance,
    require_path,
    require_seed,
    require_whole,
)
from scenes.files.progress import progress_bar
from scenes.scene.description import Scene
from scenes.scene.shapes import bounding_box
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import require_fixed_array
from simulate.dataset.rooms_folder import at_its_frequency
from simulate.engines.engine import Engine, ResponseSource, Setting
from simulate.engines.engine_table import engine_class, engine_of
from simulate.engines.fullwave_engine import FullWave
from simulate.engines.rays_engine import seed_of_rays
from simulate.generation.simulation import simulate
from simulate.parallel.machines import Machines
from simulate.positions.placement import free_positions
from simulate.positions.positions import LEAST_POSITIONS, MOST_POSITIONS
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import Array
from simulate.spectra.element_array import array_of
from simulate.spectra.spectrum import picture, spectrum_of

STREAM = 2
"""Number of the random stream of the positions, which is another one than that of the positions of a dataset. A dataset
with the same seed would otherwise have nearly the same positions."""

SAME_SPACING = 0.003
"""Wavelengths. Spacings of a scene and of a run that differ by less count as equal: a fit is no more precise."""


@dataclass(frozen=True)
class CrossValidation:
    """Predicted and freshly simulated spectra at the same K new positions, without positions where nothing is received.

    Attributes:
        run_name: name of the run's folder.
        scene_name: name of the simulated scene.
        truth_by: what the truth comes from, for the user: "fresh ray tracing" or "full wave".
        positions: [K, 3] new transmitter positions, metres, world frame.
        known_positions: [n, 3] transmitter positions of the spectra that the run learned from, metres, world frame.
        prediction: [K, 90, 360] predicted spectra, 0…1, float32.
        truth: [K, 90, 360] spectra of the simulated responses, 0…1, float32, rounded to eight bits as in a dataset.
        grid: directions of the spectra's rows and columns.
        array: the array that measures them.
        scores: scores of the prediction.
        correlation: [K] correlation ``|⟨ŷ, y⟩| / (‖ŷ‖ ‖y‖)`` of predicted responses ŷ and simulated responses y, 0…1.
            It does not depend on the common factor that a spectrum leaves open. None: the model predicts no responses.
        origin: what the run was trained on.
        distances: distances from the new positions to the nearest known ones.
    """

    run_name: str
    scene_name: str
    truth_by: str
    positions: Float[np.ndarray, "K 3"]
    known_positions: Float[np.ndarray, "n 3"]
    prediction: Float[np.ndarray, "K 90 360"]
    truth: Float[np.ndarray, "K 90 360"]
    grid: AngularGrid
    array: Array
    scores: Scores
    correlation: Float[np.ndarray, " K"] | None
    origin: Origin
    distances: SplitDistances

    def __len__(self) -> int:
        return len(self.positions)

    def __repr__(self) -> str:
        median = np.median(self.scores.ssim)
        return f"CrossValidation({self.run_name!r}: {len(self)} positions, median SSIM {median:.3f})"

    def metrics(self) -> dict[str, Any]:
        """Medians and means over the K spectra.

        Returns:
            The entries of ``Scores.summary``, "positions" (K) and, if the model predicts responses,
            "channel_correlation_median". The file crossvalidation.json has the same entries.
        """
        metrics: dict[str, Any] = {**self.scores.summary(), "positions": len(self.positions)}
        if self.correlation is not None:
            metrics["channel_correlation_median"] = float(np.median(self.correlation))
        return metrics


def crossvalidate(
    run: Run | Path | str,
    scene: Scene | Path | str,
    positions: int = 100,
    seed: int = 1,
    engine: str | Engine | None = None,
    field: Path | str | None = None,
) -> CrossValidation:
    """Compare a run with a fresh simulation at new positions, by rays or by full wave.

    The new positions are in no dataset, so that no split can leak. The function writes no report;
    ``bisplat crossvalidate`` does. A full-wave field that has to be solved is kept in the run's folder.

    If both are given, ``field`` is used rather than ``engine``.

    Args:
        run: a trained run, or its folder.
        scene: the scene that the run's dataset was simulated in: a scene, the name of a built-in one, or a YAML file.
        positions: number of new positions. They are drawn uniformly among the free places in the bounding box of the
            positions that the run learned from.
        seed: seed of the new positions.
        engine: what computes the truth. None, or the name of the engine that made the dataset: that engine, with its
            options and with what it has kept in the dataset's folder. Another name: that engine with its default
            options. An engine: this engine as it is; a field that it needs is solved in the run's folder.
        field: folder of a full-wave dataset of the same place, whose stored field is the truth.

    Returns:
        Predicted and simulated spectra at the new positions, and the scores.

    Raises:
        InputError: the run, its dataset, the field or the scene cannot be read; no gateway of the scene has the
            position and orientation of the dataset's gateway; this gateway has another array or frequency than the
            run; the array has fewer than three elements; or nothing is received at any of the positions.
        ParameterError: ``positions`` or ``seed`` is not a whole number in its range, or no engine has this name.

    Example:
        >>> fresh = crossvalidate("runs/lab", "lab", positions=5)
        >>> fresh.positions.shape, fresh.truth.shape
        ((5, 3), (5, 90, 360))
        >>> fresh.truth_by, fresh.metrics()["positions"], fresh.scores.ssim.shape
        ('fresh ray tracing', 5, (5,))
    """
    require_whole(1, MOST_POSITIONS, positions=positions)
    require_seed(seed=seed)
    if engine is not None:
        require_instance(str, Engine, engine=engine)
    if isinstance(engine, str):
        engine_class(engine)  # refuses an unknown name
    if field is not None:
        require_path(field=field)
    run = load_spectra(run)
    dataset = run.dataset()
    scene = at_its_frequency(seen_by(dataset, scene if isinstance(scene, Scene) else load_scene(scene)), dataset)
    require_same_frequency(scene.name, run.folder, dataset.wavelength, scene.wavelength)
    require_scorable(run.beamformer.array, str(run.folder))
    array, expected = array_of(scene.gateway, scene.frequency), run.beamformer.array
    if other_array(expected, array, SAME_SPACING):
        raise InputError(f"{scene.name}: expected the array of the run, {expected.in_words}, found {array.in_words}")
    parts = run.split(dataset)
    known = dataset.positions[parts.known]
    region = bounding_box(known)
    drawn = free_positions(scene, region, positions, np.random.default_rng([seed, STREAM]))
    # As in ``simulate``, so that a ray tracer of the dataset need not search again.
    everywhere = bounding_box(np.vstack([scene.transmitter.region, known]))
    setting = Setting(scene, everywhere, seed_of_rays(dataset.metadata))
    source: ResponseSource
    if field is not None:
        FullWave(field=Path(field)).for_scene(scene)  # refuses the field of another scene
        source, truth_by = FullWave.kept(setting, Path(field)), FullWave.called
    else:
        source, truth_by = _source(dataset, setting, run, engine)
    responses = source.responses(drawn)
    truth = spectrum_of(picture(run.beamformer.spectrum(responses)))
    told = varies(truth)  # not where nothing is received
    require_some(told, scene.name)
    drawn, responses, truth = drawn[told], responses[told], truth[told]
    prediction = run.predict(drawn)
    of_responses = None
    if prediction.responses is not None:
        of_responses = correlation(prediction.responses, responses)
    return CrossValidation(
        run_name=run.name,
        scene_name=scene.name,
        truth_by=truth_by,
        positions=drawn,
        known_positions=known,
        prediction=prediction.spectra,
        truth=truth,
        grid=run.beamformer.grid,
        array=run.beamformer.array,
        scores=score(prediction.spectra, truth, run.beamformer.grid, run.beamformer.array),
        correlation=of_responses,
        origin=Origin.of(run.config, parts, run.dataset_sha256),
        distances=SplitDistances.between(known, drawn, dataset.wavelength),
    )


def _source(
    dataset: Dataset, setting: Setting, run: SpectrumRun, engine: str | Engine | None
) -> tuple[ResponseSource, str]:
    """The source of the true responses, and its name for the user."""
    made_by = engine_of(dataset.metadata)
    if engine is None or engine == made_by.name:
        by, folder = made_by, dataset.folder
    else:
        by, folder = engine_class(engine)() if isinstance(engine, str) else engine, run.folder
    if not by.keeps_source:
        by = by.for_scene(setting.scene)
        by.require(setting, folder, Machines())
        with progress_bar() as progress:
            return by.source(setting, folder, Machines(), progress), by.called
    if folder != dataset.folder:
        folder = simulate(setting.scene, run.folder / by.name, LEAST_POSITIONS, engine=by).folder
    return by.kept(setting, folder), by.called


def seen_by(dataset: Dataset, scene: Scene) -> Scene:
    """Choose the gateway of a scene for which a dataset was simulated."""
    require_fixed_array(dataset, "fresh simulation in its scene")
    for scene_of_gateway in scene.by_gateway().values():
        gateway = scene_of_gateway.gateway
        distance = np.linalg.norm(np.subtract(gateway.position, dataset.gateway_position))
        # The absolute value, since the quaternions q and −q are the same orientation.
        orientation_product = abs(np.dot(gateway.orientation, dataset.gateway_orientation))
        if distance < 1e-3 and orientation_product > 1 - 1e-5:
            return scene_of_gateway
    raise InputError(
        f"{scene.name}: expected a gateway at {dataset.gateway_position.round(3).tolist()}, oriented as in "
        f"{dataset.folder / 'gateway_info.yml'}, found {list(scene.gateway.position)}"
    )
