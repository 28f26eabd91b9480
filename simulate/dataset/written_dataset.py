"""Writing a dataset folder from values that a user has measured or computed, given as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from inspect import Parameter, signature
from pathlib import Path
from typing import Any, get_args

import numpy as np
from jaxtyping import Complex, Float, Shaped
from numpy.typing import ArrayLike

from scenes.files.errors import (
    ParameterError,
    check_array,
    require_instance,
    require_path,
    require_within,
    require_word,
    shown,
)
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import say
from scenes.scene.antennas import Gateway
from scenes.scene.frequency import read_bandwidth, read_frequency
from simulate.dataset.channels_folder import write_channels
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset, require_written
from simulate.dataset.dataset_kinds import NOT_RECEIVED, STRONGEST, Moving, Phases
from simulate.dataset.index_files import write_drawn_split
from simulate.dataset.metadata import made_here
from simulate.dataset.powers_files import own_gateways, own_powers
from simulate.dataset.powers_folder import write_powers
from simulate.dataset.responses_file import RESPONSE_MAGNITUDES, write_responses
from simulate.dataset.spectra_folder import write_spectra
from simulate.positions.positions import check_points
from simulate.spectra.angular_grid import COLUMNS, ROWS, AngularGrid
from simulate.spectra.array import Array, PlanarArray
from simulate.spectra.band import Band
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import ElementArray, array_of
from simulate.spectra.spectrum import picture

AT_ONCE = 100  # Pictures made at a time. This bounds the memory.

OF_ARRAY = ("array", "gateway_position", "gateway_orientation", "grid", "moving", "receivers")

TAKES = {
    "responses": (*OF_ARRAY, "phases", "bandwidth"),
    "spectra": OF_ARRAY,
    "powers": ("gateways", "floor_dbm"),
    "channels": ("antennas", "bandwidth"),
}
"""The arguments that each quantity takes beside folder, positions and frequency."""


def write_dataset(
    folder: Path | str,
    positions: Float[ArrayLike, "K 3"] | None,
    responses: Complex[ArrayLike, "K elements *band"] | None = None,
    array: Array | None = None,
    frequency: float | str | None = None,
    gateway_position: Sequence[float] = (0.0, 0.0, 0.0),
    gateway_orientation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
    grid: AngularGrid = AngularGrid(),
    phases: Phases = "common",
    bandwidth: float | str | None = None,
    moving: Moving = "transmitter",
    receivers: Float[ArrayLike, "K 3"] | None = None,
    *,
    spectra: Shaped[ArrayLike, "K 90 360"] | None = None,
    powers: Float[ArrayLike, "K G"] | None = None,
    gateways: Mapping[str, Sequence[float]] | None = None,
    floor_dbm: float = NOT_RECEIVED,
    channels: Complex[ArrayLike, "K A subcarriers"] | None = None,
    antennas: Float[ArrayLike, "A 3"] | None = None,
) -> Dataset:
    """Write a dataset folder from responses, spectra, received powers or channels of one's own, measured or computed.

    Exactly one of ``responses``, ``spectra``, ``powers`` and ``channels`` is given. The published loaders of NeRF² and
    GSRF read the folder. The pictures of responses are their spectra. Folders of spectra have no index files, so a
    split must be named when a model is trained on them; those of powers and channels have a random 80/20 split of seed
    0, which NeRF² and GSRF need.

    Args:
        folder: the new dataset folder.
        positions: transmitter positions, metres, world frame, [K, 3]; None if those of channels are not known.
        responses: complex element responses y, in any one unit, [K, elements], or with a bandwidth those of all
            subcarriers, [K, elements, subcarriers]. Element m = row · columns + column of a ``PlanarArray``, x runs
            fastest; those of an ``ElementArray`` are in its own order. A path of delay τ has the phase e^{−j2πfτ}; if a
            receiver has e^{+j2πfτ}, give the conjugate.
        array: the array of the gateway: a ``PlanarArray``, or an ``ElementArray`` of positions in metres, which gets
            ``frequency``. Of spectra it need not be given: then a fit to them finds it.
        frequency: hertz, or a text with a unit such as "915 MHz".
        gateway_position: metres, world frame, [3].
        gateway_orientation: unit quaternion (x, y, z, w) that turns the gateway frame into the world frame, [4];
            ``bisplat.facing`` makes one from a boresight.
        grid: directions of the pictures' rows and columns.
        phases: "common" if the phases of different positions can be compared, as with a synchronised transmitter or a
            tag that answers the reader; "per-position" if each position has an unknown phase of its own.
        bandwidth: hertz, or a text with a unit such as "20 MHz", if the responses or channels are those of N
            subcarriers: subcarrier n has the frequency f + (n − ⌊N/2⌋) B/N, as in ``Band``. None: only those of the
            carrier, or channels whose band is not known.
        moving: "receiver" if the middle of the array is at ``positions``, with its orientation, and the transmitter
            stands at ``gateway_position``; "both" if the transmitter is at ``positions`` and the middle of the array at
            ``receivers``.
        receivers: where the middle of the array is for each of ``positions``, if both ends move, metres, world frame,
            [K, 3]. Then ``gateway_position`` is not given.
        spectra: magnitudes from 0 to 1, as ``Dataset.spectra`` are, or grey levels (uint8), [K, 90, 360].
        powers: received powers, dBm, [K, G]; NaN where nothing was received. The format marks this by −100, so a power
            of −100 dBm or less counts as not received, and a line on stderr says how many there are.
        gateways: position of each gateway by its name, metres, world frame, in the order of the powers' columns.
        floor_dbm: power below which a gateway receives nothing, dBm, from −100 on.
        channels: complex channels, [K, A, subcarriers]; the first half of the subcarriers is the uplink.
        antennas: positions of the base station's antennas, metres, world frame, [A, 3].

    Returns:
        The dataset, read from the folder.

    Raises:
        ParameterError: an argument has another shape, is not finite or does not fit the others, or the powers cannot
            be in dBm.
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

        Received powers:

        >>> heard, gateways = [[-48, -61.0], [-60, np.nan]], {"door": (0, 0, 2), "window": (5, 0, 2)}
        >>> places = [[1, 2, 1], [4, 2, 1]]
        >>> bisplat.write_dataset("hall", places, powers=heard, gateways=gateways, frequency="2.4 GHz")
        Dataset('hall': received powers of 2 positions, 2 gateways, 2400 MHz)
    """
    given = locals()
    require_path(folder=folder)
    chosen = [name for name in TAKES if given[name] is not None]
    if len(chosen) != 1:
        found = " and ".join(chosen) or "none of them"
        raise ParameterError(
            chosen[-1] if chosen else "responses", f"expected one of {', '.join(TAKES)}, found {found}"
        )
    [quantity] = chosen
    parameters = signature(write_dataset).parameters.items()
    defaults = {name: each.default for name, each in parameters if each.default is not Parameter.empty}
    for name in defaults.keys() - {quantity, "frequency", *TAKES[quantity]}:
        if given[name] is not defaults[name]:
            raise ParameterError(name, f"expected none beside {quantity}, found {shown(given[name])}")
    hertz = read_frequency(frequency)  # type: ignore[arg-type]  # refuses None, too
    unplaced = positions is None and quantity == "channels"
    places = np.zeros((0, 3)) if unplaced else check_points(positions)  # type: ignore[arg-type]  # refuses None, too
    with new_folder(Path(folder)) as unfinished:
        if channels is not None:
            _fill_channels(unfinished, None if unplaced else places, channels, antennas, hertz, bandwidth)
        elif powers is not None:
            _fill_powers(unfinished, places, powers, gateways, hertz, floor_dbm, str(folder))
        else:
            require_instance(AngularGrid, grid=grid)
            require_word(get_args(Phases), phases=phases)
            require_word(get_args(Moving), moving=moving)
            arrays = require_receivers(receivers, moving, len(places))
            if arrays is not None:
                if np.any(gateway_position):
                    wrong = "expected none beside receivers, where the array is, found one"
                    raise ParameterError("gateway_position", wrong)
                gateway_position = tuple(arrays[0].tolist())
            kind = {} if array is None and spectra is not None else _of_gateway(array, hertz)
            gateway = Gateway(gateway_position, gateway_orientation, **kind)  # type: ignore[arg-type]  # checks both
            ends = gateway, hertz, grid, moving, arrays
            if responses is None:
                assert spectra is not None
                _fill_spectra(unfinished, Path(folder), places, spectra, *ends, stated=array is not None)
            else:
                band = _band(np.shape(responses), "responses", bandwidth, hertz)
                own = own_responses(responses, len(places), array_of(gateway, hertz).elements, band)
                fill_dataset(unfinished, Path(folder), places, own, *ends, phases=phases, band=band)
        require_written(unfinished, Path(folder))
    return read_dataset(folder)


def _of_gateway(array: Array | None, hertz: float) -> dict[str, Any]:
    """What a gateway's description says of its array, which must be for the frequency."""
    require_instance(PlanarArray, ElementArray, array=array)
    assert array is not None
    stated = array.frequency if isinstance(array, ElementArray) else None
    if stated not in (None, hertz):
        raise ParameterError("frequency", f"expected the frequency of the array, {stated:g} Hz, found {hertz:g} Hz")
    return array.of_gateway()


