"""Comparison of methods that predict received powers on one split, scored by the same code."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from learn.comparison.averaged_table import average_name
from learn.comparison.method_factories import check_effort, chosen_methods
from learn.comparison.results_folder import given_folder
from learn.comparison.scored_methods import Parts, asked_sizes, checked_array, earlier_sizes, fit_results, score_fits
from learn.data.splits import Split, SplitKind
from learn.powers.fit_powers import with_twin
from learn.powers.known_powers import KnownPowers, PowerMethod, PredictedPowers
from learn.powers.power_comparison import GATEWAYS, PowerComparison, PowerRow, of_gateway, score_powers
from learn.powers.twin_powers import TwinPowers
from scenes.files.npz_file import Expected
from scenes.files.plain_text import say
from scenes.scene.description import Scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import given_dataset


def compare_powers(
    dataset: Dataset | Path | str,
    methods: Sequence[str] | Mapping[str, str | PowerMethod | Callable[[], PowerMethod]] | None = None,
    *,
    split: SplitKind = "files",
    train_size: int | Sequence[int] | None = None,
    seed: int = 0,
    guard: float = 0.0,
    seeds: int = 1,
    budget: float = 5.0,
    scene: Scene | Path | str | None = None,
    output: Path | str | None = None,
) -> PowerComparison:
    """Fit and score methods that predict received powers (RSSI) at new positions.

    Every method learns from the same known positions, those of the training and the validation part, and is scored at
    the same test positions. A known power that was not received counts as one below the dataset's floor: the laws of
    distance are fitted to it as a censored value, and the other methods take the power that the law of its gateway then
    expects. At test positions it is no error in dB, and only counts for whether reception is predicted.

    A method is an object with two methods. ``fit(known)`` learns from ``known.positions`` [n, 3] (metres) and
    ``known.powers`` [n, G] (dBm, NaN where nothing was received), and may use ``known.gateways`` [G, 3],
    ``known.floor``, ``known.wavelength``, ``known.seed`` and ``known.minutes``. ``predict(positions)`` takes positions
    [K, 3] and returns powers [K, G] in dBm, or an object with the attributes ``median``, ``low`` and ``high``, the ends
    of the 90 % interval.

    Args:
        dataset: received powers, or their folder.
        methods: some of "mean" (of each gateway), "nearest" (known position), "inverse-distance" (mean of the four
            nearest), "log-distance" (P = P₀ − 10 n log₁₀ d for each gateway), "mri" (the same for all gateways
            together, NeRF²'s baseline), "kriging" (about the log-distance law), "helmholtz" (with a covariance of slow
            change and of fading), and "mirror-images" (waves of the gateways' mirror images in walls along the axes,
            and kriging of the rest), or classes of your own ("module:Class"). Or a dictionary from the label of a row
            to one of these: a name, a class with ``fit`` and ``predict``, a function that returns an object with both,
            or such an object, which is copied for each fit. None: all that are not trained by steps. "nerf2" is,
            for ``budget`` minutes. With ``scene`` there is also "twin": rays in the scene, which the known powers
            correct, and kriging of the remainder.
        split: how the test part is chosen: "files" (the folder's index files), "random" (a random fifth), "blocked"
            (every fourth block of ten consecutive positions) or "area" (connected areas with a fifth).
        train_size: number of training positions to keep; the validation part shrinks in proportion. Or several
            numbers: every method is then fitted to each. Smaller training parts are contained in larger ones, and the
            test part is the same for all. None: all of them.
        seed: seed of the split.
        guard: known positions nearer than this to a test position are left out, wavelengths.
        seeds: number of fits of each method, with seeds 0, 1, …
        budget: training time of each method that is trained by steps, minutes.
        scene: the scene as described, which "twin" corrects: a scene, the name of a built-in one, or a scene YAML. Its
            own gateways are left out.
        output: folder that keeps each fit as soon as it is scored. The same call again makes those that are missing.
            None: nothing is kept.

    Returns:
        The scores, with those that the output has from earlier calls.

    Raises:
        InputError: the folder cannot be read; or it has too few positions, or no index files, for the split.
            Or something went wrong in a method of your own. Or the scene cannot be read, or is of another frequency.
            Or the output has a comparison with other settings, or other files.
        ParameterError: a method or the split is unknown, "twin" is asked for without a scene or a scene is given
            without "twin", or another argument is out of its range.

    Example:
        >>> import bisplat, numpy as np
        >>> places = np.random.default_rng(0).uniform(0, 4, (40, 3))
        >>> powers = -40 - 20 * np.log10(np.linalg.norm(places - [0, 0, 5], axis=1))[:, None]
        >>> door = {"door": (0, 0, 5)}
        >>> hall = bisplat.write_dataset("sports", places, powers=powers, gateways=door, frequency="2.4 GHz")
        >>> scores = bisplat.compare_powers(hall, ["nearest", "log-distance"], split="random").table()
        >>> scores[0]["label"], round(scores[0]["error_median_db"], 3)
        ('log-distance', 0.0)

        Several sizes, and a method of one's own:

        >>> class Loudest:
        ...     def fit(self, known):
        ...         self.most = np.nanmax(known.powers, axis=0)
        ...
        ...     def predict(self, positions):
        ...         return np.tile(self.most, (len(positions), 1))
        >>> both = {"loudest": Loudest, "nearest": "nearest"}
        >>> comparison = bisplat.compare_powers(hall, both, split="random", train_size=[10, 20])
        >>> [(row["label"], row["train_size"]) for row in comparison]
        [('loudest', 10), ('nearest', 10), ('loudest', 20), ('nearest', 20)]
    """
    check_effort(budget, seeds)
    folder = given_folder(output)
    dataset = given_dataset(dataset, "power")
    usual = with_twin(dataset, scene, methods)
    factories = chosen_methods(methods, usual)
    if dataset.frequency.source == "assumed":
        say(f"{dataset.folder}: no frequency is stated, so {dataset.frequency.hertz / 1e6:g} MHz is assumed")
    sizes = asked_sizes(train_size, "positions")
    parts = Parts.of(dataset, split, seed, {*sizes, *earlier_sizes(folder)}, guard)
    test, floor = parts.largest.test, dataset.floor_dbm
    places, truth = dataset.positions[test], dataset.powers[test]

    def known(part: Split, method_seed: int) -> KnownPowers:
        return KnownPowers.of(dataset, part.known, method_seed, budget)

    def predict(label: str, method: PowerMethod) -> tuple[PredictedPowers, dict[str, str]]:
        traced = {"scene": method.scene} if isinstance(method, TwinPowers) else {}
        return checked_powers(label, method.predict(places), truth.shape), traced

    def score(found: tuple[PredictedPowers, dict[str, str]]) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        predicted, traced = found
        of_each = {
            name: score_powers(of_gateway(predicted, number), truth[:, [number]], floor)
            for number, name in enumerate(dataset.gateway_names)
        }
        arrays = {name: each for name, each in vars(predicted).items() if each is not None}
        return {**score_powers(predicted, truth, floor), **traced, GATEWAYS: of_each}, arrays

    gateways = [np.array(dataset.gateway_names), dataset.gateway_positions]
    stated = np.array([floor, dataset.wavelength])
    data = [dataset.positions, dataset.powers, *gateways, stated, dataset.train, dataset.test]
    power = Expected("powers", "f", truth.shape)
    expected = {"median": power, "low": replace(power, optional=True), "high": replace(power, optional=True)}
    settings = {"split": split, "seed": seed, "guard": float(guard), "minutes": float(budget)}
    with fit_results(folder, "received powers", dataset.folder, settings, data, PowerRow) as kept:
        score_fits(factories, usual, seeds, parts.only(sizes), known, predict, score, kept)
        of_first = {average_name(row): PredictedPowers(**arrays) for row, arrays in kept.arrays(expected)}
        measured = kept.rows
    what = "label", "seed", "train_size", "known"
    return PowerComparison(
        folder=dataset.folder,
        split=split,
        seed=seed,
        guard=guard,
        minutes=budget,
        parts=parts.largest,
        rows=[{key: value for key, value in row.items() if key != GATEWAYS} for row in measured],
        distances=parts.distances,
        dataset=dataset,
        gateway_rows=[
            {**{key: row[key] for key in what}, "gateway": name, **scores}
            for row in measured
            for name, scores in row[GATEWAYS].items()
        ],
        predicted=of_first,
    )


def checked_powers(label: str, given: Any, shape: tuple[int, ...]) -> PredictedPowers:
    """What a method predicts, if it is powers: an array, or an object with ``median``, ``low`` and ``high``."""
    parts = [given] if not hasattr(given, "median") else [given.median, given.low, given.high]
    if any(each is None for each in parts[1:]):  # no interval
        parts = parts[:1]
    return PredictedPowers(*(checked_array(label, "powers in dBm", each, shape, "iuf") for each in parts))
