"""Comparison of methods for any quantity: fitted to the same known rows, scored on the same test rows."""

from __future__ import annotations

import datetime
import time
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from learn.comparison.averages import average_name
from learn.comparison.cases import Cases, ManyRooms, OneDataset
from learn.comparison.comparison import Comparison
from learn.comparison.given_methods import (
    built,
    check_effort,
    checked_sizes,
    chosen_methods,
    is_own,
    named,
    source_of,
)
from learn.comparison.predictions import Predictions
from learn.comparison.results_folder import Results, Settings, results_in, run_folder
from learn.data.split_distances import say_distances
from learn.data.splits import GUARD_MOST, SPLITS, SplitKind
from learn.methods.table import BASELINES, methods_of, require_scene, usual_names
from learn.methods.trained_model import TrainedModel
from learn.quantities.known import Known, MakesMethod, Method
from learn.quantities.quantity import Prediction, Quantity
from learn.quantities.spectra import SpectraInRooms
from learn.quantities.table import QuantityName, quantity_named, quantity_of
from learn.training.config import require_untested
from learn.training.run_files import device_name
from learn.training.run_folder import Run, load_run
from scenes.files.errors import (
    InputError,
    ParameterError,
    require_instance,
    require_path,
    require_seed,
    require_whole,
    require_within,
    require_word,
)
from scenes.files.plain_text import say
from scenes.scene.description import Scene
from simulate.csi.csi_dataset import CsiDataset, read_csi
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import Rooms, read_dataset, read_rooms
from simulate.dataset.dataset_kinds import is_csi, is_rooms, is_rssi
from simulate.positions.positions import MOST_POSITIONS
from simulate.rssi.rssi_dataset import RssiDataset, read_rssi

Methods = Sequence[str] | Mapping[str, str | Method | MakesMethod]
"""Names of methods, or a dictionary from labels to methods; ``compare`` describes both."""


