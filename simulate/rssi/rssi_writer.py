"""Write a folder of received powers (RSSI) that the published loaders of NeRF² and GSRF read unchanged."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from io import StringIO
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from jaxtyping import Float, Int

from scenes.files.atomic import write_atomically
from scenes.files.yaml_file import PlainDumper
from simulate.dataset.dataset_kinds import POWERS
from simulate.dataset.dataset_writer import write_index, write_metadata, write_positions
from simulate.generation.request import TEST_FRACTION
from simulate.rssi.power_receiver import NOT_RECEIVED

DECIMALS = 4
"""Decimals of the powers in the file."""


def write_rssi_files(
    folder: Path,
    positions: Float[np.ndarray, "K 3"],
    gateways: Mapping[str, Sequence[float]],
    rssi_dbm: Float[np.ndarray, "K G"],
    metadata: dict[str, Any],
    seed: int = 0,
) -> None:
    """Write the files into an empty folder."""
    write_positions(folder / "tx_pos.csv", positions)
    write_atomically(folder / "gateway_position.yml", positions_yaml(gateways).encode())
    write_atomically(folder / POWERS, powers_csv(list(gateways), rssi_dbm).encode())
    write_metadata(folder / "metadata.json", metadata)
    if len(positions) > 1:
        for name, part in zip(("train_index.txt", "test_index.txt"), split_of(len(positions), seed), strict=True):
            write_index(folder / name, [str(number) for number in part])


def positions_yaml(gateways: Mapping[str, Sequence[float]]) -> str:
    """The text of gateway_position.yml.

    >>> print(positions_yaml({"door": (0, 1, 2.5), "7": (3, 1, 2.5)}), end="")
    door: [0.000000, 1.000000, 2.500000]
    '7': [3.000000, 1.000000, 2.500000]
    """
    lines = []
    for name, position in gateways.items():
        key = yaml.dump({name: 0}, Dumper=PlainDumper, allow_unicode=True, width=inf)[: -len("0\n")]
        lines.append(f"{key}[{', '.join(f'{value:.6f}' for value in position)}]\n")
    return "".join(lines)


def powers_csv(names: Sequence[str], rssi_dbm: Float[np.ndarray, "K G"]) -> str:
    """The text of gateway_rssi.csv.

    >>> print(powers_csv(["door", "window"], np.array([[-48.0, -61.25], [-99.99999, np.nan]])), end="")
    door,window
    -48,-61.25
    -100,-100
    """
    stored = rssi_dbm.round(DECIMALS) + 0.0  # no -0
    stored[~(stored > NOT_RECEIVED)] = NOT_RECEIVED
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerow(names)
    for row in stored:
        text.write(",".join(np.format_float_positional(power, trim="-") for power in row) + "\n")
    return text.getvalue()


def split_of(count: int, seed: int) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " t"]]:
    """Draw an 80/20 split: indices of the training and of the test positions, in rising order.

    Both parts of four positions or more have at least two, since NeRF² cannot read an index file of one line.

    >>> [len(part) for part in split_of(5, seed=0)], [len(part) for part in split_of(100, seed=0)]
    ([3, 2], [80, 20])
    """
    tested = max(1 if count < 4 else 2, round(TEST_FRACTION * count))
    test = np.sort(np.random.default_rng(seed).permutation(count)[:tested])
    return np.setdiff1d(np.arange(count), test), test
