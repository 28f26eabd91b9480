"""A dataset folder from the files of a recording: positions and element responses in NumPy, MATLAB, HDF5 or a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float
from scipy.spatial.transform import Rotation

from scenes.files.errors import InputError, ParameterError
from scenes.files.output_folder import new_folder
from scenes.scene.antennas import Gateway
from scenes.scene.frequency import read_frequency
from simulate.dataset.bearings import FARTHER, POINTS
from simulate.dataset.channels_folder import given_band
from simulate.dataset.dataset_folder import require_written
from simulate.dataset.dataset_frequency import SAME, Frequency, named
from simulate.dataset.dataset_kinds import Phases
from simulate.dataset.written_dataset import fill_dataset, own_responses
from simulate.exchange.array_files import Arrays, read_arrays
from simulate.exchange.named_arrays import Found, find_arrays
from simulate.exchange.reading_options import Recording
from simulate.positions.positions import check_points
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import Array, PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import array_of
from simulate.spectra.spectrum import evenly

EXAMINED = 200  # Most positions whose strongest direction is looked at

APART = 10.0  # Degrees by which every other reading must be farther from the transmitters

OWN = 0.75
"""The strongest directions must be nearer their own transmitters than those of other rows, by this factor. If they are
not, positions and responses of different rows belong together, or none do."""

FREQUENCIES = ("frequency", "frequencies", "freq", "frequency_hz", "freq_hz", "carrier", "carrier_hz")
"""Usual names of arrays with the frequency of each row, without regard to case."""

JUMP = 0.75 * np.pi
"""Radians. A phase that changes by more from element to element cannot be followed for certain."""


def record(
    files: Sequence[Path],
    output: Path,
    gateway: Gateway,
    frequency: str,
    recording: Recording = Recording(),
) -> list[str]:
    hertz = read_frequency(frequency)
    array = array_of(gateway, hertz)
    planar = isinstance(array, PlanarArray)
    if recording.columns_first is not None and not planar:
        found_order = f"found {recording.columns_first} for elements in the order of their positions"
        raise ParameterError("columns_first", f"expected a planar array, {found_order}")
    if recording.bandwidth is not None and recording.round_trip:
        raise ParameterError("round_trip", "expected no band beside it, found one")
    # The root of a response is known up to its sign.
    phases: Phases = "per-position" if recording.round_trip else recording.phases
    with new_folder(output) as unfinished:
        arrays, said = _together(files), list[str]()
        found = find_arrays(arrays, recording, array.elements, said)
        found = found.rows(rows_of_frequency(arrays, len(found.positions), hertz, said))
        found = found.rows(complete_rows(found, said))
        responses = one_way(found.responses, said) if recording.round_trip else found.responses
        band = given_band(responses.shape, "responses", recording.bandwidth, hertz)
        positions = check_points(found.positions)
        values = own_responses(responses, len(positions), array.elements, band)
        receivers = None if found.receivers is None else check_points(found.receivers, "receivers")
        if receivers is not None:
            gateway = replace(gateway, position=tuple(receivers[0].tolist()))
        # Where transmitters would be that an array at the gateway's position saw in the same directions.
        seen = positions
        if recording.moving != "transmitter":
            middle = np.array(gateway.position)
            seen = 2 * middle - positions if receivers is None else middle + positions - receivers
        of_carrier = values if band is None else values[..., band.carrier]
        stated = recording.columns_first if planar else False, recording.conjugate
        told = told_by_sight(of_carrier, seen, gateway, array, *stated)
        fill_dataset(
            *(unfinished, output, positions, told.order.read(values, array), gateway, hertz, AngularGrid()),
            *(recording.moving, receivers, phases, band),
        )
        require_written(unfinished, output)
    return [*said, _of_order(told, None in stated, planar)]


def _together(files: Sequence[Path]) -> Arrays:
    """The arrays of all files. If two files have arrays of the same name, the names of the files are put in front."""
    by_file = {path: read_arrays(path) for path in files}
    names = [name for arrays in by_file.values() for name in arrays]
    twice = {name for name in names if names.count(name) > 1}
    together: Arrays = {}
    for path, arrays in by_file.items():
        together |= {f"{path.stem}/{name}" if name in twice else name: each for name, each in arrays.items()}
    if len(together) < len(names):
        raise InputError(f"expected files of different names, found two of {files[0].name}")
    return together


def _of_order(told: Told, asked: bool, planar: bool = True) -> str:
    """A sentence on the order of the elements of a planar array and the sign of the phases."""
    along, turning = "y" if told.order.columns_first else "x", "rise" if told.order.conjugated else "fall"
    order = f"elements as numbered along {along} first" if planar else "elements in the order of their positions"
    taken = f"took {order}, and phases that {turning} with the distance"
    error = f"{told.error:.0f}° from the transmitters (median)"
    if not asked:
        return f"{taken}, as stated: the strongest directions are {error}"
    if told.clear:
        return f"{taken}: the strongest directions are then {error}, otherwise {told.error_otherwise:.0f}°"
    options = "--columns-first and --conjugate" if planar else "--conjugate"
    return (
        f"warning: {taken}. The strongest directions do not tell whether that is right: they are {error}, and "
        f"{told.error_otherwise:.0f}° otherwise. State {options}, True or False, as your "
        "receiver has them"
    )


class Order(NamedTuple):
    """How to read responses."""

    columns_first: bool = False  # elements are numbered along y first, then along x
    conjugated: bool = False  # the phase rises with the distance

    def read(
        self, responses: Complex[np.ndarray, "K elements *band"], array: Array
    ) -> Complex[np.ndarray, "K elements *band"]:
        """Responses in our order, x first, with phases that fall with the distance."""
        if self.columns_first and isinstance(array, PlanarArray):
            count, _, *band = responses.shape
            in_columns = responses.reshape(count, array.columns, array.rows, *band)
            responses = in_columns.swapaxes(1, 2).reshape(responses.shape)
        return responses.conj() if self.conjugated else responses


class Told(NamedTuple):
    """An order, and how it is known."""

    order: Order  # how to read the responses
    error: float  # median angle between the strongest directions and the transmitters, degrees
    error_otherwise: float  # that of the next best order
    clear: bool  # whether the strongest directions decide


def told_by_sight(
    responses: Complex[np.ndarray, "K elements"],
    positions: Float[np.ndarray, "K 3"],
    gateway: Gateway,
    array: Array,
    columns_first: bool | None,
    conjugated: bool | None,
) -> Told:
    """The order in which the strongest directions are nearest the transmitters."""
    chosen = evenly(np.arange(len(positions)), EXAMINED)
    towards = Rotation.from_quat(gateway.orientation).inv().apply(positions[chosen] - np.asarray(gateway.position))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True).clip(1e-9)
    grid = AngularGrid()
    beamformer = Beamformer(array, grid)
    orders = [
        Order(first, sign)
        for first in ((False, True) if columns_first is None else (columns_first,))
        for sign in ((False, True) if conjugated is None else (conjugated,))
    ]
    if array.is_line or not isinstance(array, PlanarArray):  # which have one order
        orders = [order for order in orders if not order.columns_first] or orders
    errors, errors_elsewhere = [], []
    elsewhere = np.roll(towards, len(towards) // 2, axis=0)
    for order in orders:
        read = order.read(responses[chosen], array)
        strongest = np.stack([grid.dominant_direction(beamformer.spectrum(each)) for each in read])
        errors.append(float(np.median(array.angle_between(strongest, towards))))
        errors_elsewhere.append(float(np.median(array.angle_between(strongest, elsewhere))))
    least, *others = sorted(errors)
    clear = least < POINTS and all(other > max(FARTHER * least, least + APART) for other in others)
    if np.median(array.angle_between(towards, elsewhere)) > APART:  # the rows do differ in direction
        clear = clear and least < OWN * errors_elsewhere[errors.index(least)]
    taken = errors.index(least) if clear else 0
    otherwise = min((error for number, error in enumerate(errors) if number != taken), default=np.inf)
    return Told(orders[taken], errors[taken], otherwise, clear)


def rows_of_frequency(arrays: Arrays, count: int, hertz: float, said: list[str]) -> Bool[np.ndarray, " count"]:
    """Whether each row is of the stated frequency. A recording of one frequency states it for no row."""
    for name, each in arrays.items():
        if name.lower().rpartition("/")[2] in FREQUENCIES and each.shape == (count,) and not np.iscomplexobj(each):
            chosen = np.abs(each / hertz - 1) <= SAME
            if not chosen.any():
                raise InputError(f"{name}: expected rows of {Frequency(hertz)}, found those of {named(each)}")
            if not chosen.all():
                said.append(
                    f"kept the rows of {Frequency(hertz)}: {chosen.sum()} of {count} ({name} has {named(each)})"
                )
            return chosen
    return np.ones(count, bool)


def complete_rows(found: Found, said: list[str]) -> Bool[np.ndarray, " K"]:
    """Whether each row has finite positions, and a finite response at every element."""
    placed = np.isfinite(found.positions).all(axis=1)
    if found.receivers is not None:
        placed &= np.isfinite(found.receivers).all(axis=1)
    complete = np.isfinite(found.responses).reshape(len(placed), -1).all(axis=1)
    if not (placed & complete).any():
        raise InputError(
            f"expected rows with a finite position, and a finite response at every element, found none among "
            f"{len(complete)}"
        )
    for whole, lacking in ((placed, "position"), (complete, "response at some element")):
        if not whole.all():
            said.append(f"left out {int((~whole).sum())} of {len(whole)} rows, which lack a finite {lacking}")
    return placed & complete


def one_way(responses: Complex[np.ndarray, "K elements"], said: list[str]) -> Complex[np.ndarray, "K elements"]:
    """The one-way field of a tag that the same antenna reads, whose responses are the squares of it.

    The root of a complex number is known up to its sign. From element to element the sign follows from the phase,
    which must change by less than half a turn. From position to position it stays unknown.
    """
    angle = np.unwrap(np.angle(responses), axis=1)
    jumps = np.abs(np.diff(angle, axis=1)) > JUMP
    said.append("took the roots of the responses, whose phases are those of the way to the tag and back")
    if jumps.any():
        share = jumps.any(axis=1).mean()
        said.append(
            f"warning: in {share:.0%} of the rows the phase changes by more than {np.degrees(JUMP):.0f}° between two "
            "elements, so that the sign of the root may be wrong there"
        )
    return np.sqrt(np.abs(responses)) * np.exp(0.5j * angle)