def compare(
    data: Dataset | Rooms | Path | str,
    methods: Methods | None = None,
    *,
    quantity: QuantityName | None = None,
    split: SplitKind = "files",
    sizes: Sequence[int] | None = None,
    seed: int = 0,
    guard: float = 0.0,
    seeds: int = 1,
    budget: float = 5.0,
    steps: int | None = None,
    tested: int | None = None,
    test_rooms: int | None = None,
    scene: Scene | Path | str | None = None,
    init: Run | Path | str | None = None,
    output: Path | str | None = None,
) -> Comparison:
    """Fit and score methods on one split, on several sizes of its training part, or in rooms never seen before.

    Every method learns from the same known rows, those of the training and the validation part, and is scored on the
    same test rows by the same code. Baselines that learn nothing are always in. Spectra also have a row for the array's
    ceiling, a bound that is fitted to the test spectra themselves. ``bisplat compare`` also makes figures.

    In a folder of rooms, the last ones are test rooms. In each, a random fifth of the spectra is tested, and L of the
    others are known. A method with ``learn(datasets, minutes, seed)`` is given the datasets of the other rooms before.

    A method is an object with two methods. ``fit(known)`` learns from ``known.positions`` [n, 3] (metres) and
    ``known.values`` [n, …]: spectra [90, 360] from 0 to 1, received powers in dBm [gateways] (NaN where nothing was
    received), responses [elements, subcarriers], or channels of the downlink [antennas, subcarriers], with those of
    the uplink as ``known.given``. It may use ``known.dataset``, ``known.rows``, ``known.seed`` and ``known.minutes``.
    ``predict(positions)`` takes positions [K, 3], and of channels ``predict(positions, given)`` also uplinks. It
    returns values [K, …], or an object with ``value`` and, where they are stated, ``deviation`` [K], or ``low`` and
    ``high``, the ends of the 90 % interval.

    Args:
        data: a dataset or rooms, or their folder.
        methods: names of methods (documentation, Train and compare models), of your own classes ("module:Class"), or
            "LABEL=FOLDER" with the predictions of another program for all test rows, in the order of
            ``split(...).test``: spectra.npy, powers.npy, responses.npy or channels.npy, or spectrum/NAME.png. Or a
            dictionary from the label of a row to one of these: a name, a class with ``fit`` and ``predict``, a function
            that returns an object with both, or such an object, which is copied for each fit. None: of spectra all that
            need no options, of other quantities and in rooms those that take seconds.
        quantity: what is predicted: "spectrum", "response" (over a band), "power" or "channel". None: what the data
            mainly hold.
        split: how the test part is chosen: "files" (the folder's index files), "random" (a random fifth), "blocked"
            (every fourth block of ten consecutive rows) or "area" (connected areas with a fifth).
        sizes: numbers of training rows, of rooms of known spectra (None: those of 5, 10, 25, 50 and 100 that there
            are). Each smaller part is contained in every larger one; the test part is the same. None: all rows.
        seed: seed of the split.
        guard: known positions nearer than this to a test position are left out, wavelengths.
        seeds: number of fits of each method, with seeds 0, 1, …
        budget: training time of each method that is trained by steps, minutes by the clock.
        steps: number of training steps of each such model of spectra, instead of the budget; the same on every machine.
        tested: largest number of test rows to score, evenly spread over the test part, in each room. None: all.
        test_rooms: number of test rooms. None: a quarter of them.
        scene: the scene as described, which "twin" for received powers corrects.
        init: a finished run, or its folder. Its model is also trained from its weights, in rows "MODEL from FOLDER".
        output: folder for results.jsonl, per_sample/ and runs/. The same call again makes the rows that are missing.
            None: nothing is kept.

    Returns:
        The scores, with those that the output has from earlier calls.

    Raises:
        InputError: the data cannot be read, lack the quantity, or have too few rows or no index files for the split; or
            something went wrong in a method of your own; or the output has a comparison with other settings or of
            other files, or another process writes to it.
        ParameterError: a method or the split is unknown, a method lacks ``fit``, or an argument is out of its range.

    Example:
        >>> import bisplat, numpy as np
        >>> class Grey:
        ...     def fit(self, known):
        ...         self.mean = known.values.mean()
        ...
        ...     def predict(self, positions):
        ...         return np.full((len(positions), 90, 360), self.mean)
        >>> comparison = bisplat.compare("data/lab", {"grey": Grey}, sizes=[5, 10])
        >>> [row["train_size"] for row in comparison if row["label"] == "grey"]
        [5, 10]
    """
    check_effort(budget, seeds, steps)
    require_seed(seed=seed)
    require_word(SPLITS, split=split)
    require_within(0, GUARD_MOST, "wavelengths", guard=guard)
    if tested is not None:
        require_whole(1, MOST_POSITIONS, tested=tested)
    if output is not None:
        require_path(output=output)
    given: Any = read_data(data)
    kind = "room" if isinstance(given, Rooms) else quantity or quantity_of(given)
    of = SpectraInRooms() if kind == "room" else quantity_named(kind)
    require_scene(kind, methods, scene)
    known = methods_of(kind, given, scene)
    chosen = chosen_methods(methods, known, usual_names(kind, known), models=kind == "spectrum")
    asked = checked_sizes(sizes, of.things)
    run = init if init is None or isinstance(init, Run) else load_run(init)
    if run is not None:
        chosen |= _continued(run, kind)
    missing = [name for name in BASELINES[kind] if name not in chosen]
    chosen = {**{name: known[name] for name in missing}, **chosen}
    if isinstance(given, Rooms):
        cases: Cases = (rooms := ManyRooms(given, test_rooms, tested, seed))
        asked, digest, index = rooms.sizes(asked), rooms.fingerprint, ""
        test_rooms = len(rooms.tests)
    else:
        of.require(given)
        cases = (one := OneDataset(given, of, split, seed, guard, tested))
        for size in asked:
            one.parts(size)  # refuses a size that is too large before anything is measured
        if len(one.test) and run is not None and run.is_trained_on(given):
            require_untested(run.split(given).known, run.folder, given, one.parts(None))
        digest, index = of.fingerprint(given), one.index_sha256
        stated, distances = of.stated(given), one.distances(asked[-1])
        if stated is not None:
            say(stated)
    settings = Settings(
        dataset=str(given.folder.resolve()),
        quantity=of.name,
        split="rooms" if isinstance(given, Rooms) else split,
        seed=seed,
        guard=float(guard),
        minutes=float(budget) if steps is None else None,
        steps=steps,
        device=device_name(),
        tested=tested,
        test_rooms=test_rooms,
        data_sha256=digest,
        index_sha256=index,
    )
    folder = None if output is None else Path(output)
    with results_in(folder, settings, of.ranked_by) as kept:
        if isinstance(cases, OneDataset) and distances is not None:
            say_distances(distances)
        measuring = _Measuring(of, cases, settings, kept, kind, known)

        def so_far() -> Comparison:
            rows, truth = kept.rows, cases.tests[0]
            expected = of.arrays(of.of(truth[0], truth[1]))
            if isinstance(given, Rooms):
                return Comparison(quantity=of, settings=settings, folder=folder, rows=rows, dataset=given)
            each = {average_name(row): kept.arrays(row, expected) for row in rows if row["seed"] == 0}
            parts = one.parts(max((row["train_size"] or 0 for row in rows), default=0) or None)
            return Comparison(
                quantity=of,
                settings=settings,
                folder=folder,
                rows=rows,
                each=each,
                dataset=given,
                parts=parts,
                test=one.test,
                distances=distances,
            )

        try:
            measuring.measure(chosen, seeds, asked)
        except KeyboardInterrupt:
            if kept.rows:
                say(f"interrupted; the table so far:\n{so_far()}")
            raise
        return so_far()


