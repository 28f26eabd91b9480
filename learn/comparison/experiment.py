"""A folder of measured rows. Each row is one method that was fitted and scored; none is measured twice."""

from __future__ import annotations

import datetime
import hashlib
import json
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from jaxtyping import Float, Int
from msgspec import Meta

from learn.baselines.array_ceiling import CEILING, NO_CEILING, SAMPLES, array_ceiling, has_ceiling
from learn.comparison.averaged_table import MEAN_PICTURE
from learn.comparison.known_spectra import KnownSpectra, Method
from learn.comparison.method_factories import built, checked_spectra, is_own, named, source_of
from learn.comparison.predictions import Predictions
from learn.comparison.results_folder import (
    PROTOCOL,
    SPLIT_SEED,
    ResultRow,
    ResultsFile,
    Settings,
    given_folder,
    in_common,
    read_protocol,
    row_name,
    run_folder,
)
from learn.comparison.spectrum_methods import KrigingResponses, TrainedModel, usual_methods
from learn.data.metrics import Scores, scorable, score, ssim
from learn.data.split_distances import SplitDistances, say_distances
from learn.data.splits import GUARD_MOST, SPLITS, Split, SplitKind, split
from learn.training.config import require_same_spectra
from learn.training.run_files import device_name
from scenes.files.atomic import require_writable, write_atomically
from scenes.files.errors import InputError, ParameterError, require_whole, require_within, require_word, shown
from scenes.files.input_file import MEGABYTE, parse_number, read_text
from scenes.files.json_yaml_xml import plain_values
from scenes.files.long_work import doing
from scenes.files.output_folder import own_folder
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.positions.positions import MOST_POSITIONS
from simulate.spectra.spectrum import LARGEST_GREY, evenly, spectrum_of

COLUMNS = ("ssim", "psnr_db", "mae", "aoa_error_deg")
"""Columns of the file after the first one, ``name``, which is that of the spectrum."""

LARGEST = 100 * MEGABYTE  # Largest size of the file, bytes: a hundred for each of a million spectra


def write_scores(path: Path, names: Sequence[str], scores: Scores) -> None:
    """Write the scores of K spectra."""
    columns = zip(scores.ssim, scores.psnr, scores.mae, scores.aoa_error, strict=True)
    lines = [f"{name}," + ",".join(f"{value:.6f}" for value in row) for name, row in zip(names, columns, strict=True)]
    write_atomically(path, "\n".join([",".join(["name", *COLUMNS]), *lines, ""]).encode())


def read_scores(path: Path) -> dict[str, Float[np.ndarray, " K"]]:
    """Read what ``write_scores`` wrote: the scores of K spectra, by ``COLUMNS``."""
    expected = "the scores of each test spectrum"
    lines = read_text(path, expected, LARGEST).splitlines()
    header = ",".join(["name", *COLUMNS])
    if lines[:1] != [header]:
        raise InputError(f"{path}, line 1: expected the header {header}, found {shown(''.join(lines[:1]))}")
    values = [_numbers(line) for line in lines[1:]]
    if None in values:
        number = values.index(None) + 1
        found = shown(lines[number])
        raise InputError(f"{path}, line {number + 1}: expected a name and {len(COLUMNS)} finite numbers, found {found}")
    if not values:
        raise InputError(f"{path}: expected {expected}, found none")
    return dict(zip(COLUMNS, np.array(values).T, strict=True))


def _numbers(line: str) -> list[float] | None:
    """The numbers of a line. None: there are more or fewer than expected, or one is not a finite number."""
    _, *texts = line.split(",")
    try:
        values = [parse_number(text) for text in texts]
    except ValueError:
        return None
    return values if len(values) == len(COLUMNS) and np.isfinite(values).all() else None


class Row(ResultRow, frozen=True, kw_only=True):
    """The keys that every line of results.jsonl has. Further keys are scores and costs."""

    test: Annotated[int, Meta(ge=1)]
    ssim_median: float


