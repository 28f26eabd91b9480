"""The folder of received powers (RSSI), as NeRF²'s BLE data have it: read, written, and described for the check."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import yaml
from jaxtyping import Float
from msgspec import Meta, Struct
from numpy.typing import ArrayLike

from scenes.files.atomic import write_atomically
from scenes.files.errors import named, require_within
from scenes.files.json_yaml_xml import PlainDumper
from scenes.files.plain_text import say
from scenes.files.schema import conform
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_frequency import Frequency, stated_frequency
from simulate.dataset.dataset_kinds import NOT_RECEIVED, POWERS, STRONGEST, TAKE_POWERS
from simulate.dataset.index_files import read_split, write_drawn_split
from simulate.dataset.inspection import Inspection
from simulate.dataset.metadata import made_here, write_metadata
from simulate.dataset.powers_files import (
    fault_of_powers,
    own_gateways,
    own_powers,
    read_gateway_positions,
    read_power_table,
)
from simulate.dataset.receivers import Antennas
from simulate.positions.positions import write_positions

GATEWAYS = "gateway_position.yml"

DECIMALS = 4  # Decimals of the powers in the file

LEAST_POWERS, LEAST_RATIO = 10, 2.0
"""A gateway tells an exponent if it has received so many powers, from distances that differ by such a factor."""

USUAL_POWER = 20.0
"""dBm; transmit power if none is stated: the largest of most radios without a licence."""

BELIEVED = 10.0
"""dB by which the median power may exceed that of free space. Metres taken for millimetres add 60 dB."""

APART = 20.0  # dB by which powers of 0 dBm are above all others if 0 seems to mean that nothing was received

LISTED = 6  # Gateways whose position is printed


class StatedReceiver(Struct, frozen=True):
    """The entry receiver of metadata.json, whose other keys are not needed to read the powers."""

    tx_power_dbm: float | None = None
    floor_dbm: Annotated[float, Meta(ge=NOT_RECEIVED, le=STRONGEST)] = NOT_RECEIVED


class StatedPowers(Struct):
    """What metadata.json of received powers states besides what that of spectra does."""

    receiver: StatedReceiver = StatedReceiver()
    positions_sha256: str = ""


def read_powers(found: Inspection, wanted: float | None) -> Dataset | None:
    """Read a folder of received powers, and note every problem and oddity."""
    folder, problems = found.folder, found.problems
    positions = found.positions()
    places = found.noting(dict[str, np.ndarray](), read_gateway_positions, folder / GATEWAYS)
    names, powers = found.noting((list[str](), np.zeros((0, 0))), read_power_table, folder / POWERS)
    metadata = found.metadata()
    stated = found.noting(StatedPowers(), conform, metadata, StatedPowers, str(folder / "metadata.json"))
    if names and places:
        _compare_names(found, names, list(places))
    if names and positions is not None and len(powers) != len(positions):
        problems.append(
            f"{folder / POWERS}: expected a row for each of the {len(positions)} positions of tx_pos.csv, found "
            f"{len(powers)} rows"
        )
    if names:
        powers[powers == NOT_RECEIVED] = np.nan
        fault = fault_of_powers(powers, stated=stated.receiver.tx_power_dbm is not None)
        if fault is not None:
            problems.append(f"{folder / POWERS}: {fault}")
    frequency = found.noting(Frequency(), stated_frequency, folder, metadata, wanted)
    rows = [str(number) for number in range(0 if positions is None else len(positions))]
    train, test = read_split(found, rows, "positions")
    if problems or positions is None:
        return None
    if list(places) != names:
        found.warnings.append(
            f"{GATEWAYS} has the gateways in another order than {POWERS}; bisplat and GSRF go by their names, "
            "but NeRF² goes by the order and would confuse them"
        )
    found.note_changed_places(metadata, tx_pos=positions)
    at = Antennas(names, np.array([places[name] for name in names]))
    return Dataset(folder, rows, {"power": powers}, at, positions, train, test, None, metadata, frequency)


def _compare_names(found: Inspection, columns: Sequence[str], placed: Sequence[str]) -> None:
    """Look for gateways that one of the two files lacks."""
    unplaced = [name for name in columns if name not in placed]
    without_column = [name for name in placed if name not in columns]
    if unplaced:
        expected = f"{found.folder / GATEWAYS}: expected the position of each gateway of {POWERS}"
        found.problems.append(f"{expected}, found none of {named(unplaced[0])}")
    elif without_column:
        expected = f"{found.folder / POWERS}: expected a column for each gateway of {GATEWAYS}"
        found.problems.append(f"{expected}, found none of {named(without_column[0])}")


def write_powers(
    folder: Path,
    positions: Float[np.ndarray, "K 3"],
    gateways: Mapping[str, Sequence[float]],
    powers: Float[np.ndarray, "K G"],
    metadata: dict[str, Any],
    seed: int = 0,
) -> None:
    """Write the files of a folder of received powers, with a random split, into an empty folder."""
    lines = []
    for name, position in gateways.items():
        key = yaml.dump({name: 0}, Dumper=PlainDumper, allow_unicode=True, width=10**6)[: -len("0\n")]
        lines.append(f"{key}[{', '.join(f'{value:.6f}' for value in position)}]\n")
    stored = powers.round(DECIMALS) + 0.0  # no -0
    stored[~(stored > NOT_RECEIVED)] = NOT_RECEIVED
    table = StringIO()
    csv.writer(table, lineterminator="\n").writerow(gateways)
    for row in stored:
        table.write(",".join(np.format_float_positional(power, trim="-") for power in row) + "\n")
    write_positions(folder / "tx_pos.csv", positions)
    write_atomically(folder / GATEWAYS, "".join(lines).encode())
    write_atomically(folder / POWERS, table.getvalue().encode())
    write_metadata(folder / "metadata.json", metadata)
    write_drawn_split(folder, len(positions), seed)


def write_given_powers(
    folder: Path,
    positions: Float[np.ndarray, "K 3"],
    powers: Float[ArrayLike, "K G"],
    gateways: Mapping[str, Sequence[float]] | None,
    hertz: float,
    floor_dbm: float,
    called: str,
) -> None:
    """Write the files of received powers from Python into an empty folder."""
    at = own_gateways(gateways)
    levels = own_powers(powers, len(positions), len(at))
    require_within(NOT_RECEIVED, STRONGEST, "a power in dBm", floor_dbm=floor_dbm)
    stated = {"kind": "rssi", "frequency_hz": hertz, "receiver": {"floor_dbm": float(floor_dbm)}}
    write_powers(folder, positions, at, levels, made_here() | stated)
    weak = int((levels <= NOT_RECEIVED).sum())
    if weak:
        say(f"{called}: {weak} powers of {NOT_RECEIVED:g} dBm or less count as not received")


def distance_law(dataset: Dataset) -> tuple[Float[np.ndarray, " g"], float] | None:
    """Powers as P = P_1 − 10 n log10(d / 1 m), fitted for each gateway by least squares; None if no gateway tells n.

    Exponents n of the gateways that tell one (free space has 2), and the median of what the fits leave, dB.
    """
    exponents, scatter = [], []
    for distance, power in zip(dataset.distances.T, dataset.powers.T, strict=True):
        heard = ~np.isnan(power) & (distance > 0)
        if heard.sum() < LEAST_POWERS or distance[heard].max() < LEAST_RATIO * distance[heard].min():
            continue
        decades = 10 * np.log10(distance[heard])
        slope, level = np.polyfit(decades, power[heard], 1)
        exponents.append(-slope)
        scatter.append(np.std(power[heard] - level - slope * decades))
    return (np.array(exponents), float(np.median(scatter))) if exponents else None


def describe_powers(dataset: Dataset) -> dict[str, str]:
    """What ``bisplat check`` prints of received powers alone."""
    places = zip(dataset.gateway_names, dataset.gateway_positions.round(3).tolist(), strict=True)
    at = [f"{name} {place}" for name, place in places]
    more = f" and {len(at) - LISTED} more" if len(at) > LISTED else ""
    stated = "metadata.json" if "receiver" in dataset.metadata else "the mark of the format"
    heard, law = ~np.isnan(dataset.powers), "too few powers or distances to tell"
    if (fitted := distance_law(dataset)) is not None:
        exponents, scatter = fitted
        of = "one gateway" if len(exponents) == 1 else f"median of {len(exponents)} gateways"
        law = f"exponent {np.median(exponents):.1f} ({of}; free space has 2), {scatter:.1f} dB left unexplained"
    powers = dataset.powers[heard]
    span = f"{powers.min():.4g} to {powers.max():.4g}, median {np.median(powers):.4g}" if powers.size else "none"
    return {
        "holds": f"received powers (RSSI): {len(dataset)} positions × {len(at)} gateways",
        "gateways at (m)": ", ".join(at[:LISTED]) + more,
        "distances": f"{dataset.distances.min():.3g} to {dataset.distances.max():.3g} m",
        "floor": f"{dataset.floor_dbm:g} dBm ({stated})",
        "not received": f"{1 - heard.mean():.1%} of the powers, {NOT_RECEIVED:g} in the file",
        "powers (dBm)": span,
        "distance law": law,
        "can be used": f"by bisplat {TAKE_POWERS}, by NeRF² and GSRF",
    }


def figures_of_powers(dataset: Dataset) -> dict[str, Any]:
    """What ``bisplat check --json`` prints of received powers alone."""
    heard, law = ~np.isnan(dataset.powers), distance_law(dataset)
    powers = dataset.powers[heard]
    return {
        "kind": "rssi",
        "positions": len(dataset),
        "gateways": dataset.gateway_names,
        "floor_dbm": dataset.floor_dbm,
        "not_received": round(1 - float(heard.mean()), 4),
        "weakest_dbm": float(powers.min()) if powers.size else None,
        "strongest_dbm": float(powers.max()) if powers.size else None,
        "distance_exponent": None if law is None else round(float(np.median(law[0])), 3),
    }


def oddities_of_powers(dataset: Dataset) -> list[str]:
    """A sentence for each oddity of received powers."""
    found = []
    powers, heard = dataset.powers, ~np.isnan(dataset.powers)
    if not heard.any():
        return ["no gateway has received anything"]
    silent = np.array(dataset.gateway_names)[~heard.any(axis=0)].tolist()
    if silent:
        listed = ", ".join(silent[:5]) + (f" and {len(silent) - 5} more" if len(silent) > 5 else "")
        found.append(f"gateway{'s' if len(silent) > 1 else ''} {listed} received nothing")
    lost = int((~heard.any(axis=1)).sum())
    if lost:
        found.append(f"{lost} of {len(dataset)} positions were received by no gateway")
    weak = int((powers < NOT_RECEIVED).sum())
    if weak:
        found.append(
            f"{weak} of {heard.sum()} powers lie below {NOT_RECEIVED:g} dBm, which NeRF² reads as negative amplitudes "
            f"and GSRF leaves out; put {NOT_RECEIVED:g} where nothing was received"
        )
    positive = int((powers > 0).sum())
    if positive:
        found.append(f"{positive} of {heard.sum()} powers lie above 0 dBm, which NeRF² reads as amplitudes above 1")
    zeros, others = int((powers == 0).sum()), powers[heard & (powers != 0)]
    if zeros and others.size and others.max() < -APART:
        found.append(
            f"{zeros} of {heard.sum()} powers are 0 dBm, and all others at least {-others.max():.0f} dB weaker: if 0 "
            f"means that nothing was received, put {NOT_RECEIVED:g} there"
        )
    law = distance_law(dataset)
    if law is not None and np.median(law[0]) < 0:
        found.append("the powers rise with the distance: do the positions and the powers belong together, row by row?")
    return found + _too_strong(dataset)


def _too_strong(dataset: Dataset) -> list[str]:
    """Powers that are stronger than free space allows, as with positions in millimetres."""
    stated = dataset.metadata.get("receiver", {}).get("tx_power_dbm")
    sent = USUAL_POWER if stated is None else float(stated)
    distance = np.maximum(dataset.distances, dataset.wavelength)
    excess = np.nanmedian(dataset.powers - sent - 20 * np.log10(dataset.wavelength / (4 * np.pi * distance)))
    if excess <= BELIEVED:
        return []
    return [
        f"half of the powers are more than {excess:.0f} dB above those of free space at "
        f"{dataset.frequency.hertz / 1e6:g} MHz with {sent:g} dBm: are the positions in metres (the median distance is "
        f"{np.median(dataset.distances):.4g} m)?"
    ]