def _band(shape: tuple[int, ...], name: str, bandwidth: float | str | None, hertz: float) -> Band | None:
    """The band of responses or channels; None if no bandwidth is given."""
    if bandwidth is None:
        return None
    if len(shape) != 3:
        wrong = f"expected subcarriers along the third axis beside a bandwidth, found shape {shape}"
        raise ParameterError(name, wrong)
    band = Band(read_bandwidth(bandwidth), shape[2])
    band.frequencies(hertz)  # refuses one that is too wide
    return band


def _fill_powers(
    folder: Path,
    positions: Float[np.ndarray, "K 3"],
    powers: Float[ArrayLike, "K G"],
    gateways: Mapping[str, Sequence[float]] | None,
    hertz: float,
    floor_dbm: float,
    called: str,
) -> None:
    """Write the files of received powers into an empty folder."""
    at = own_gateways(gateways)
    levels = own_powers(powers, len(positions), len(at))
    require_within(NOT_RECEIVED, STRONGEST, "a power in dBm", floor_dbm=floor_dbm)
    stated = {"kind": "rssi", "frequency_hz": hertz, "receiver": {"floor_dbm": float(floor_dbm)}}
    write_powers(folder, positions, at, levels, made_here() | stated)
    weak = int((levels <= NOT_RECEIVED).sum())
    if weak:
        say(f"{called}: {weak} powers of {NOT_RECEIVED:g} dBm or less count as not received")


