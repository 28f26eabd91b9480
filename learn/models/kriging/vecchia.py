"""Vecchia's likelihood of the known spectra, and the covariance that maximises it [vecchia1988]."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import Any

import numpy as np
import torch
from scipy.optimize import minimize
from threadpoolctl import threadpool_limits

from learn.models.kriging.wave_covariance import distances
from simulate.spectra.spectrum import evenly

FITTED_ON = 200  # largest number of terms of the likelihood, evenly spread over the known positions in random order

FAR = 1e6
"""Metres. In the likelihood, a known position with too few predecessors gets additional neighbours at multiples of this
distance. Their covariance with everything is zero."""

EVENNESS = 0.03
"""Weight of the penalty −mean(log s_j), which is added to the negative mean log-likelihood. With it, directions that
the spectra do not determine keep equal shares."""

ITERATIONS = 60  # largest number of iterations of the likelihood's optimiser
DRIFT_MOST = 1e9  # upper bound of the drift T, in spectra; a larger T would not change any prediction

NUGGET_LEAST = 1e-6
"""Lower bound of the nugget ν, relative to the variance; it keeps the covariance of two spectra at one position
invertible."""


@threadpool_limits.wrap(1)  # with such small matrices, several threads would mostly wait for each other
def fit_covariance(field: Any, neighbours_most: int, report: Callable[[int, int], None] = lambda *_: None) -> None:
    """Set the s, ℓ, T and ν of a ``KrigedField`` to those that maximise Vecchia's likelihood of its known spectra."""
    report(0, ITERATIONS)
    iteration = count(1)
    # Vecchia's likelihood: the known positions are put into a random order, and each is predicted from the nearest
    # of its predecessors. The first ones thus determine the covariance at large distances, the last ones at small
    # distances. The variance is profiled out.
    order = torch.randperm(len(field.places), generator=torch.Generator().manual_seed(0))
    rank = torch.from_numpy(evenly(np.arange(1, len(order)), FITTED_ON))
    predicted = order[rank]
    distance = distances(field.places[predicted], field.places[order])
    distance[torch.arange(len(order)) >= rank[:, None]] = torch.inf
    distance, neighbours = distance.topk(min(neighbours_most, len(order) - 1), largest=False)
    neighbours = order[neighbours]
    # Of each term: the predicted position, and then its neighbours.
    members = torch.cat([predicted[:, None], neighbours], dim=1)
    places, times = field.places[members].double(), field.times[members][..., None].double()
    stand_ins = FAR * torch.arange(1, neighbours.shape[1] + 1).double()[None, :, None]
    places[:, 1:] = torch.where(distance.isinf()[..., None], stand_ins, places[:, 1:])
    separations, times_between = field.separations(places, places), distances(times, times)
    products = torch.stack([field.products(each) for each in members])

    if not products.any():
        return  # all spectra are the same

    def cost(parameters: np.ndarray) -> tuple[float, np.ndarray]:
        unconstrained = torch.from_numpy(parameters).requires_grad_()
        shares, (length, drift, nugget) = unconstrained[:-3].softmax(dim=0), unconstrained[-3:].exp()
        real, imaginary = field.kappa(separations, field.fading(times_between, drift), shares, length)
        kappa = real if imaginary is None else torch.complex(real, imaginary)
        covariance = kappa[:, 1:, 1:] + nugget * torch.eye(neighbours.shape[1])
        cross_covariance = kappa[:, 1:, :1]
        weights = torch.cholesky_solve(cross_covariance, torch.linalg.cholesky(covariance))
        residual = torch.cat([torch.ones_like(weights[:, :1]), -weights], dim=1)
        squared_error = (residual.mH @ products @ residual).real.squeeze(dim=(1, 2))
        variance = 1 + nugget - (weights.conj() * cross_covariance).real.sum(dim=(1, 2))
        negative_log_likelihood = (squared_error / variance).mean().log() + variance.log().mean()
        objective = negative_log_likelihood - EVENNESS * shares.log().mean()
        (gradient,) = torch.autograd.grad(objective, unconstrained)
        return float(objective.detach()), gradient.numpy()

    start = np.append(np.zeros(len(field.shares)), np.log([field.first_length, 100 * len(order), 0.1]))
    bounds = [(-10.0, 10.0)] * len(field.shares)
    bounds += [tuple(start[-3] + np.log([0.001, 10.0])), (0.0, np.log(DRIFT_MOST)), (np.log(NUGGET_LEAST), 0.0)]
    minimum = minimize(
        cost,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=bounds,
        callback=lambda _: report(next(iteration), ITERATIONS),
        options={"maxiter": ITERATIONS},
    )
    field.shares = torch.from_numpy(minimum.x[:-3]).softmax(dim=0).float()
    field.length, field.drift, field.nugget = torch.from_numpy(np.exp(minimum.x[-3:])).float()
