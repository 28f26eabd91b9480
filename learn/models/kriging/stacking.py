"""Stacking [wolpert1992]: weights of several predictions, chosen by how well these predict left-out known spectra.

Kriging and inverse-distance weighting can leave out a known spectrum at no cost, since neither has to be fitted again.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from learn.baselines.neighbours import NEIGHBOURS
from learn.data.metrics import ssim_of_each
from learn.models.geometry import distances
from learn.models.kriging.kriged_field import KrigedField
from simulate.spectra.angular_grid import COLUMNS, ROWS

QUARTERS = 4
"""Number of rounds in the choice of weights. Weights are multiples of one over this number."""

LEAST_GAIN = 0.003
"""A smaller gain in mean SSIM can be due to chance."""

LEAST_DISTANCE = 1e-9
"""Metres; weights do not grow nearer to a known position."""


def best_weights(
    predicted: Mapping[str, Float[np.ndarray, "L 90 360"]], truth: Float[np.ndarray, "L 90 360"]
) -> tuple[dict[str, float], float]:
    """Weights of predictions, and the mean SSIM of their weighted mean, by greedy selection [caruana2004].

    Each round adds the prediction that raises the mean SSIM of the mean most; the same one can be added again. Gains
    below ``LEAST_GAIN`` do not count: neither that of a mean over a single prediction, nor that of a prediction over an
    earlier one.

    >>> truth = np.tile(np.linspace(0, 1, 360), (1, 90, 1))
    >>> best_weights({"right": truth, "flat": np.zeros_like(truth)}, truth)
    ({'right': 1.0}, 1.0)
    """
    total, counts, score = np.zeros_like(truth), dict.fromkeys(predicted, 0), 0.0
    single, single_score = "", 0.0
    for taken in range(QUARTERS):
        mixed = {name: (total + spectra) / (taken + 1) for name, spectra in predicted.items()}
        scores = {name: float(ssim_of_each(spectra, truth).mean()) for name, spectra in mixed.items()}
        best = max(scores, key=lambda name: scores[name])
        total, score = total + predicted[best], scores[best]
        counts[best] += 1
        if taken == 0:
            single = next(name for name in predicted if scores[name] > score - LEAST_GAIN)
            single_score = scores[single]
    if score < single_score + LEAST_GAIN:
        return {single: 1.0}, single_score
    return {name: count / QUARTERS for name, count in counts.items() if count}, score


def by_distance(field: KrigedField, distance: Float[Tensor, "B n"]) -> Float[Tensor, "B 90 360"]:
    """Mean of the nearest known spectra, weighted by 1 / distance."""
    distance, near = distance.topk(min(NEIGHBOURS, distance.shape[1]), largest=False)
    weights = 1 / distance.clamp_min(LEAST_DISTANCE)
    weights = weights / weights.sum(dim=1, keepdim=True)
    return (weights[..., None, None] * field.known_spectra(near)).sum(dim=1)


def left_out_by_distance(field: KrigedField, left_out: Int[np.ndarray, " L"]) -> Float[np.ndarray, "L 90 360"]:
    """Some known spectra, each predicted by inverse-distance weighting of the others."""
    index = torch.from_numpy(left_out)
    distance = distances(field.places[index], field.places)
    distance[torch.arange(len(index)), index] = torch.inf
    with torch.inference_mode():
        return by_distance(field, distance).numpy()


def left_out_by_kriging(field: KrigedField, left_out: Int[np.ndarray, " L"]) -> Float[np.ndarray, "L 90 360"]:
    """Some known spectra, each predicted by kriging from the others."""
    predicted = np.zeros((len(left_out), ROWS, COLUMNS), np.float32)
    for row, index in enumerate(left_out):
        with torch.inference_mode():
            predicted[row] = field(field.places[[index]], torch.tensor([index])).numpy()[0]
    return predicted
