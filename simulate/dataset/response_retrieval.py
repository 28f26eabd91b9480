"""Retrieve the element responses behind a folder's pictures, and write them to its channels.npz."""

from __future__ import annotations

import hashlib

import numpy as np
from jaxtyping import UInt8

from scenes.files.atomic import remove_left
from scenes.files.errors import InputError
from scenes.files.npz_file import Expected, read_npz, write_arrays
from scenes.files.output_folder import locked
from scenes.files.plain_text import say
from scenes.files.progress import progress_bar
from simulate.dataset.dataset import Dataset
from simulate.dataset.responses_file import LARGEST_NPZ
from simulate.positions.positions import read_points
from simulate.spectra.element_array import require_planar
from simulate.spectra.phase_retrieval import AT_ONCE, Retrieval, retrieve_responses
from simulate.spectra.spectrum import spectrum_of


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
