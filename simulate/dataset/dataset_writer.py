"""Write the files of a NeRF² dataset folder, each atomically. The documentation describes every file."""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Sequence
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from jaxtyping import Complex, Float, UInt8
from PIL import Image

from scenes.files.atomic import write_atomically
from scenes.files.npz_file import write_arrays
from simulate.spectra.band import Band


def encode_picture(picture: UInt8[np.ndarray, "90 360"]) -> bytes:
    """The PNG file of one picture: 8-bit grey."""
    buffer = BytesIO()
    # Runs of equal bytes alone take a quarter of the time of Pillow's default, and the files are a sixth larger.
    Image.fromarray(picture).save(buffer, format="PNG", compress_level=1, compress_type=zlib.Z_RLE)
    return buffer.getvalue()


def encode_power(power_db: Float[np.ndarray, "90 360"]) -> bytes:
    """The TIFF file of a spectrum's absolute power in dB: one channel of float32, with rows as in the pictures."""
    buffer = BytesIO()
    # Uncompressed, since every reader can read that, and compression would save a fifth at most.
    Image.fromarray(power_db.astype(np.float32)).save(buffer, format="TIFF")
    return buffer.getvalue()


def write_positions(path: Path, positions: Float[np.ndarray, "K 3"]) -> None:
    """Write tx_pos.csv or rx_pos.csv, in metres with 6 decimals."""
    text = StringIO()
    text.write("x,y,z\n")
    np.savetxt(text, positions, fmt="%.6f", delimiter=",")
    write_atomically(path, text.getvalue().encode())


def write_frequencies(path: Path, hertz: Float[np.ndarray, " K"]) -> None:
    """Write freq.txt: the frequency of each picture in GHz, as XFreq-GS reads it."""
    write_atomically(path, "".join(f"{each / 1e9:.9g}\n" for each in hertz.tolist()).encode())


def write_index(path: Path, names: Sequence[str]) -> None:
    """Write train_index.txt or test_index.txt."""
    write_atomically(path, "".join(f"{name}\n" for name in names).encode())


def write_gateway(path: Path, dataset_name: str, position: Sequence[float], orientation: Sequence[float]) -> None:
    """Write gateway_info.yml."""
    name = yaml.safe_dump({"dataset_name": dataset_name}, allow_unicode=True, width=math.inf)  # quoted where needed
    text = (
        f"{name}"
        "gateway1:\n"
        f"  position: [{', '.join(f'{value:.6f}' for value in position)}]\n"
        f"  orientation: [{', '.join(f'{value:.9f}' for value in orientation)}]  # x, y, z, w\n"
    )
    write_atomically(path, text.encode())


def write_responses(
    path: Path, responses: Complex[np.ndarray, "K elements *band"], band: Band | None = None, retrieved: bool = False
) -> None:
    """Write channels.npz: complex64 element responses, not normalised, at the carrier and over a band."""
    responses = responses.astype(np.complex64)
    arrays = {"channels": responses} if band is None else {"channels": responses[..., band.carrier], "band": responses}
    write_arrays(path, {**arrays, **({"retrieved": np.array(True)} if retrieved else {})})


def write_metadata(path: Path, metadata: dict[str, Any]) -> None:
    """Write metadata.json."""
    write_atomically(path, (json.dumps(metadata, indent=2, ensure_ascii=False) + "\n").encode())
