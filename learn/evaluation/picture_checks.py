"""What is doubtful about the pictures of a dataset: another array, another quantity, few levels, other azimuths."""

from __future__ import annotations

import json
from dataclasses import asdict

import numpy as np

from simulate.dataset.bearings import bearing_of
from simulate.dataset.dataset import Dataset
from simulate.exchange.foreign_pictures import DARK
from simulate.spectra.array import too_few_elements
from simulate.spectra.element_array import uniform
from simulate.spectra.explanation import Explanation, explain
from simulate.spectra.identification import DOUBTFUL, EXPLAINED, LEAST_LEVELS, level_count
from simulate.spectra.lags import EXAMINED
from simulate.spectra.phase_retrieval import GOOD, retrieve_responses
from simulate.spectra.spectrum import evenly, spectrum_of

RETRIEVED = 4  # Number of pictures whose responses are found, to compare their magnitudes

MOST_RETRIEVED = 36  # Elements above which this would take too long

EQUAL = 0.005
"""Standard deviation of the magnitudes over the elements, relative to their mean, up to which they are equal. Rounding
to 8 bits makes phases alone differ by 0.001."""


def picture_doubts(dataset: Dataset) -> list[str]:
    """Sentences on what is doubtful about the pictures of a dataset."""
    few = too_few_elements(dataset.array)
    if few is not None:
        return [f"{few}, so they are not scored"]
    found = _of_array(dataset) + _of_azimuths(dataset)
    return found if "response" in dataset.values else _of_levels(dataset) + found + _of_magnitudes(dataset)


def _of_azimuths(dataset: Dataset) -> list[str]:
    """A sentence if the maxima would point at the transmitters if the azimuths were others, or have grating lobes."""
    bearing = bearing_of(dataset)
    doubt = bearing.doubt(dataset.grid)
    if doubt is None or "scene_file" in dataset.metadata:
        return []
    if "response" not in dataset.values or bearing.grating is not None:
        return [doubt]
    of_responses = "have the responses in channels.npz phases of the other sign, or another order of elements?"
    return [f"{doubt.partition(':')[0]}; {of_responses}"]


def _of_levels(dataset: Dataset) -> list[str]:
    """Sentences if the pictures have too few grey levels to show anything."""
    examined = evenly(np.arange(len(dataset.pictures)), EXAMINED)
    levels = [level_count(dataset.pictures[index]) for index in examined]
    few = sum(1 < each < LEAST_LEVELS for each in levels)
    found = []
    if few:
        found.append(
            f"{few} of {len(levels)} pictures that were examined have fewer than {LEAST_LEVELS} different grey levels, "
            "too few to show which array measured them"
        )
    flat = int((np.ptp(dataset.pictures.reshape(len(dataset.pictures), -1), axis=1) == 0).sum())
    if flat:
        found.append(f"{flat} of {len(dataset.pictures)} pictures have one grey level and show no direction")
    largest = int(dataset.pictures.max(initial=0))
    if 0 < largest < DARK:
        found.append(f"no picture is brighter than level {largest} of 255; bisplat dataset scales them")
    return found


def _of_array(dataset: Dataset) -> list[str]:
    """A sentence if the array and the grid do not explain the pictures, with what does."""
    known = dataset.identification
    array, residual, stated = known.beamformer.array, known.residual, known.source == "metadata"
    if residual is None or residual < DOUBTFUL:
        return []
    left = f"{residual:.1f} grey levels (rounding alone: 0.3)"
    if stated:
        sentence = (
            f"metadata.json states {array.in_words.replace('λ', 'wavelengths')}, rows "
            f"from {dataset.grid.elevation_first_deg:g}°, but the pictures differ from what this array can measure by "
            f"{left}"
        )
    else:
        sentence = f"no 4 × 4 array can have measured these pictures as magnitudes: the best one leaves {left}"
    grid = dataset.grid if known.grid_source == "metadata" else None
    found = explain(dataset.pictures, array if stated else None, grid)
    if found is not None:
        return [f"{sentence}. {_explained(found)}"]
    return [sentence if stated else f"{sentence}; models that predict element responses assume a 4 × 4 array"]


def _explained(found: Explanation) -> str:
    """A sentence on what explains the pictures, and on what to do."""
    array, grid = found.beamformer.array, found.beamformer.grid
    what = {"magnitude": "magnitudes", "power": "powers", "decibels": "powers in decibels"}[found.scale]
    sentence = (
        f"{what.capitalize()} of an array of {array.in_words.replace('λ', 'wavelengths')} "
        f"explain them to {found.residual:.2f}"
    )
    if found.scale != "magnitude" or grid.elevation_step_deg < 0:
        return f"{sentence}: bisplat dataset turns them into pictures of this format"
    content = json.dumps({"array": array.stated(), "grid": asdict(grid)})
    return f"{sentence}: bisplat dataset states it in metadata.json, or write {content} there"


def _of_magnitudes(dataset: Dataset) -> list[str]:
    """A sentence if the responses behind the pictures have phases but no magnitudes."""
    array, residual = dataset.array, dataset.identification.residual
    if residual is None or residual >= EXPLAINED or array.is_line or uniform(array) is None:
        return []
    if array.elements > MOST_RETRIEVED:
        return []
    chosen = evenly(np.arange(len(dataset.pictures)), RETRIEVED)
    found = retrieve_responses(spectrum_of(dataset.pictures[chosen]), dataset.beamformer)
    magnitude = np.abs(found.responses[found.residual < GOOD])
    if not len(magnitude) or np.median(magnitude.std(axis=1) / magnitude.mean(axis=1)) > EQUAL:
        return []
    return [
        "the responses behind the pictures have the same magnitude at all elements: the pictures were made from phases "
        "only, as NeRF²'s generator and WideGS make them, or each shows one far source"
    ]