def _fill_channels(
    folder: Path,
    positions: Float[np.ndarray, "K 3"] | None,
    channels: Complex[ArrayLike, "K A subcarriers"],
    antennas: Float[ArrayLike, "A 3"] | None,
    hertz: float,
    bandwidth: float | str | None,
) -> None:
    """Write the files of channels into an empty folder."""
    if antennas is None:
        raise ParameterError("antennas", "expected the positions of the antennas beside channels, found none")
    at = check_points(antennas, "antennas")
    count = None if positions is None else len(positions)
    what = f"channels of {'some' if count is None else count} positions × {len(at)} antennas × subcarriers"
    found = check_array("channels", channels, (count, len(at), None), what, "c").astype(np.complex64)
    if found.shape[2] % 2:
        raise ParameterError("channels", f"expected an even number of subcarriers, found {found.shape[2]}")
    band = _band(found.shape, "channels", bandwidth, hertz)
    stated = {"kind": "csi", **({} if band is None else {"band": asdict(band)}), "frequency_hz": hertz}
    write_channels(folder, positions, at, found, made_here() | stated)
    write_drawn_split(folder, len(found), 0)


def _fill_spectra(
    folder: Path,
    called: Path,
    positions: Float[np.ndarray, "K 3"],
    spectra: Shaped[ArrayLike, "K 90 360"],
    gateway: Gateway,
    hertz: float,
    grid: AngularGrid,
    moving: Moving,
    receivers: Float[np.ndarray, "K 3"] | None,
    stated: bool,
) -> None:
    """Write the files of spectra into an empty folder; array and grid are stated if the array is known."""
    what = f"spectra of {len(positions)} positions, [K, {ROWS}, {COLUMNS}]"
    found = np.asarray(spectra)
    if found.dtype != np.uint8:
        found = check_array("spectra", spectra, (len(positions), ROWS, COLUMNS), what)
        if found.min() < 0 or found.max() > 1:
            span = f"{found.min():.4g} to {found.max():.4g}"
            raise ParameterError("spectra", f"expected magnitudes from 0 to 1, or grey levels (uint8), found {span}")
        found = np.round(255 * found).astype(np.uint8)
    if found.shape != (len(positions), ROWS, COLUMNS):
        raise ParameterError("spectra", f"expected {what}, found shape {found.shape}")
    known = {"array": array_of(gateway, hertz).stated(), "grid": asdict(grid)} if stated else {}
    metadata = made_here() | {"frequency_hz": hertz} | known | ({} if moving == "transmitter" else {"moving": moving})
    write_spectra(folder, called, positions, [found], gateway, metadata, receivers)


def fill_dataset(
    folder: Path,
    called: Path,
    positions: Float[np.ndarray, "K 3"],
    responses: Complex[np.ndarray, "K elements *band"],
    gateway: Gateway,
    hertz: float,
    grid: AngularGrid = AngularGrid(),
    moving: Moving = "transmitter",
    receivers: Float[np.ndarray, "K 3"] | None = None,
    phases: Phases = "common",
    band: Band | None = None,
) -> None:
    """Write the files of responses and of their spectra into an empty folder."""
    array = array_of(gateway, hertz)
    of_carrier = responses if band is None else responses[..., band.carrier]
    beamformer = Beamformer(array, grid)
    starts = range(0, len(of_carrier), AT_ONCE)
    pictures = (picture(beamformer.spectrum(of_carrier[start : start + AT_ONCE])) for start in starts)
    stated = {"frequency_hz": hertz, "array": array.stated(), "grid": asdict(grid), "phases": phases}
    stated |= {} if band is None else {"band": asdict(band)}
    stated |= {} if moving == "transmitter" else {"moving": moving}
    write_spectra(folder, called, positions, pictures, gateway, made_here() | stated, receivers)
    write_responses(folder / "channels.npz", responses, band, retrieved=phases == "per-position")


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
