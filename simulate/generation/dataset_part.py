"""A part of a dataset: the responses and pictures of consecutive positions, with the same bytes on every machine."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex

from simulate.dataset.dataset_writer import encode_picture, encode_power
from simulate.engines.engine import ResponseSource
from simulate.generation.request import Request
from simulate.spectra.spectrum import picture


@dataclass(frozen=True)
class Part:
    """Responses of consecutive positions, and the contents of their files.

    Attributes:
        responses: complex element responses, with the receiver's errors; over a band if the request has one.
        pictures: content of the PNG file of each position.
        power: content of the TIFF file of each position, in dB; empty if the request asks for none.
    """

    responses: Complex[np.ndarray, "n elements *band"]
    pictures: list[bytes]
    power: list[bytes]


def make_part(request: Request, source: ResponseSource, start: int, size: int) -> Part:
    """Compute the responses to consecutive positions of a request, and make their pictures.

    Args:
        request: the dataset to make.
        source: computes the responses in the request's scene.
        start: index of the first position.
        size: number of positions; the last part may have fewer.

    Returns:
        The part.
    """
    positions = request.positions[start : start + size]
    numbers = np.arange(start, start + len(positions))
    ideal = source.responses(positions) if request.band is None else source.band_responses(positions, request.band)
    measured = request.measurement.apply(ideal, numbers, request.measurement_seed)
    responses = measured if request.band is None else measured[..., request.band.carrier]
    with ThreadPoolExecutor() as pool:
        pictures = list(pool.map(encode_picture, picture(request.beamformer.spectrum(responses))))
        power = list(pool.map(encode_power, request.beamformer.power_db(responses))) if request.power else []
    return Part(measured, pictures, power)
