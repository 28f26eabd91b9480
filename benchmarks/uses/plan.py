"""Are planned positions worth more than uniformly drawn ones?

python -m benchmarks.uses.plan --json

The places are the lab by rays, and the closet in full wave (the field in tests/data), whose positions are planned for
the field of the rays. The figures are median SSIMs of 200 other positions, predicted by helmholtz and by
inverse-distance, as means over the seeds. A seed draws the candidates and the uniform positions. In "drawn, then
planned", half of the positions are drawn uniformly, helmholtz is fitted to them, and the other half is planned with
that fit.

``open`` is the share of the variance that stays open at the test positions, by the covariance that the plan used.
``least open`` is the smallest share that this number of measurements of any kind can leave: the sum of the covariance's
other eigenvalues.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from jaxtyping import Float

from benchmarks.ledger.printing import print_figures
from learn.data.metrics import ssim
from learn.data.neighbours import inverse_distance
from learn.models.base import SpectrumModel
from learn.models.kriging.helmholtz import HelmholtzField
from learn.planning.candidates import free_candidates
from learn.planning.greedy import choose
from learn.planning.planned_fields import Field, fields_of_model, fields_of_scene
from learn.training.prediction import predict
from scenes.scene.description import Scene
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_frequency import Frequency
from simulate.dataset.receivers import ArrayReceiver
from simulate.engines.field_folder import FIELD
from simulate.fullwave.stored_field import StoredField, read_stored_field
from simulate.positions.placement import place
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import Identification
from simulate.spectra.spectrum import picture

PLANNED, TESTED, SEEDS = 100, 200, 5
TEST_SEED = 1000
"""Of the test positions, which no other seed draws."""

Points = Float[np.ndarray, "n 3"]


def dataset_at(positions: Points, scene: Scene, field: Tracer | StoredField) -> Dataset:
    """Spectra at positions, in memory."""
    beamformer, responses = Beamformer(PlanarArray.of(scene.gateway)), field.responses(positions)
    return Dataset(
        folder=Path(scene.name),
        names=[f"{number:05d}" for number in range(1, len(positions) + 1)],
        values={
            "spectrum": np.stack([picture(beamformer.spectrum(each)) for each in responses]),
            "response": responses,
        },
        receiver=ArrayReceiver(
            np.array(scene.gateway.position),
            np.array(scene.gateway.orientation),
            Identification(beamformer, "metadata", "metadata"),
        ),
        places=positions,
        train=np.arange(0),
        test=np.arange(0),
        frequency=Frequency(scene.frequency, "metadata"),
    )


def fitted(dataset: Dataset) -> HelmholtzField:
    """helmholtz, fitted to all spectra of a dataset."""
    model = HelmholtzField(np.zeros((2, 3)), dataset.beamformer, dataset.wavelength)
    model.fit(dataset, np.arange(len(dataset.positions)))
    return model


def planned(fields: list[Field], candidates: Points, known: Points, count: int) -> Points:
    """The most useful candidates."""
    return candidates[choose([field.open_at(candidates, known) for field in fields], count)[0]]


def open_share(fields: list[Field], test: Points, known: Points) -> float:
    """The share of the variance that stays open at the test positions."""
    left = [field.open_at(test, known).covariance.diagonal().real.mean() for field in fields]
    return float(sum(left) / sum(field.weight for field in fields))


def least_open(fields: list[Field], test: Points, count: int) -> float:
    """The least share that this number of measurements can leave open."""
    nothing = np.zeros((0, 3))
    spectra = [np.linalg.eigvalsh(field.open_at(test, nothing).covariance) for field in fields]
    return float(max(sum(each[: len(test) - count].sum() for each in spectra) / sum(each.sum() for each in spectra), 0))


def compare(
    scene: Scene, field: Tracer | StoredField, propagation: Propagation, count: int, tested: int, seeds: int
) -> dict[str, Any]:
    """Scores of planned and of uniform positions in a scene."""
    test = dataset_at(place(scene, "uniform", tested, TEST_SEED), scene, field)
    fields = fields_of_scene(scene, propagation, TEST_SEED + 1, SpectrumModel.report)
    names = [f"{count} uniform", f"{2 * count} uniform", f"{count} planned", f"{count} drawn, then planned"]
    scores: dict[str, list[tuple[float, float, float]]] = {name: [] for name in names}
    for seed in range(seeds):
        candidates, drawn = free_candidates(scene, seed), place(scene, "uniform", 2 * count, TEST_SEED + 2 + seed)
        begun = fitted(dataset_at(drawn[: count // 2], scene, field))
        more = planned(fields_of_model(begun), candidates, drawn[: count // 2], count - count // 2)
        sets = (
            drawn[:count],
            drawn,
            planned(fields, candidates, np.zeros((0, 3)), count),
            np.vstack([drawn[: count // 2], more]),
        )
        for name, positions in zip(names, sets, strict=True):
            known = dataset_at(positions, scene, field)
            found = predict(fitted(known), test.positions).spectra
            beside = inverse_distance(positions, known.spectra, test.positions)
            medians = [float(np.median(ssim(each, test.spectra))) for each in (found, beside)]
            scores[name].append((medians[0], medians[1], open_share(fields, test.positions, positions)))
    rows: dict[str, Any] = {}
    for name, of_seeds in scores.items():
        helmholtz, distance, left = np.array(of_seeds).T
        rows[name] = {
            "helmholtz": round(float(helmholtz.mean()), 4),
            "lowest": round(float(helmholtz.min()), 4),
            "highest": round(float(helmholtz.max()), 4),
            "inverse-distance": round(float(distance.mean()), 4),
            "open": round(float(left.mean()), 4),
        }
    all_places = place(scene, "uniform", 10 * count, TEST_SEED)
    return rows | {
        "least open": {f"{many}": round(least_open(fields, all_places, many), 4) for many in (count, 2 * count)}
    }


def main(
    field: Path = Path("tests/data/closet"),
    seeds: int = SEEDS,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare planned with uniformly drawn positions."""
    count, tested, seeds = (12, 4, 1) if smallest else (PLANNED, TESTED, seeds)
    propagation = Propagation(max_depth=0) if smallest else Propagation()
    closet, solved = load_scene("closet"), read_stored_field(field / FIELD)
    result = {"closet": compare(closet, solved, propagation, count, tested, seeds)}
    if not smallest:
        lab = load_scene("lab")
        result["lab"] = compare(lab, Tracer(lab, propagation), propagation, count, tested, seeds)
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
