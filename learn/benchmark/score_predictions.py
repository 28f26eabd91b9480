"""Score a folder of predictions on a named benchmark, by the code that scores our own methods."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from learn.benchmark.benchmark_sets import SETS
from learn.benchmark.folder_files import task_file
from learn.benchmark.predictions import digest, predicted_downlink, predicted_powers, predicted_spectra
from learn.benchmark.read_benchmark import named_benchmark, read_benchmark
from learn.channels.channel_scores import score_channels
from learn.data.metrics import require_some, score, varies
from learn.powers.power_scores import score_powers
from scenes.files.errors import require_path
from simulate.csi.csi_dataset import CsiDataset
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.rssi.rssi_dataset import RssiDataset


def score_predictions(predictions: Path | str, dataset: Path | str, benchmark: str) -> dict[str, Any]:
    """Score predictions of the test rows of a named benchmark, as ``compare`` scores methods.

    Args:
        predictions: folder of the predictions, in the order of the task's test_index.txt: of spectra, ``spectra.npy``
            [K, 90, 360] or a picture NAME.png of each; of powers, ``gateway_rssi.csv``, and with stated 90 % intervals
            ``gateway_rssi_low.csv`` and ``gateway_rssi_high.csv``; of channels, ``downlink.npy`` [K, antennas, S].
        dataset: the folder that ``make_benchmark`` made.
        benchmark: name of the benchmark, such as "lab-blocked" or "rssi-office-random-200".

    Returns:
        The scores by name: those of ``Scores.summary``, ``PowerComparison`` or ``ChannelComparison``; and
        "predictions_sha256", a hash of the files.

    Raises:
        InputError: the dataset differs from the frozen one, or a file of the predictions is missing, of another shape,
            or holds numbers that are not finite.
        ParameterError: no benchmark has this name.

    Example:
        >>> import bisplat, numpy as np, pathlib
        >>> bisplat.make_benchmark("practice", "data/practice")
        Dataset('data/practice': 60 spectra, 4 × 4 elements, 915 MHz)
        >>> folder = pathlib.Path("guesses")
        >>> folder.mkdir()
        >>> np.save(folder / "spectra.npy", np.full((20, 90, 360), 0.5))
        >>> round(bisplat.score_predictions(folder, "data/practice", "practice-blocked")["mae_mean"], 1)
        0.3
    """
    require_path(predictions=predictions, dataset=dataset)
    of, task = named_benchmark(benchmark)
    folder, truth = Path(predictions), read_benchmark(benchmark, dataset)
    return {**_scores(folder, truth, Path(dataset), of, task), "predictions_sha256": digest(folder)}


def _scores(folder: Path, truth: Dataset | RssiDataset | CsiDataset, place: Path, of: str, task: str) -> dict[str, Any]:
    if isinstance(truth, RssiDataset):
        powers = predicted_powers(folder, truth.gateway_names, len(truth.test))
        return score_powers(powers, truth.rssi_dbm[truth.test], truth.floor_dbm)
    if isinstance(truth, CsiDataset):
        downlink = truth.downlink[truth.test]
        bandwidth = None if truth.band is None else downlink.shape[2] * truth.band.spacing
        return score_channels(predicted_downlink(folder, downlink.shape), downlink, bandwidth)
    names = task_file(place, task, "test").read_text().split()
    predicted = predicted_spectra(folder, names)
    place_of = {name: row for row, name in enumerate(names)}
    every = [read_dataset(place, hertz) for hertz in SETS[of].frequencies] or [truth]
    true = np.zeros(predicted.shape, np.float32)
    for each in every:
        for row, name in enumerate(each.names):
            if name in place_of:
                true[place_of[name]] = each.pictures[row] / np.float32(255)
    told = varies(true)
    require_some(told, str(place))
    return score(np.clip(predicted[told], 0, 1), true[told], truth.grid, truth.array).summary()
