"""Element responses of a dataset folder, channels.npz: read, checked, or retrieved from the pictures."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, UInt8

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


class Responses(NamedTuple):
    """Content of channels.npz."""

    # responses at the carrier; None if there is no such file or it is faulty
    channels: Complex[np.ndarray, "K elements"] | None = None
    retrieved: bool = False  # whether they have unknown phases of their own, such as those found behind pictures
    # responses at all subcarriers; None if there are none
    over_band: Complex[np.ndarray, "K elements subcarriers"] | None = None


def read_responses(
    path: Path, rows: int | None, elements: int, problems: list[str], band: Band | None = None
) -> Responses:
    """Read channels.npz."""
    if not os.path.lexists(path):
        return Responses()
    positions = "the" if rows is None else rows
    expected = {
        "channels": Expected(f"responses of {positions} positions × {elements} elements", "c", (rows, elements)),
        "retrieved": Expected("whether the responses were retrieved", "b", optional=True),
    }
    numbers = 1
    if band is not None:
        shape = (rows, elements, band.subcarriers)
        what = f"responses of {positions} positions × {elements} elements × {band.subcarriers} subcarriers"
        expected["band"] = Expected(what, "c", shape)
        numbers += band.subcarriers
    limit = LARGEST_NPZ if rows is None else 16 * rows * elements * numbers + MEGABYTE  # at most complex128
    try:
        found = read_npz(path, "an npz archive of responses", expected, min(limit, LARGEST_NPZ))
    except InputError as error:
        problems.append(str(error))
        return Responses()
    return Responses(found["channels"], bool(found.get("retrieved", False)), found.get("band"))


def check_responses(
    path: Path, responses: Complex[np.ndarray, "K elements *band"], retrieved: bool, problems: list[str]
) -> None:
    """Check that responses are finite, not all zero, and of a magnitude that models can square."""
    finite = np.isfinite(responses).reshape(len(responses), -1).all(axis=1)
    if not (retrieved or finite.all()):
        problems.append(
            f"{path}: expected finite responses, found others in {int((~finite).sum())} rows, first in that of "
            f"picture {int(np.flatnonzero(~finite)[0]) + 1} of {len(responses)}"
        )
        return
    low, high = RESPONSE_MAGNITUDES
    with np.errstate(over="ignore"):
        largest = float(np.abs(responses[finite]).max(initial=0))
    if not low <= largest <= high:
        problems.append(f"{path}: expected a largest magnitude from {low:g} to {high:g}, found {largest:.4g}")


def retrieve(dataset: Dataset) -> Retrieval:
    """Write channels.npz with responses retrieved from the pictures, or finish an interrupted retrieval.

    The result so far is written after each ``AT_ONCE`` pictures, so an interruption loses at most these.

    The file holds ``channels`` (complex64, [rows of tx_pos.csv, elements], not a number if a row has no picture),
    ``residual`` (grey levels) and ``retrieved``, which is True. The last tells readers that these are not recorded
    responses, whose phases can be compared from one position to another.
    """
    folder, path = dataset.folder, dataset.folder / "channels.npz"
    recorded = dataset.phases_recorded_per_position and dataset.retrieved is not None
    if dataset.responses is not None or recorded:
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
            begun = read_npz(partial, "what an interrupted bisplat responses left", expected, LARGEST_NPZ)
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
