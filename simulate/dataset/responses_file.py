"""Element responses of a dataset folder, channels.npz: read, checked, or retrieved from the pictures."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Int, UInt8

from scenes.files.atomic import remove_left
from scenes.files.errors import InputError
from scenes.files.input_file import MEGABYTE
from scenes.files.npz_file import Expected, read_npz, write_arrays
from scenes.files.output_folder import locked
from scenes.files.plain_text import say
from scenes.files.progress import progress_bar
from simulate.dataset.dataset import Dataset
from simulate.positions.positions import read_points
from simulate.spectra.band import Band
from simulate.spectra.element_array import require_planar
from simulate.spectra.phase_retrieval import AT_ONCE, Retrieval, retrieve_responses
from simulate.spectra.spectrum import spectrum_of

LARGEST_NPZ = 2000 * MEGABYTE  # Most bytes of channels.npz: 15 million positions of a 4 × 4 array

RESPONSE_MAGNITUDES = 1e-12, 1e12
"""Bounds of the largest magnitude of a dataset's responses. Models square it in single precision."""


class Recorded(NamedTuple):
    """Content of channels.npz, with a row for each of tx_pos.csv."""

    # responses at the carrier, or over the band if there is one; None if there is no such file
    responses: Complex[np.ndarray, "K elements *band"] | None = None
    retrieved: bool = False  # whether they have unknown phases of their own, such as those found behind pictures

    def of_rows(self, path: Path, rows: Int[np.ndarray, " n"]) -> dict[str, Complex[np.ndarray, "n elements *band"]]:
        """The responses of some rows by the name of the quantity. They must be of a magnitude that can be squared."""
        if self.responses is None:
            return {}
        found = self.responses[rows]
        finite = np.isfinite(found).reshape(len(found), -1).all(axis=1)
        if not (self.retrieved or finite.all()):
            raise InputError(
                f"{path}: expected finite responses, found others in {int((~finite).sum())} rows, first in that of "
                f"picture {int(np.flatnonzero(~finite)[0]) + 1} of {len(found)}"
            )
        low, high = RESPONSE_MAGNITUDES
        with np.errstate(over="ignore"):
            largest = float(np.abs(found[finite]).max(initial=0))
        if not low <= largest <= high:
            raise InputError(f"{path}: expected a largest magnitude from {low:g} to {high:g}, found {largest:.4g}")
        return {"retrieved" if self.retrieved else "response": found.astype(np.complex64)}


def read_responses(path: Path, rows: int | None, elements: int, band: Band | None = None) -> Recorded:
    """Read channels.npz."""
    if not os.path.lexists(path):
        return Recorded()
    positions = "the" if rows is None else rows
    what, numbers = f"responses of {positions} positions × {elements} elements", 1
    expected = {
        "channels": Expected(what, "c", (rows, elements)),
        "retrieved": Expected("whether the responses were retrieved", "b", optional=True),
    }
    if band is not None:
        over_band = f"{what} × {band.subcarriers} subcarriers"
        expected["band"] = Expected(over_band, "c", (rows, elements, band.subcarriers))
        numbers += band.subcarriers
    limit = LARGEST_NPZ if rows is None else 16 * rows * elements * numbers + MEGABYTE  # at most complex128
    found = read_npz(path, "an npz archive of responses", expected, min(limit, LARGEST_NPZ))
    retrieved = bool(found.get("retrieved", False))
    if band is None:
        return Recorded(found["channels"], retrieved)
    at_carrier = found["band"][..., band.carrier]
    same = np.isclose(found["channels"], at_carrier, rtol=1e-5, atol=0, equal_nan=True).all(axis=1)
    if not same.all():
        raise InputError(
            f"{path}: expected the channels of subcarrier {band.carrier} of band, found others in "
            f"{int((~same).sum())} rows, first in row {int(np.flatnonzero(~same)[0]) + 1} of {len(same)}"
        )
    return Recorded(found["band"], retrieved)


