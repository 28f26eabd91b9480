"""A folder of received powers (RSSI) from a user's own measurements, given as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from scenes.files.array_argument import check_array
from scenes.files.errors import InputError, ParameterError, named, require_path, require_within, shown
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import say
from scenes.scene.frequency import read_frequency
from simulate.positions.given_positions import check_points
from simulate.rssi.power_receiver import NOT_RECEIVED, STRONGEST, fault_of_powers
from simulate.rssi.rssi_dataset import RssiDataset, read_rssi, require_valid_powers
from simulate.rssi.rssi_files import MOST_GATEWAYS, gateway_name
from simulate.rssi.rssi_writer import write_rssi_files


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


def own_gateways(given: Mapping[str, Sequence[float]]) -> dict[str, list[float]]:
    """Check the positions of gateways from Python."""
    if not isinstance(given, Mapping) or not given:
        raise ParameterError("gateways", f"expected the position of each gateway by its name, found {shown(given)}")
    if len(given) > MOST_GATEWAYS:
        raise ParameterError("gateways", f"expected at most {MOST_GATEWAYS} gateways, found {len(given)}")
    at = {}
    for name, position in given.items():
        if not isinstance(name, str):
            raise ParameterError("gateways", f"expected texts as names, found {shown(name)}")
        try:
            gateway_name(name, "")
        except InputError as error:
            raise ParameterError("gateways", str(error).removeprefix(": ")) from None
        point = check_array("gateways", position, (3,), f"a position x, y, z of {named(name)}")
        at[name] = check_points([point], "gateways")[0].tolist()
    return at


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
