"""A part of a dataset: consecutive positions traced, measured and drawn; the same bytes wherever it is made."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Complex

from simulate.dataset_writer import encode_picture, encode_power
from simulate.request import Request
from simulate.spectrum import picture

if TYPE_CHECKING:  # needs the ray tracer
    from simulate.trace import Tracer


@dataclass(frozen=True)
class Part:
    """What is written of some consecutive positions.

    Attributes:
        responses: complex element responses, as measured.
        pictures: a PNG file each.
        power: a TIFF file each, in dB; empty where none are wanted.
    """

    responses: Complex[np.ndarray, "n elements"]
    pictures: list[bytes]
    power: list[bytes]


def make_part(request: Request, tracer: Tracer, start: int, size: int) -> Part:
    """Trace positions ``start`` … ``start + size − 1`` of a request (fewer at its end)."""
    positions = request.positions[start : start + size]
    numbers = np.arange(start, start + len(positions))
    responses = request.measurement.apply(tracer.responses(positions), numbers, request.measurement_seed)
    with ThreadPoolExecutor() as pool:
        pictures = list(pool.map(encode_picture, picture(request.array.spectrum(responses))))
        power = list(pool.map(encode_power, request.array.power_db(responses))) if request.power else []
    return Part(responses, pictures, power)
