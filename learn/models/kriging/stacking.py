"""Stacking [wolpert1992]: weights of several interpolators, chosen by how well these predict left-out known spectra."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor
from torch.nn.functional import embedding_bag

from learn.data.metrics import ssim_of_each
from learn.data.neighbours import NEIGHBOURS
from learn.models.base import Report, SpectrumModel
from learn.models.kriging.interpolators import OF_RESPONSES, WAYS, FieldFits, kriging_ways
from learn.models.kriging.kriged_field import KrigedField
from learn.models.kriging.wave_covariance import distances
from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.spectrum import evenly, spectrum_of

QUARTERS = 4  # number of rounds in the choice of weights. Weights are multiples of one over this number.
LEAST_GAIN = 0.003  # a smaller gain in mean SSIM can be due to chance
LEAST_DISTANCE = 1e-9  # metres; weights do not grow nearer to a known position


def best_weights(
    predicted: Mapping[str, Float[np.ndarray, "L 90 360"]], truth: Float[np.ndarray, "L 90 360"]
) -> tuple[dict[str, float], float]:
    """Weights of predictions, and the mean SSIM of their weighted mean, by greedy selection [caruana2004].

    Each round adds the prediction that raises the mean SSIM of the mean most; the same one can be added again. A gain
    below ``LEAST_GAIN`` does not count, of a mean over a single prediction or of a prediction over an earlier one.
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


def by_distance(
    field: KrigedField, distance: Float[Tensor, "B n"], known: Float[Tensor, "n 90 360"] | None = None
) -> Float[Tensor, "B 90 360"]:
    """Mean of the nearest known spectra, weighted by 1 / distance; quickly, if all known spectra are given."""
    distance, near = distance.topk(min(NEIGHBOURS, distance.shape[1]), largest=False)
    weights = 1 / distance.clamp_min(LEAST_DISTANCE)
    weights = weights / weights.sum(dim=1, keepdim=True)
    if known is None:
        return (weights[..., None, None] * field.known_spectra(near)).sum(dim=1)
    return embedding_bag(near, known.flatten(1), per_sample_weights=weights, mode="sum").unflatten(1, (ROWS, COLUMNS))


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


LEFT_OUT = 64  # largest number of known spectra, evenly spread, that each way of interpolation predicts from the others

FOLDS, FOLDED = 8, 300
"""If few spectra are known, a covariance fitted to all of them predicts them too well. A way that is even then worse
than inverse-distance weighting is dropped. For each other way, the known spectra are divided into parts, and the
covariance is fitted once without each part, which it then predicts. There are FOLDED // n parts for n known samples (of
the field that all elements sample: elements times known spectra), at most FOLDS; if these are fewer than 2, the
covariance is not fitted again."""

CLEAR_LEAD = 0.04
"""If the mean SSIM of one of ``OF_RESPONSES`` exceeds that of inverse-distance weighting by more, no further way is
tried."""


class Mixture(NamedTuple):
    """What is mixed, and why."""

    weights: dict[str, float]  # of the ways that are mixed; they add up to 1
    fields: dict[str, KrigedField]  # the fitted fields of all ways of kriging that were tried
    scores: dict[str, float]  # mean SSIM of known spectra that each way predicts from the others
    score: float  # that of the mixture

    def __str__(self) -> str:
        ordered = sorted(self.weights.items(), key=lambda item: -item[1])
        parts = [f"{weight:.0%} {WAYS[way]}" for way, weight in ordered]
        found = ", ".join(f"{way} {value:.3f}" for way, value in self.scores.items())
        together = f"; together {self.score:.3f}" if len(parts) > 1 else ""
        return (
            f"interpolates by {' and '.join(parts)} (mean SSIM of known spectra predicted from the others: {found}"
            f"{together})"
        )


def best_mixture(fits: FieldFits, known: Int[np.ndarray, " n"], report: Report) -> Mixture:
    """Fit each way of kriging, and find the weights with which known spectra are best predicted from the others."""
    dataset = fits.dataset
    left_out = evenly(np.arange(len(known)), LEFT_OUT)
    truth = spectrum_of(dataset.pictures[known[left_out]])
    fields: dict[str, KrigedField] = {}
    predicted: dict[str, Float[np.ndarray, "L 90 360"]] = {}
    scores: dict[str, float] = {}
    for way in kriging_ways(dataset, known):
        best = max((scores[each] for each in OF_RESPONSES if each in scores), default=0.0)
        if best > scores.get("inverse-distance", 1) + CLEAR_LEAD:
            break
        field = fields[way] = fits.fitted(way, known, report, fields.get("spectra"))
        if not predicted:
            predicted["inverse-distance"] = left_out_by_distance(field, left_out)
            scores["inverse-distance"] = float(ssim_of_each(predicted["inverse-distance"], truth).mean())
        samples = len(known) * (dataset.array.elements if way == "field" else 1)
        folds = min(FOLDS, FOLDED // samples)
        if way == "phases":  # the other spectra's phases were found using the left-out ones
            predicted[way] = _of_folds(way, fits, known, left_out, max(1, folds), report)
        elif folds > 1:
            scores[way] = float(ssim_of_each(left_out_by_kriging(field, left_out), truth).mean())
            if scores[way] < scores["inverse-distance"]:
                continue
            predicted[way] = _of_folds(way, fits, known, left_out, folds, report)
        else:
            predicted[way] = left_out_by_kriging(field, left_out)
        scores[way] = float(ssim_of_each(predicted[way], truth).mean())
    report("weights", 0, 1)
    weights, score = best_weights({way: predicted[way] for way in WAYS if way in predicted}, truth)
    return Mixture(weights, fields, scores, score)


def _of_folds(
    way: str, fits: FieldFits, known: Int[np.ndarray, " n"], left_out: Int[np.ndarray, " L"], folds: int, report: Report
) -> Float[np.ndarray, "L 90 360"]:
    """Some known spectra, in parts, each predicted from others by a covariance that was fitted without the part.

    The phases of others were found without it, too, so that only these predict it.
    """
    predicted = np.zeros((len(left_out), ROWS, COLUMNS), np.float32)
    for fold in range(folds):
        report(f"score by {way}", fold, folds)
        part = left_out % folds == fold
        of_part = np.arange(len(known)) % folds == fold if folds > 1 else np.isin(np.arange(len(known)), left_out)
        field = fits.fitted(way, known[~of_part], SpectrumModel.report)
        if way == "phases":
            places = torch.from_numpy(fits.dataset.positions[known[left_out[part]]]).float()
            with torch.inference_mode():
                predicted[part] = field(places).numpy()
        else:
            field.keep(fits.dataset, known)
            predicted[part] = left_out_by_kriging(field, left_out[part])
    return predicted