def read_data(data: Any) -> Any:
    """A dataset of any kind or rooms, which may be given as their folder."""
    require_instance(Dataset, RssiDataset, CsiDataset, Rooms, str, PathLike, data=data)
    if not isinstance(data, str | PathLike):
        return data
    folder = Path(data)
    for holds, read in ((is_rooms, read_rooms), (is_rssi, read_rssi), (is_csi, read_csi)):
        if holds(folder):
            return read(folder)
    return read_dataset(folder)


def _continued(run: Run, kind: str) -> dict[str, Callable[[], Any]]:
    """The model of a run, trained from its weights."""
    if kind != "spectrum":
        raise ParameterError("init", "expected none but for spectra, whose models start from weights, found one")
    model = run.config.model
    if run.config.by_steps is None:
        raise ParameterError("init", f"expected a run of a model that is trained by steps, found one of {model}")
    start = str(run.folder.resolve())
    return {f"{model} from {run.name}": lambda: TrainedModel(model, dict(run.config.options), init=start)}


class _Measuring:
    """Fits and scores methods where the row is missing: all with the first seed, then all with the next one."""

    def __init__(
        self,
        quantity: Quantity,
        cases: Cases,
        settings: Settings,
        kept: Results,
        kind: str,
        known: Mapping[str, Callable[[], Any]],
    ):
        self.quantity, self.cases, self.settings, self.kept, self.ours = quantity, cases, settings, kept, known

    def measure(self, methods: Mapping[str, Callable[[], Any]], seeds: int, sizes: Sequence[int | None]) -> None:
        self.kept.require_file_names(methods)
        methods = self._suited(methods, sizes)
        number, total = 0, seeds * len(sizes) * len(methods)
        for seed in range(seeds):
            for label, make in methods.items():
                learned = None
                for size in sizes:
                    number += 1
                    key = {"label": label, "seed": seed, "train_size": size}
                    method = built(label, make) if learned is None else learned
                    if isinstance(method, Predictions):
                        if seed:  # which no seed changes
                            continue
                        self._read(method)
                    source, name = source_of(label, method, self.ours), average_name(key)
                    if self.kept.is_measured(key, name, is_own(method), source):
                        continue
                    say(f"{name}, seed {seed} ({number} of {total})")
                    if learned is None and hasattr(method, "learn"):
                        with named(label, method, "learn to learn from rooms"):
                            method.learn(self.cases.training, self.settings.minutes, seed)
                        learned = method
                    self._measure(key, method, source)
        self._measure_bound()

    def _suited(
        self, methods: Mapping[str, Callable[[], Any]], sizes: Sequence[int | None]
    ) -> dict[str, Callable[[], Any]]:
        """The methods without those that cannot be used on the data, after a word on each."""
        dataset, found = self.cases.tests[0][0], {}
        for label, make in methods.items():
            method = built(label, make)
            why = method.unsuited(dataset) if callable(getattr(method, "unsuited", None)) else None
            if isinstance(method, Predictions):
                if list(sizes) != [None]:
                    raise ParameterError("methods", f"expected methods that are fitted, found the predictions {label}")
                self._read(method)  # refuses wrong ones before anything is fitted
            elif hasattr(method, "learn") and not self.cases.training:
                why = "expected a training room to learn in, found none"
            if why is None:
                found[label] = make
            elif len(methods) == 1 + len(found):
                raise InputError(f"{label}: {why}")
            else:
                say(f"left out {label}: {why}")
        return found

    def _read(self, method: Predictions) -> None:
        """Read the predictions of the test part, of which the scored ones are kept."""
        assert isinstance(self.cases, OneDataset)
        dataset, rows = self.cases.dataset, self.cases.parts(None).test
        row_of = {index: row for row, index in enumerate(rows.tolist())}
        names = getattr(dataset, "names", None) or [str(index) for index in range(len(dataset))]
        shape = self.quantity.of(dataset, rows[:1]).shape[1:]
        method.read(self.quantity, [names[index] for index in row_of], [row_of[row] for row in self.cases.test], shape)

    def _measure(self, key: dict[str, Any], method: Any, source: str | None) -> None:
        label, settings, seed = key["label"], self.settings, key["seed"]
        known_as = {} if source is None else {"source": source}
        folder = self.kept.folder / run_folder({**key, **known_as})
        known = self.cases.known(key["train_size"], seed)
        predicted, truths, fitting, predicting = [], [], 0.0, 0.0
        for case, (dataset, test) in zip(known, self.cases.tests, strict=True):
            taught = Known(dataset, self.quantity, case.parts, seed, settings.minutes, settings.steps, folder, case.how)
            truth = self.quantity.of(dataset, test)
            began = time.perf_counter()
            with named(label, method, "fit to learn from what is known"):
                method.fit(taught)
            fitted = time.perf_counter()
            with named(label, method, "predict to return predictions"):
                predicted.append(self._predict(label, method, dataset, test, truth.shape))
            truths.append(truth)
            fitting, predicting = fitting + fitted - began, predicting + time.perf_counter() - fitted
        together = joined(predicted)
        scored = self.quantity.score(together, np.concatenate(truths), self.cases.tests[0][0])
        fitted_before = isinstance(method, Predictions)
        seconds = getattr(method, "seconds", fitting / len(known))
        distances = self.cases.distances(key["train_size"])
        count = sum(map(len, truths))
        row = {
            "train": len(known[0].parts.train),
            "known": len(known[0].parts.known),
            "test": count,
            **scored.row,
            **(self._of_rooms(predicted, truths) if len(known) > 1 or self.cases.training else {}),
            "parameters": getattr(method, "parameters", None),
            "steps": getattr(method, "steps", None),
            "seconds": None if fitted_before else round(seconds, 3),
            "milliseconds": None if fitted_before else round(1e3 * predicting / count, 3),
            "found": getattr(method, "found", None),
            **({} if distances is None else distances.facts()),
            "date": datetime.date.today().isoformat(),
            **known_as,
        }
        if row["found"] is not None:
            say(f"{label}: {row['found']}")
        self.kept.keep(key, row, scored.each)

    def _predict(self, label: str, method: Any, dataset: Any, test: Any, shape: tuple[int, ...]) -> Prediction:
        """What a method predicts of test rows, in pieces if there are many."""
        positions, given = dataset.positions, self.quantity.given(dataset, test)
        places = None if positions is None else positions[test]
        at_once = self.quantity.at_once or max(len(test), 1)
        parts = []
        for first in range(0, len(test), at_once):
            some = slice(first, first + at_once)
            where = None if places is None else places[some]
            found = method.predict(where) if given is None else method.predict(where, given[some])
            parts.append(self.quantity.checked(label, found, (len(test[some]), *shape[1:])))
        return joined(parts)

    def _of_rooms(self, predicted: list[Prediction], truths: list[np.ndarray]) -> dict[str, Any]:
        """The score in each room."""
        rooms = zip(predicted, truths, self.cases.tests, strict=True)
        each = [self.quantity.score(found, truth, dataset).each["ssim"] for found, truth, (dataset, _) in rooms]
        return {"rooms": [round(float(np.median(one)), 4) for one in each]}

    def _measure_bound(self) -> None:
        """Measure the row of the quantity's bound, if it has one."""
        dataset, test = self.cases.tests[0]
        if any(row.get("bound") for row in self.kept.rows):
            return
        bound = self.quantity.bound(dataset, test)
        if bound is None:
            return
        label, prediction, rows = bound
        scored = self.quantity.score(prediction, self.quantity.of(dataset, rows), dataset)
        key = {"label": label, "seed": 0, "train_size": None}
        row = {"test": len(rows), **scored.row, "bound": True, "date": datetime.date.today().isoformat()}
        self.kept.keep(key, row, scored.each)


def joined(parts: Sequence[Prediction]) -> Prediction:
    """Several predictions as one; what one of them does not state, none does."""

    def together(name: str) -> np.ndarray | None:
        found = [getattr(each, name) for each in parts]
        return None if any(each is None for each in found) else np.concatenate(found)

    value = np.concatenate([each.value for each in parts])
    return Prediction(value, together("low"), together("high"), together("deviation"))
