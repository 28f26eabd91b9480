"""A part of a dataset: the responses and pictures of consecutive positions, with the same bytes on every machine."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import cast

import numpy as np
from jaxtyping import Complex, Float, Int

from simulate.dataset.dataset_writer import encode_picture, encode_power
from simulate.engines.engine import BandSource, ResponseSource
from simulate.generation.request import Request
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import array_of
from simulate.spectra.spectrum import picture


@dataclass(frozen=True)
class Part:
    """Responses of consecutive positions, and the contents of their files."""

    # complex element responses, with the receiver's errors; over a band if the request has one
    responses: Complex[np.ndarray, "n elements *band"]
    pictures: list[bytes]  # content of the PNG file of each position
    power: list[bytes]  # content of the TIFF file of each position, in dB; empty if the request asks for none


def make_part(request: Request, sources: Sequence[ResponseSource], start: int, size: int) -> Part:
    """Compute the responses of consecutive spectra of a request, and make their pictures."""
    numbers = np.arange(start, min(start + size, len(request)))
    of_frequency, of_position = np.divmod(numbers, len(request.positions))
    parts = [
        _part_of_one_frequency(request, sources[which], which, numbers[chosen], request.places[of_position[chosen]])
        for which in np.unique(of_frequency).tolist()
        for chosen in [of_frequency == which]
    ]
    return Part(
        np.concatenate([part.responses for part in parts]),
        [picture for part in parts for picture in part.pictures],
        [power for part in parts for power in part.power],
    )


def _part_of_one_frequency(
    request: Request,
    source: ResponseSource,
    which: int,
    numbers: Int[np.ndarray, " n"],
    places: Float[np.ndarray, "n coordinates"],
) -> Part:
    if request.band is None:
        ideal = source.responses(places)
    else:
        ideal = cast(BandSource, source).band_responses(places, request.band)
    measured = request.measurement.apply(ideal, numbers, request.measurement_seed)
    responses = measured if request.band is None else measured[..., request.band.carrier]
    beamformer = Beamformer(array_of(request.scenes[which].gateway, request.scenes[which].frequency), request.grid)
    with ThreadPoolExecutor() as pool:
        pictures = list(pool.map(encode_picture, picture(beamformer.spectrum(responses))))
        power = list(pool.map(encode_power, beamformer.power_db(responses))) if request.power else []
    return Part(measured, pictures, power)
