"""Write a folder of received powers (RSSI) that the published loaders of NeRF² and GSRF read unchanged."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from io import StringIO
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from scenes.files.atomic import write_atomically
from scenes.files.errors import ParameterError, check_array, require_path, require_within
from scenes.files.json_yaml_xml import PlainDumper
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import say
from scenes.scene.frequency import read_frequency
from simulate.dataset.dataset_kinds import POWERS
from simulate.dataset.dataset_writer import write_index, write_metadata, write_positions
from simulate.generation.request import TEST_FRACTION
from simulate.positions.positions import check_points
from simulate.rssi.power_receiver import NOT_RECEIVED, STRONGEST, fault_of_powers
from simulate.rssi.rssi_dataset import RssiDataset, read_rssi, require_valid_powers
from simulate.rssi.rssi_files import own_gateways


def write_rssi(
    folder: Path | str,
    positions: Float[ArrayLike, "K 3"],
    rssi_dbm: Float[ArrayLike, "K G"],
    gateways: Mapping[str, Sequence[float]],
    frequency: float | str,
    floor_dbm: float = NOT_RECEIVED,
) -> RssiDataset:
    """Write a folder of received powers (RSSI) from one's own measurements, in the format of NeRF²'s BLE data.

    The index files have a random 80/20 split of seed 0, since NeRF² and GSRF need one.

    Args:
        folder: the new folder.
        positions: transmitter positions, metres, world frame, [K, 3].
        rssi_dbm: received powers, dBm, [K, G]; NaN where nothing was received. The format marks this by −100, so a
            power of −100 dBm or less counts as not received, and a line on stderr says how many there are.
        gateways: position of each gateway by its name, metres, world frame, in the order of the columns.
        frequency: hertz, or a text with a unit such as "2.4 GHz".
        floor_dbm: power below which a gateway receives nothing, dBm, from −100 on.

    Returns:
        The dataset, read from the folder.

    Raises:
        ParameterError: an argument has another shape or does not fit the others, or the powers cannot be in dBm.
        InputError: the folder is not new.

    Example:
        >>> import bisplat, numpy as np
        >>> places, gateways = np.array([[1.0, 2, 1], [4, 2, 1]]), {"door": (0, 0, 2), "window": (5, 0, 2)}
        >>> bisplat.write_rssi("shop", places, [[-48, -61], [-60, -44.5]], gateways, "2.4 GHz").rssi_dbm.tolist()
        [[-48.0, -61.0], [-60.0, -44.5]]
        >>> bisplat.write_rssi("barn", places, [[1e-5, 3e-7], [2e-6, 4e-5]], gateways, "2.4 GHz")
        Traceback (most recent call last):
        scenes.files.errors.ParameterError: rssi_dbm: expected powers in dBm, found 3e-07 to 4e-05, which look like ...
    """
    require_path(folder=folder)
    places = check_points(positions)
    at = own_gateways(gateways)
    powers = own_powers(rssi_dbm, len(places), len(at))
    require_within(NOT_RECEIVED, STRONGEST, "a power in dBm", floor_dbm=floor_dbm)
    stated = {
        "made_by": f"bisplat-wrf {version('bisplat-wrf')}",
        "kind": "rssi",
        "frequency_hz": read_frequency(frequency),
        "receiver": {"floor_dbm": float(floor_dbm)},
    }
    weak = int((powers <= NOT_RECEIVED).sum())
    with new_folder(Path(folder)) as unfinished:
        write_rssi_files(unfinished, places, at, powers, stated)
        require_valid_powers(unfinished, Path(folder))
    if weak:
        say(f"{folder}: {weak} powers of {NOT_RECEIVED:g} dBm or less count as not received")
    return read_rssi(folder)


def own_powers(given: Float[ArrayLike, "K G"], count: int, gateways: int) -> Float[np.ndarray, "K G"]:
    """Check powers from Python; the messages name what people most often mix up."""
    what = f"powers of {count} positions × {gateways} gateways"
    shape = np.shape(given) if isinstance(given, np.ndarray) else ()
    if shape == (gateways, count) and gateways != count:
        raise ParameterError("rssi_dbm", f"expected {what}, found {gateways} × {count}: transpose them (.T)")
    powers = check_array("rssi_dbm", given, (count, gateways), what, finite=False)
    if np.isinf(powers).any():
        row, column = np.argwhere(np.isinf(powers))[0]
        found = f"found {powers[row, column]} at position {row}, gateway {column}"
        raise ParameterError("rssi_dbm", f"expected finite powers, or NaN where nothing was received, {found}")
    fault = fault_of_powers(powers)
    if fault is not None:
        raise ParameterError("rssi_dbm", fault)
    return powers


DECIMALS = 4  # Decimals of the powers in the file


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
    """The text of gateway_position.yml."""
    lines = []
    for name, position in gateways.items():
        key = yaml.dump({name: 0}, Dumper=PlainDumper, allow_unicode=True, width=inf)[: -len("0\n")]
        lines.append(f"{key}[{', '.join(f'{value:.6f}' for value in position)}]\n")
    return "".join(lines)


def powers_csv(names: Sequence[str], rssi_dbm: Float[np.ndarray, "K G"]) -> str:
    """The text of gateway_rssi.csv."""
    stored = rssi_dbm.round(DECIMALS) + 0.0  # no -0
    stored[~(stored > NOT_RECEIVED)] = NOT_RECEIVED
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerow(names)
    for row in stored:
        text.write(",".join(np.format_float_positional(power, trim="-") for power in row) + "\n")
    return text.getvalue()


def split_of(count: int, seed: int) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " t"]]:
    """Draw an 80/20 split: indices of the training and of the test positions, in rising order."""
    tested = max(1 if count < 4 else 2, round(TEST_FRACTION * count))
    test = np.sort(np.random.default_rng(seed).permutation(count)[:tested])
    return np.setdiff1d(np.arange(count), test), test
