"""A dataset folder from element responses that a user has measured or computed, given as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import get_args

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import ArrayLike

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, ParameterError, check_array, require_instance, require_path, require_word
from scenes.files.output_folder import new_folder
from scenes.scene.antennas import Gateway
from scenes.scene.frequency import read_bandwidth, read_frequency
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import inspect, read_dataset
from simulate.dataset.dataset_kinds import Moving, Phases
from simulate.dataset.dataset_writer import (
    encode_picture,
    write_gateway,
    write_metadata,
    write_positions,
    write_responses,
)
from simulate.dataset.responses_file import RESPONSE_MAGNITUDES
from simulate.generation.dataset_parts import picture_names
from simulate.positions.positions import check_points
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import Array, PlanarArray
from simulate.spectra.band import Band
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import ElementArray, array_of
from simulate.spectra.spectrum import picture

AT_ONCE = 100  # Pictures made at a time. This bounds the memory.


def write_dataset(
    folder: Path | str,
    positions: Float[ArrayLike, "K 3"],
    responses: Complex[ArrayLike, "K elements *band"],
    array: Array,
    frequency: float | str,
    gateway_position: Sequence[float] = (0.0, 0.0, 0.0),
    gateway_orientation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
    grid: AngularGrid = AngularGrid(),
    phases: Phases = "common",
    bandwidth: float | str | None = None,
    moving: Moving = "transmitter",
    receivers: Float[ArrayLike, "K 3"] | None = None,
) -> Dataset:
    """Write a dataset folder from element responses of one's own, measured or computed.

    The pictures are the spectra of the responses. The folder has no index files, so a split must be named when a model
    is trained on it.

    Args:
        folder: the new dataset folder.
        positions: transmitter positions, metres, world frame, [K, 3].
        responses: complex element responses y, in any one unit, [K, elements], or with a bandwidth those of all
            subcarriers, [K, elements, subcarriers]. Element m = row · columns + column of a ``PlanarArray``, x runs
            fastest; those of an ``ElementArray`` are in its own order. A path of delay τ has the phase e^{−j2πfτ}; if a
            receiver has e^{+j2πfτ}, give the conjugate.
        array: the array of the gateway: a ``PlanarArray``, or an ``ElementArray`` of positions in metres, which gets
            ``frequency``.
        frequency: hertz, or a text with a unit such as "915 MHz".
        gateway_position: metres, world frame, [3].
        gateway_orientation: unit quaternion (x, y, z, w) that turns the gateway frame into the world frame, [4];
            ``bisplat.facing`` makes one from a boresight.
        grid: directions of the pictures' rows and columns.
        phases: "common" if the phases of different positions can be compared, as with a synchronised transmitter or a
            tag that answers the reader; "per-position" if each position has an unknown phase of its own.
        bandwidth: hertz, or a text with a unit such as "20 MHz", if the responses are those of N subcarriers:
            subcarrier n has the frequency f + (n − ⌊N/2⌋) B/N, as in ``Band``. None: only those of the carrier.
        moving: "receiver" if the middle of the array is at ``positions``, with its orientation, and the transmitter
            stands at ``gateway_position``; "both" if the transmitter is at ``positions`` and the middle of the array at
            ``receivers``.
        receivers: where the middle of the array is for each of ``positions``, if both ends move, metres, world frame,
            [K, 3]. Then ``gateway_position`` is not given.

    Returns:
        The dataset.

    Raises:
        ParameterError: an argument has another shape, is not finite or does not fit the others.
        InputError: the folder is not new.

    Example:
        Plane waves from two directions:

        >>> import bisplat, numpy as np
        >>> array = bisplat.PlanarArray()
        >>> y = array.manifold(np.radians([200.0, 60.0]), np.radians([40.0, 10.0]))
        >>> mine = bisplat.write_dataset("data/mine", [[3, 0, 1], [2, 2, 1]], y, array, "2.4 GHz")
        >>> mine
        Dataset('data/mine': 2 spectra, 4 × 4 elements, 2400 MHz)
        >>> mine.spectra.shape, mine.responses.shape
        ((2, 90, 360), (2, 16))
    """
    require_path(folder=folder)
    require_instance(PlanarArray, ElementArray, array=array)
    require_instance(AngularGrid, grid=grid)
    require_word(get_args(Phases), phases=phases)
    require_word(get_args(Moving), moving=moving)
    hertz = read_frequency(frequency)
    places = check_points(positions)
    arrays = require_receivers(receivers, moving, len(places))
    if arrays is not None:
        if np.any(gateway_position):
            raise ParameterError("gateway_position", "expected none beside receivers, where the array is, found one")
        gateway_position = tuple(arrays[0].tolist())
    band = None
    if bandwidth is not None:
        shape = np.shape(responses)
        if len(shape) != 3:
            raise ParameterError(
                "responses", f"expected [positions, elements, subcarriers] beside a bandwidth, found shape {shape}"
            )
        band = Band(read_bandwidth(bandwidth), shape[2])
        band.frequencies(hertz)  # refuses one that is too wide
    found = own_responses(responses, len(places), array.elements, band)
    _require_same_frequency(array, hertz)
    gateway = Gateway(gateway_position, gateway_orientation, **array.of_gateway())  # type: ignore[arg-type]  # checks both
    with new_folder(Path(folder)) as unfinished:
        fill_dataset(unfinished, Path(folder), places, found, gateway, hertz, grid, phases, band, moving, arrays)
    return read_dataset(folder)


def require_receivers(
    receivers: Float[ArrayLike, "K 3"] | None, moving: Moving, count: int
) -> Float[np.ndarray, "K 3"] | None:
    """Check where the array is if both ends move; None if one stands still."""
    if receivers is None:
        if moving == "both":
            raise ParameterError("receivers", "expected the array's positions, since both ends move, found none")
        return None
    if moving != "both":
        raise ParameterError("receivers", f"expected none unless both ends move, found some beside moving {moving}")
    found = check_points(receivers, "receivers")
    if len(found) != count:
        raise ParameterError("receivers", f"expected a row for each of the {count} positions, found {len(found)}")
    return found


def _require_same_frequency(array: Array, frequency: float) -> None:
    stated = array.frequency if isinstance(array, ElementArray) else None
    if stated not in (None, frequency):
        raise ParameterError("frequency", f"expected the frequency of the array, {stated:g} Hz, found {frequency:g} Hz")


def fill_dataset(
    folder: Path,
    called: Path,
    positions: Float[np.ndarray, "K 3"],
    responses: Complex[np.ndarray, "K elements *band"],
    gateway: Gateway,
    frequency: float,
    grid: AngularGrid,
    phases: Phases,
    band: Band | None = None,
    moving: Moving = "transmitter",
    receivers: Float[np.ndarray, "K 3"] | None = None,
) -> None:
    """Write the files of a dataset into an empty folder."""
    array = array_of(gateway, frequency)
    beamformer, names = Beamformer(array, grid), picture_names(len(positions))
    of_carrier = responses if band is None else responses[..., band.carrier]
    (folder / "spectrum").mkdir()
    for start in range(0, len(names), AT_ONCE):
        some = names[start : start + AT_ONCE]
        with ThreadPoolExecutor() as pool:
            files = pool.map(encode_picture, picture(beamformer.spectrum(of_carrier[start : start + AT_ONCE])))
            for name, content in zip(some, files, strict=True):
                write_atomically(folder / "spectrum" / f"{name}.png", content)
    write_positions(folder / "tx_pos.csv", positions)
    if receivers is not None:
        write_positions(folder / "rx_pos.csv", receivers)
    write_gateway(folder / "gateway_info.yml", called.name, gateway.position, gateway.orientation)
    write_responses(folder / "channels.npz", responses, band, retrieved=phases == "per-position")
    stated = {"frequency_hz": frequency, "array": array.stated(), "grid": asdict(grid), "phases": phases}
    stated |= {} if band is None else {"band": asdict(band)}
    stated |= {} if moving == "transmitter" else {"moving": moving}
    write_metadata(folder / "metadata.json", {"made_by": f"bisplat-wrf {version('bisplat-wrf')}"} | stated)
    problems = inspect(folder).problems
    if problems:
        raise InputError(problems[0].replace(str(folder), str(called)))


def own_responses(
    given: Complex[ArrayLike, "K elements *band"], count: int, elements: int, band: Band | None = None
) -> Complex[np.ndarray, "K elements *band"]:
    """Check responses from a user; the messages name what people most often mix up."""
    what = f"responses of {count} positions × {elements} elements"
    wanted: tuple[int, ...] = (count, elements)
    shape = np.shape(given)
    if band is not None:
        wanted, what = (*wanted, band.subcarriers), f"{what} × {band.subcarriers} subcarriers"
    elif len(shape) == 3 and shape[:2] == wanted:
        raise ParameterError("bandwidth", f"expected one beside responses of {shape[2]} subcarriers, found none")
    if shape == (elements, count) and elements != count:
        raise ParameterError("responses", f"expected {what}, found {elements} × {count}: transpose them (.T)")
    found = check_array("responses", given, wanted, what, "c")
    if elements > 1 and not np.iscomplex(found).any():
        raise ParameterError("responses", f"expected {what} with phases, found real numbers only")
    low, high = RESPONSE_MAGNITUDES
    largest = float(np.abs(found).max())
    if not low <= largest <= high:
        raise ParameterError("responses", f"expected a largest magnitude from {low:g} to {high:g}, found {largest:.4g}")
    silent = np.flatnonzero(~found.reshape(count, -1).any(axis=1))
    if len(silent):
        more = f" and {len(silent) - 1} more" if len(silent) > 1 else ""
        raise ParameterError(
            "responses",
            f"expected a signal at every position, found zeros in row {int(silent[0])}{more}; leave them out",
        )
    return found
