"""Comparison of methods for any quantity: fitted to the same known rows, scored on the same test rows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

from learn.comparison.averages import average_name
from learn.comparison.cases import Cases, ManyRooms, OneDataset
from learn.comparison.comparison import Comparison
from learn.comparison.given_methods import (
    check_effort,
    checked_sizes,
    chosen_methods,
)
from learn.comparison.measuring import Measuring
from learn.comparison.results_folder import Settings, results_in
from learn.data.split_distances import say_distances
from learn.data.splits import GUARD_MOST, SPLITS, SplitKind
from learn.methods.method_table import BASELINES, USUAL_BASELINES, methods_of, require_scene, usual_names
from learn.methods.trained_model import TrainedModel
from learn.quantities.known import MakesMethod, Method
from learn.quantities.quantity_table import QuantityName, quantity_named
from learn.quantities.spectra import SpectraInRooms
from learn.training.config import require_untested
from learn.training.run_files import device_name
from learn.training.run_folder import Run, SpectrumRun, load_spectra
from scenes.files.errors import (
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
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.dataset_kinds import is_rooms
from simulate.dataset.rooms_folder import Rooms, read_rooms
from simulate.positions.positions import MOST_POSITIONS

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
    kind = "room" if isinstance(given, Rooms) else quantity or given.quantities[0]
    of = SpectraInRooms() if kind == "room" else quantity_named(kind)
    require_scene(kind, methods, scene)
    known = methods_of(kind, given, scene)
    chosen = chosen_methods(methods, known, usual_names(kind, known), models=kind == "spectrum")
    asked = checked_sizes(sizes, of.things)
    run = None if init is None else load_spectra(init)
    if run is not None:
        chosen |= _continued(run, kind)
    missing = [name for name in BASELINES.get(kind, USUAL_BASELINES) if name not in chosen]
    chosen = {**{name: known[name] for name in missing}, **chosen}
    cases: Cases
    if isinstance(given, Rooms):
        cases = ManyRooms(given, test_rooms, tested, seed)
    else:
        cases = OneDataset(given, of, split, seed, guard, tested)
        if run is not None and run.is_trained_on(given):
            require_untested(run.split(given).known, run.folder, given, cases.parts(None))
    asked = cases.sizes(asked)
    settings = Settings(
        dataset=str(given.folder.resolve()),
        quantity=of.name,
        split=cases.split,
        seed=seed,
        guard=float(guard),
        minutes=float(budget) if steps is None else None,
        steps=steps,
        device=device_name(),
        tested=tested,
        test_rooms=cases.test_rooms,
        data_sha256=cases.fingerprint,
        index_sha256=cases.index_sha256,
    )
    folder, distances = None if output is None else Path(output), cases.distances(asked[-1])
    with results_in(folder, settings, of.ranked_by) as kept:
        if stated := of.stated(given):
            say(stated)
        if distances is not None:
            say_distances(distances)

        def so_far() -> Comparison:
            found = Comparison(
                quantity=of, settings=settings, folder=folder, rows=kept.rows, dataset=given, distances=distances
            )
            if not isinstance(cases, OneDataset):
                return found
            expected = of.arrays((len(cases.test), *of.of(given, cases.test[:1]).shape[1:]))
            each = {average_name(row): kept.arrays(row, expected) for row in found if row["seed"] == 0}
            largest = max((row["train_size"] or 0 for row in found), default=0) or None
            return replace(found, each=each, test=cases.test, parts=cases.parts(largest))

        try:
            Measuring(of, cases, settings, kept, known).measure(chosen, seeds, asked)
        except KeyboardInterrupt:
            if kept.rows:
                say(f"interrupted; the table so far:\n{so_far()}")
            raise
        return so_far()


def read_data(data: Any) -> Any:
    """A dataset of any kind or rooms, which may be given as their folder."""
    require_instance(Dataset, Rooms, str, PathLike, data=data)
    if not isinstance(data, str | PathLike):
        return data
    folder = Path(data)
    return read_rooms(folder) if is_rooms(folder) else read_dataset(folder)


def _continued(run: SpectrumRun, kind: str) -> dict[str, Callable[[], Any]]:
    """The model of a run, trained from its weights."""
    if kind != "spectrum":
        raise ParameterError("init", "expected none but for spectra, whose models start from weights, found one")
    model = run.config.model
    if run.config.by_steps is None:
        raise ParameterError("init", f"expected a run of a model that is trained by steps, found one of {model}")
    start = str(run.folder.resolve())
    return {f"{model} from {run.name}": lambda: TrainedModel(model, dict(run.config.options), init=start)}
