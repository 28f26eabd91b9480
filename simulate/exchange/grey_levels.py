"""Find out how another program's pictures are to be read: which way up, and what their grey levels stand for."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from scenes.files.errors import ParameterError
from simulate.exchange.reading_options import Conversion
from simulate.spectra.angular_grid import ROWS, AngularGrid
from simulate.spectra.array import Array
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.explanation import Explanation, explain
from simulate.spectra.identification import EXPLAINED, identify
from simulate.spectra.lags import LagSpace, decibel_residual
from simulate.spectra.spectrum import LARGEST_GREY, PictureScale, magnitudes


@dataclass(frozen=True)
class Reading:
    """How the pictures of a folder become magnitudes."""

    flipped: bool  # whether they are upside down
    quantity: PictureScale  # what their grey levels stand for
    decibels: float | None  # the stated range of pictures in decibels
    space: LagSpace | None  # lag functions by which the range of each picture is found if it is not stated
    # array and grid to write to metadata.json, since ``read_dataset`` would not find them itself
    stated: dict[str, Any] = field(default_factory=dict)
    said: list[str] = field(default_factory=list)  # sentences on what is read differently

    def picture(self, values: Float[np.ndarray, "90 360"]) -> UInt8[np.ndarray, "90 360"]:
        """The picture of magnitudes with row 0 lowest, from the levels of one picture, 0 to 1."""
        decibels = None if self.decibels is None else np.array([self.decibels])
        if self.space is not None:
            decibels = decibel_residual(self.space, values[None])[1]
        magnitude = magnitudes(values[None], self.quantity, decibels)[0]
        return np.round(LARGEST_GREY * (magnitude[::-1] if self.flipped else magnitude)).astype(np.uint8)


def reading_of(
    sample: Float[np.ndarray, "n 90 360"], conversion: Conversion, array: Array | None, grid: AngularGrid | None
) -> Reading:
    """How to read the pictures of a folder, by its options and by which array explains some of them."""
    pictures = np.round(LARGEST_GREY * sample).astype(np.uint8)
    explained = _explained(pictures, array, grid)
    shown = "magnitude" if explained is None else explained.scale
    quantity = conversion.quantity or shown
    said = []
    if explained is not None and quantity != shown:
        said.append(f"warning: an array explains the pictures as {shown}, not as {quantity}")
        explained = None
    space = None
    if quantity == "decibels" and conversion.decibels is None:
        if explained is None:
            expected = "expected the range from black to white in dB, since no array explains the pictures"
            raise ParameterError("decibels", f"{expected}, found nothing")
        space = LagSpace.of(explained.beamformer)
    upside_down = explained is not None and explained.beamformer.grid.elevation_step_deg < 0
    flipped = upside_down if conversion.flip_elevation is None else conversion.flip_elevation
    if flipped:
        said.append("turned the pictures upside down")
    if quantity == "power":
        said.append("took the square root of the grey levels, since they stand for power")
    elif quantity == "decibels":
        said.append("turned the grey levels from decibels into magnitudes")
    reading = Reading(
        flipped, quantity, conversion.decibels, space, {} if grid is None else {"grid": asdict(grid)}, said
    )
    if explained is None or flipped != upside_down:
        return reading
    return _with_array(reading, explained, sample, array, grid, conversion.azimuths is not None)


def _explained(
    pictures: UInt8[np.ndarray, "n 90 360"], array: Array | None, grid: AngularGrid | None
) -> Explanation | None:
    """The array that explains pictures: what ``read_dataset`` would find, or else what a longer search finds."""
    known = identify(pictures, array, grid)
    stated = array is not None and grid is not None and known.residual is not None and known.residual < EXPLAINED
    if known.residual is not None and (stated or "fitted" in (known.source, known.grid_source)):
        return Explanation(known.beamformer, "magnitude", known.residual)
    return explain(pictures, array, grid)


def _with_array(
    reading: Reading,
    explained: Explanation,
    sample: Float[np.ndarray, "n 90 360"],
    array: Array | None,
    grid: AngularGrid | None,
    azimuths: bool,
) -> Reading:
    """The reading, with the array and the grid stated unless ``read_dataset`` finds them itself."""
    found = explained.beamformer.grid
    if reading.flipped:
        last = found.elevation_first_deg + (ROWS - 1) * found.elevation_step_deg
        found = AngularGrid(last, -found.elevation_step_deg, found.azimuth_step_deg)
    beamformer = Beamformer(explained.beamformer.array, found)
    read_back = identify(np.stack([reading.picture(each) for each in sample]), array, grid)
    if read_back.beamformer == beamformer:
        return reading if grid is not None or not azimuths else replace(reading, stated={"grid": asdict(found)})
    stated = {"array": beamformer.array.stated(), "grid": asdict(beamformer.grid)}
    reading.said.append(
        f"stated an array of {beamformer.array.in_words}, and its grid in metadata.json, since they explain the "
        f"pictures (to {explained.residual:.2f} grey levels)"
    )
    return replace(reading, stated=stated)