def write_responses(
    path: Path, responses: Complex[np.ndarray, "K elements *band"], band: Band | None = None, retrieved: bool = False
) -> None:
    """Write channels.npz: complex64 element responses, not normalised, at the carrier and over a band."""
    responses = responses.astype(np.complex64)
    arrays = {"channels": responses} if band is None else {"channels": responses[..., band.carrier], "band": responses}
    write_arrays(path, {**arrays, **({"retrieved": np.array(True)} if retrieved else {})})


def retrieve(dataset: Dataset) -> Retrieval:
    """Write channels.npz with responses retrieved from the pictures, or finish an interrupted retrieval.

    The result so far is written after each ``AT_ONCE`` pictures. Rows without a picture are not a number. ``retrieved``
    in the file tells readers that these are not recorded responses, whose phases can be compared from row to row.
    """
    folder, path = dataset.folder, dataset.folder / "channels.npz"
    recorded = dataset.phases_recorded_per_position and "retrieved" in dataset.values
    if "response" in dataset.values or recorded:
        raise InputError(f"{path}: expected no responses, or retrieved ones, found recorded ones, which are better")
    require_planar(dataset.array, str(folder))
    known = dataset.identification
    if known.source == "assumed":
        left = (
            "they have too few grey levels" if known.residual is None else f"it leaves {known.residual:.1f} grey levels"
        )
        raise InputError(
            f"{folder / 'spectrum'}: expected pictures that a 4 × 4 array explains, found that {left}; bisplat check "
            "tells more"
        )
    with locked(folder):
        remove_left(folder)
        return _retrieve(dataset)


def _retrieve(dataset: Dataset) -> Retrieval:
    """Retrieve and write, when all checks have passed and the folder is locked."""
    folder, path = dataset.folder, dataset.folder / "channels.npz"
    beamformer, count = dataset.beamformer, len(dataset.names)
    partial, digest = folder / "channels.npz.partial.npz", _digest(dataset)
    responses = np.zeros((count, beamformer.array.elements), np.complex64)
    residual = np.full(count, np.inf)
    done = 0
    if partial.exists():
        expected = {
            "channels": Expected(f"responses of {responses.shape[1]} elements", "c", (None, responses.shape[1])),
            "residual": Expected("residuals", "f", (None,)),
            "digest": Expected("the digest of the pictures", "f", (32,)),
        }
        try:
            begun = read_npz(partial, "what an interrupted bisplat dataset --retrieve left", expected, LARGEST_NPZ)
            if (begun["digest"] == digest).all() and len(begun["channels"]) == len(begun["residual"]) <= count:
                done = len(begun["channels"])
                responses[:done], residual[:done] = begun["channels"], begun["residual"]
        except InputError as error:
            say(f"{error}; the retrieval starts again at the first picture")
    with progress_bar() as progress:
        bar = progress.add_task("pictures", total=count, completed=done)
        for first in range(done, count, AT_ONCE):
            batch = slice(first, min(first + AT_ONCE, count))
            found = retrieve_responses(spectrum_of(dataset.pictures[batch]), beamformer, seed=first)
            responses[batch], residual[batch] = found.responses, found.residual
            begun = {"channels": responses[: batch.stop], "residual": residual[: batch.stop], "digest": digest}
            write_arrays(partial, begun)
            progress.advance(bar, batch.stop - batch.start)
    rows = np.array([int(name) for name in dataset.names]) - 1
    all_responses = np.full((len(read_points(folder / "tx_pos.csv")), responses.shape[1]), np.nan, np.complex64)
    all_residual = np.full(len(all_responses), np.nan, np.float32)
    all_responses[rows], all_residual[rows] = responses, residual
    write_arrays(path, {"channels": all_responses, "residual": all_residual, "retrieved": np.array(True)})
    partial.unlink()
    return Retrieval(responses, residual)


def _digest(dataset: Dataset) -> UInt8[np.ndarray, " 32"]:
    """A digest of what the responses are retrieved from: the pictures, the array and the grid."""
    digest = hashlib.sha256(f"{dataset.array.stated()} {dataset.grid}".encode())
    digest.update(dataset.pictures.tobytes())
    return np.frombuffer(digest.digest(), np.uint8)
