"""Powers or channels of transmitters that are to be located, and the check that the same gateways heard them."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Shaped

from learn.data.same_receiver import other_frequency
from scenes.files.errors import InputError, named
from scenes.scene.description import SPEED_OF_LIGHT
from simulate.csi.csi_dataset import CsiDataset, read_csi
from simulate.rssi.power_receiver import NOT_RECEIVED, fault_of_powers
from simulate.rssi.rssi_dataset import RssiDataset, read_rssi
from simulate.rssi.rssi_files import read_powers

SAME_PLACE = 0.1
"""Metres. Gateways and antennas whose stated positions differ by more are other ones."""


class HeardRows(NamedTuple):
    """What was heard of K transmitters."""

    rows: Shaped[np.ndarray, "K *each"]  # powers [K, G], in dBm, or channels of the uplink [K, A, S]
    truth: Float[np.ndarray, "K 3"] | None  # the positions of the transmitters, where they are known, metres


def heard_powers(path: Path, survey: RssiDataset) -> HeardRows:
    """Read powers of transmitters at unknown places, with the survey's gateways in its order."""
    truth, places = None, None
    if path.is_dir():
        heard = read_rssi(path)
        names, powers, truth, places = heard.gateway_names, heard.rssi_dbm, heard.positions, heard.gateway_positions
        _require_same_frequency(path, heard, survey)
    else:
        names, powers = read_powers(path)
        powers = np.where(powers == NOT_RECEIVED, np.nan, powers)
        if fault := fault_of_powers(powers):
            raise InputError(f"{path}: {fault}")
    for have, want, other in (
        (names, survey.gateway_names, str(survey.folder)),
        (survey.gateway_names, names, str(path)),
    ):
        missing = next((name for name in want if name not in have), None)
        if missing is not None:
            raise InputError(
                f"{path}: expected the gateways of {survey.folder}, found {named(missing)} in {other} alone"
            )
    order = [names.index(name) for name in survey.gateway_names]
    if places is not None:
        _require_same(path, "gateways", survey.folder, places[order], survey.gateway_positions)
    return HeardRows(powers[:, order], truth)


def heard_channels(path: Path, known: CsiDataset) -> HeardRows:
    """Read channels of the uplink of transmitters at unknown places."""
    heard = read_csi(path)
    found, expected = heard.uplink.shape[1:], known.uplink.shape[1:]
    if found != expected:
        each = " antennas and {} subcarriers of the uplink"
        wanted, other = (f"{shape[0]}{each.format(shape[1])}" for shape in (expected, found))
        raise InputError(f"{path}: expected {wanted} as in {known.folder}, found {other}")
    _require_same_frequency(path, heard, known)
    _require_same(path, "antennas", known.folder, heard.antenna_positions, known.antenna_positions)
    return HeardRows(heard.uplink, heard.positions)


def _require_same_frequency(path: Path, heard: RssiDataset | CsiDataset, known: RssiDataset | CsiDataset) -> None:
    """Refuse another frequency, if both are stated."""
    found, expected = heard.frequency, known.frequency
    if found is None or expected is None:
        return
    if other_frequency(SPEED_OF_LIGHT / expected.hertz, SPEED_OF_LIGHT / found.hertz):
        raise InputError(f"{path}: expected {expected} as in {known.folder}, found {found}")


def _require_same(
    path: Path, what: str, folder: Path, found: Float[np.ndarray, "n 3"], expected: Float[np.ndarray, "n 3"]
) -> None:
    away = float(np.linalg.norm(found - expected, axis=1).max())
    if away > SAME_PLACE:
        raise InputError(f"{path}: expected the {what} where they are in {folder}, found one {away:.3g} m away")