class Experiment:
    """A folder with protocol.json, results.jsonl, per_sample/, and the methods' own folders in runs/."""

    def __init__(self, folder: Path, dataset: Dataset, settings: Settings):
        self.folder, self.dataset, self.settings = folder, dataset, settings
        self.kept = ResultsFile(folder, Row)
        self._mean_picture_ssim: dict[int | None, float] = {}  # by the number of training spectra

    @cached_property
    def parts(self) -> Split:
        """The split with the whole training part."""
        return self._parts(None)

    def _parts(self, train_size: int | None) -> Split:
        settings = self.settings
        return split(self.dataset, settings.split, settings.split_seed, train_size, settings.guard or 0.0)

    @cached_property
    def test(self) -> Int[np.ndarray, " K"]:
        """The spectra on which every method is scored: those of the test part that are not constant."""
        return self.settings.tested(scorable(self.dataset, self.parts.test))

    @cached_property
    def distances(self) -> SplitDistances:
        """Distances from the test positions to the nearest ones of the whole known part."""
        return self._distances(self.test, None)

    def measure(
        self, methods: Mapping[str, Callable[[], Method]], seeds: int, sizes: Sequence[int | None] = (None,)
    ) -> None:
        """Measure the rows that are missing: all methods with the first seed, then all with the next one."""
        self.kept.require_file_names(methods)
        built_once = {label: built(label, make) for label, make in methods.items()}
        for label, method in built_once.items():
            if isinstance(method, Predictions):
                if len(sizes) > 1 or sizes[0] is not None:
                    raise ParameterError("models", f"expected methods that are fitted, found the predictions {label}")
                self._read(method)  # refuses wrong ones before anything is fitted
        unsuited = {label: self._unsuited(method) for label, method in built_once.items()}
        methods = {label: make for label, make in methods.items() if unsuited[label] is None}
        for label, why in unsuited.items():
            if why is not None and not methods:
                raise InputError(f"{label}: {why}")
            if why is not None:
                say(f"left out {label}: {why}")
        for size in sizes:  # a size that is too large is refused before anything is measured
            self._parts(size)
        for seed in range(seeds):
            for size in sizes:
                for label, make in methods.items():
                    if not (seed and isinstance(built_once[label], Predictions)):  # which no seed changes
                        self._measure_row(label, make, seed, size)

    def _read(self, method: Predictions) -> None:
        """Read the predictions of the test part, of which the scored ones are kept."""
        row_of = {index: row for row, index in enumerate(self.parts.test.tolist())}
        names = [self.dataset.names[index] for index in row_of]
        method.read(names, [row_of[index] for index in self.test.tolist()])

    def _unsuited(self, method: Method) -> str | None:
        """Why one of our methods cannot be used on the dataset. None: it can be."""
        return method.unsuited(self.dataset) if isinstance(method, TrainedModel | KrigingResponses) else None

    def _measure_row(self, label: str, make: Callable[[], Method], seed: int, train_size: int | None) -> None:
        key = {"label": label, "seed": seed, "train_size": train_size}
        name, method = row_name(key), built(label, make)
        predicted = isinstance(method, Predictions)
        if isinstance(method, Predictions):
            self._read(method)
        source = source_of(label, method, usual_methods())
        if self.kept.is_measured(key, name, is_own(method), source):
            return
        say(name)
        known_as = {} if source is None else {"source": source}
        settings, folder = self.settings, self.folder / run_folder({**key, **known_as})
        known = KnownSpectra(
            self.dataset,
            settings.split,
            settings.split_seed,
            train_size,
            seed,
            settings.minutes,
            settings.steps,
            folder,
            settings.guard or 0.0,
        )
        began = time.perf_counter()
        with named(label, method, "fit to learn from what is known"):
            method.fit(known)
        seconds = getattr(method, "seconds", time.perf_counter() - began)
        test, positions = self.test, self.dataset.positions[self.test]
        doing(f"{name}: predicting and scoring {len(positions):,} test spectra")
        began = time.perf_counter()
        with named(label, method, "predict to return spectra"):
            prediction = checked_spectra(label, method.predict(positions), len(positions))
        milliseconds = 1e3 * (time.perf_counter() - began) / len(positions)
        scores = score(np.clip(prediction, 0, 1), self._spectra(test), self.dataset.grid, self.dataset.array)
        cost = {
            "train": len(known.parts.train),
            "known": len(known.parts.known),
            "parameters": getattr(method, "parameters", None),
            "steps": getattr(method, "steps", None),
            "training_seconds": None if predicted else round(seconds, 1),
            "milliseconds_per_spectrum": None if predicted else round(milliseconds, 2),
            MEAN_PICTURE: self._ssim_of_mean_picture(known),
        }
        self._keep(key, test, scores, {**cost, **known_as})

    def measure_ceiling(self) -> None:
        """Measure the row of the array's ceiling, a bound that is fitted to the test spectra themselves."""
        key = {"label": CEILING, "seed": 0, "train_size": None}
        if self.kept.row(key) is not None:
            return
        if not has_ceiling(self.dataset):
            say(f"the array's ceiling is left out: {NO_CEILING}")
            return
        test = evenly(self.test, SAMPLES)
        doing(f"the array's ceiling for {len(test):,} test spectra")
        truth = self._spectra(test)
        recorded = None if self.dataset.responses is None else self.dataset.responses[test]
        bound = array_ceiling(truth, self.dataset.beamformer, recorded)
        self._keep(key, test, score(bound, truth, self.dataset.grid, self.dataset.array), {})

    def _ssim_of_mean_picture(self, known: KnownSpectra) -> float:
        """Median SSIM of the mean of the known spectra on the test spectra."""
        if known.train_size not in self._mean_picture_ssim:
            mean = self.dataset.pictures[known.parts.known].mean(axis=0) / LARGEST_GREY
            truth = self._spectra(self.test)
            self._mean_picture_ssim[known.train_size] = float(
                np.median(ssim(np.broadcast_to(mean, truth.shape), truth))
            )
        return self._mean_picture_ssim[known.train_size]

    def _distances(self, test: Int[np.ndarray, " K"], train_size: int | None) -> SplitDistances:
        """Distances from test positions to the nearest known ones, where so many spectra are trained on."""
        known, positions = self._parts(train_size).known, self.dataset.positions
        return SplitDistances.between(positions[known], positions[test], self.dataset.wavelength)

    def _spectra(self, indices: Int[np.ndarray, " K"]) -> Float[np.ndarray, "K 90 360"]:
        return spectrum_of(self.dataset.pictures[indices])

    def _keep(self, key: dict[str, Any], test: Int[np.ndarray, " K"], scores: Scores, cost: dict[str, Any]) -> None:
        """Write the scores of each spectrum to per_sample/, and the row to results.jsonl in place of an old one."""
        names = [self.dataset.names[index] for index in test]
        write_scores(self.folder / "per_sample" / f"{row_name(key)}.csv", names, scores)
        distances = self._distances(test, key["train_size"]).facts()
        date = datetime.date.today().isoformat()
        self.kept.keep(key, {"test": len(test), **scores.summary(), **cost, **distances, "date": date})


