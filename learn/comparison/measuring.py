"""Fits and scores of methods, each of which is kept as soon as it is made."""

from __future__ import annotations

import copy
import datetime
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from learn.comparison.averages import average_name
from learn.comparison.cases import Cases, OneDataset
from learn.comparison.given_methods import built, is_own, named, source_of
from learn.comparison.predictions import Predictions
from learn.comparison.results_folder import Results, Settings, run_folder
from learn.quantities.known import Known
from learn.quantities.quantity import Quantity, joined
from scenes.files.errors import ParameterError
from scenes.files.long_work import doing
from scenes.files.plain_text import say


class Measuring:
    """Fits and scores methods where the row is missing: all with the first seed, then all with the next one."""

    def __init__(
        self,
        quantity: Quantity,
        cases: Cases,
        settings: Settings,
        kept: Results,
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
                    method = built(label, make)
                    if seed and isinstance(method, Predictions):  # which no seed changes
                        continue
                    source, name = source_of(label, method, self.ours), average_name(key)
                    if self.kept.is_measured(key, name, is_own(method), source):
                        continue
                    doing("")
                    say(f"{name}, seed {seed} ({number} of {total})")
                    if learned is None and hasattr(method, "learn"):
                        with named(label, method, "learn to learn from rooms"):
                            method.learn(self.cases.training, self.settings.minutes, seed)
                        learned = method
                    self._measure(key, learned or method, source)
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
                make = partial(copy.copy, method)
            elif hasattr(method, "learn") and not self.cases.training:
                why = "expected a training room to learn in, found none"
            if why is None:
                found[label] = make
            else:
                say(f"left out {label}: {why}")
        return found

    def _read(self, method: Predictions) -> None:
        """Read the predictions of the test part, of which the scored ones are kept."""
        assert isinstance(self.cases, OneDataset)
        dataset, rows = self.cases.data, self.cases.parts(None).test
        row_of = {index: row for row, index in enumerate(rows.tolist())}
        shape = self.quantity.of(dataset, rows[:1]).shape[1:]
        method.read(
            self.quantity, [dataset.names[index] for index in row_of], [row_of[row] for row in self.cases.test], shape
        )

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
            doing(f"{label}: predicting and scoring {len(test):,} tests")
            with named(label, method, "predict to return predictions"):
                places, given = dataset.places, self.quantity.given(dataset, test)
                places = None if places is None else places[test]
                predicted.append(self.quantity.predicted_by(label, method, places, given, truth.shape))
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
            **(self._of_rooms(scored.each, truths) if len(known) > 1 or self.cases.training else {}),
            "parameters": getattr(method, "parameters", None),
            "steps": getattr(method, "steps", None),
            "seconds": None if seconds is None else round(seconds, 3),
            "milliseconds": None if fitted_before else round(1e3 * predicting / count, 3),
            "found": getattr(method, "found", None),
            **({} if distances is None else distances.facts()),
            "date": datetime.date.today().isoformat(),
            **known_as,
        }
        if row["found"] is not None:
            say(f"{label}: {row['found']}")
        self.kept.keep(key, row, scored.each)

    def _of_rooms(self, each: Mapping[str, np.ndarray], truths: Sequence[np.ndarray]) -> dict[str, Any]:
        """The median score in each room."""
        rooms = np.split(each[self.quantity.of_each.key], np.cumsum([len(truth) for truth in truths])[:-1])
        return {"rooms": [round(float(np.median(room)), 4) for room in rooms]}

    def _measure_bound(self) -> None:
        """Measure the row of the quantity's bound, if it has one."""
        dataset, test = self.cases.tests[0]
        if any(row.get("bound") for row in self.kept.rows):
            return
        doing(f"the bound of all methods in {len(test):,} tests")
        bound = self.quantity.bound(dataset, test)
        doing("")
        if bound is None:
            return
        label, prediction, rows = bound
        scored = self.quantity.score(prediction, self.quantity.of(dataset, rows), dataset)
        key = {"label": label, "seed": 0, "train_size": None}
        row = {"test": len(rows), **scored.row, "bound": True, "date": datetime.date.today().isoformat()}
        self.kept.keep(key, row, scored.each)
