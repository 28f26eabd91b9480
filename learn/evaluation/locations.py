"""Errors of located test transmitters, and those of copying the positions of similar known spectra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from learn.localisation.fingerprints import Fingerprints
from learn.localisation.locate import locate
from learn.localisation.located_places import Place, share_in_region
from learn.localisation.observations import require_unseen
from learn.models.base import Report
from learn.training.run_folder import Run, load_run
from scenes.files.errors import InputError
from simulate.dataset.dataset import Dataset
from simulate.spectra.spectrum import evenly

LOCATED = 200  # Largest number of test transmitters that are located, evenly spread over the test part

NEAREST = (1, 4)  # Numbers of most similar known spectra whose positions the fingerprint baseline averages


@dataclass(frozen=True)
class Locations:
    """K located test transmitters."""

    names: list[str]  # names of their spectra
    truth: Float[np.ndarray, "K 3"]  # [K, 3] their true positions, metres, world frame
    places: list[list[Place]]  # the places where each may be, from ``bisplat.locate``
    known: Float[np.ndarray, "n 3"]  # [n, 3] known positions, metres
    further_runs: list[str]  # names of the runs of further gateways
    # [K, 3] mean position of the k most similar known spectra, metres, for each k of ``NEAREST``
    by_fingerprint: dict[int, Float[np.ndarray, "K 3"]]

    @property
    def errors(self) -> dict[str, Float[np.ndarray, " K"]]:
        """Distances to the truth, metres, by method: "model", "fingerprint", "fingerprint, mean of 4"."""
        found = {"model": np.stack([each[0].position for each in self.places])}
        for count, positions in self.by_fingerprint.items():
            found["fingerprint" if count == 1 else f"fingerprint, mean of {count}"] = positions
        return {name: np.linalg.norm(positions - self.truth, axis=1) for name, positions in found.items()}

    def metrics(self) -> dict[str, float | int]:
        """Medians and 90th percentiles of the errors (cm), and how often stated 90 % regions hold the true position."""
        metrics: dict[str, float | int] = {"located": len(self.truth)}
        for name, errors in self.errors.items():
            key = {"model": "", "fingerprint": "_fingerprint"}.get(name, "_fingerprint_4")
            metrics[f"location_error_median_cm{key}"] = 100 * float(np.median(errors))
            metrics[f"location_error_p90_cm{key}"] = 100 * float(np.percentile(errors, 90))
        within = share_in_region([each[0] for each in self.places], self.truth, self.known)
        if within is not None:
            metrics["within_90_percent_region"] = within
        metrics["of_several_places"] = float(np.mean([len(each) > 1 for each in self.places]))
        return metrics


class Heard(NamedTuple):
    """Test transmitters that one or several gateways received."""

    runs: list[Run]  # a trained run for each gateway
    datasets: list[Dataset]  # their datasets, of the same transmitters
    known: Int[np.ndarray, " n"]  # indices of the spectra that the first run knows
    test: Int[np.ndarray, " K"]  # indices of the test spectra that are to be located


def heard_by(runs: Sequence[Run | Path]) -> Heard:
    """The test transmitters of a run's dataset, at most ``LOCATED``. Pictures of one grey level are left out."""
    loaded = [run if isinstance(run, Run) else load_run(run) for run in runs]
    datasets = [run.dataset() for run in loaded]
    parts = loaded[0].split(datasets[0])
    test = parts.test
    for run, dataset in zip(loaded[1:], datasets[1:], strict=True):
        _require_same(datasets[0], dataset)
        trained = np.intersect1d(run.split(dataset).known, test)
        require_unseen(run, loaded[0], [dataset.names[index] for index in trained])
    # A picture of one brightness has no fingerprint.
    told = np.any([np.ptp(dataset.pictures[test], axis=(1, 2)) > 0 for dataset in datasets], axis=0)
    if not told.any():
        raise InputError(
            f"{datasets[0].folder}: expected test spectra of several grey levels, found none in {len(test)}"
        )
    return Heard(loaded, datasets, parts.known, evenly(test[told], LOCATED))


def evaluate_locations(heard: Heard, report: Report = lambda phase, done, total: None) -> Locations:
    """Locate test transmitters from their pictures."""
    runs, datasets, known, test = heard
    pictures = [each.pictures[test] for each in datasets]
    alike = np.zeros((len(test), len(known)))
    for dataset in datasets:
        fingerprints = Fingerprints(dataset.beamformer)
        alike += fingerprints.of_pictures(dataset.pictures[test]) @ fingerprints.of_pictures(dataset.pictures[known]).T
    nearest = known[np.argsort(-alike, axis=1)]
    positions = datasets[0].positions
    return Locations(
        names=[datasets[0].names[each] for each in test],
        truth=positions[test],
        places=locate(runs, pictures, report, positions[known]),
        known=positions[known],
        further_runs=[run.name for run in runs[1:]],
        by_fingerprint={count: positions[nearest[:, :count]].mean(axis=1) for count in NEAREST},
    )


def _require_same(one: Dataset, other: Dataset) -> None:
    same = one.names == other.names and np.allclose(one.positions, other.positions, atol=1e-6)
    if not same:
        raise InputError(
            f"{other.folder}: expected spectra of the same transmitters as in {one.folder}, found other names or other "
            "positions"
        )