@contextmanager
def begun(
    dataset: Dataset | Path | str,
    split: SplitKind,
    output: Path | str | None,
    *,
    minutes: float | None = None,
    steps: int | None = None,
    test_spectra: int | None = None,
    guard: float = 0.0,
) -> Iterator[Experiment]:
    """Begin an experiment in a new folder, or continue the one in a folder, and keep other processes from it."""
    require_word(SPLITS, split=split)
    given_output = given_folder(output)
    if test_spectra is not None:
        require_whole(1, MOST_POSITIONS, test_spectra=test_spectra)
    require_within(0, GUARD_MOST, "wavelengths", guard=guard)
    if given_output is not None:
        require_writable(given_output / PROTOCOL)
    dataset = dataset if isinstance(dataset, Dataset) else read_dataset(dataset)
    where, by = str(dataset.folder.resolve()), device_name()
    settings = Settings(
        *(where, split, SPLIT_SEED, minutes, steps, by, test_spectra, dataset.fingerprint, guard or None),
        index_sha256=_index_digest(dataset) if split == "files" else None,
    )
    folder = given_output or Path(tempfile.mkdtemp(prefix="bisplat-"))
    experiment = Experiment(folder, dataset, settings)
    distances = experiment.distances  # refuses splits and test spectra that are of no use, before anything is written
    given = {key: value for key, value in asdict(settings).items() if value is not None}
    chosen = in_common(given)
    with own_folder(folder, "experiment", PROTOCOL, chosen, lambda path: in_common(read_protocol(path))):
        if (folder / PROTOCOL).exists():
            before = read_protocol(folder / PROTOCOL)
            require_same_spectra(dataset, folder, before["dataset_sha256"])
            if before.get("index_sha256") != settings.index_sha256:
                raise InputError(
                    f"{dataset.folder}: expected the index files with which {folder} was begun, found others; compare "
                    "in another folder"
                )
        write_atomically(folder / PROTOCOL, (json.dumps(plain_values(given), indent=2) + "\n").encode())
        say_distances(distances)
        yield experiment


def _index_digest(dataset: Dataset) -> str:
    """SHA-256 of what the index files name."""
    parts = [[dataset.names[row] for row in part] for part in (dataset.train, dataset.test)]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()
