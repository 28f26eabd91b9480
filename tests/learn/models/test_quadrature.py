"""A few pixels stand for all of a picture: their weights, and what models and losses make of them."""

import numpy as np
import pytest
import torch

from learn.data.metrics import ssim
from learn.models.quadrature import coarse_loss, composite_loss, interpolation, picture_pixels, quadrature
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import ElementArray


@pytest.mark.parametrize(
    "beamformer",
    [
        Beamformer(),
        Beamformer(PlanarArray(4, 4, 0.491), AngularGrid(1.0)),
        Beamformer(PlanarArray(1, 3)),
        Beamformer(PlanarArray(8, 8)),
        Beamformer(ElementArray(np.random.default_rng(3).uniform(-0.06, 0.06, (12, 3)), 2.4e9)),
        Beamformer(ElementArray.circle(8, 0.06).at(2.4e9)),
    ],
)
def test_mean_of_squared_differences_of_powers_is_exact(beamformer):
    generator, count = np.random.default_rng(0), beamformer.array.elements
    responses = generator.standard_normal((2, 5, count, 2)) @ [1, 1j]
    powers = beamformer.spectrum(responses[0]) ** 2, beamformer.spectrum(responses[1]) ** 2
    difference, few = (powers[0] - powers[1]) ** 2, quadrature(beamformer)
    found = difference[:, few.rows][:, :, few.columns].mean(axis=2) @ few.weights
    np.testing.assert_allclose(found, difference.mean(axis=(1, 2)), rtol=1e-6)
    assert few.weights.sum() == pytest.approx(1) and few.weights.min() > 0.8 * few.weights.mean()


def test_more_elements_need_more_pixels_and_one_needs_a_single_one():
    sizes = [len(quadrature(Beamformer(PlanarArray(size, size)))) for size in (1, 2, 4, 8)]
    assert sizes == sorted(sizes) and sizes[0] == 1 and sizes[2] == 18 * 45


def test_loss_at_a_few_pixels_is_near_that_at_all():
    """Of two spectra of an array; the SSIM of the coarser picture is another, so the loss is only about the same."""
    generator, few = np.random.default_rng(1), quadrature(Beamformer())
    responses = generator.standard_normal((2, 4, 16, 2)) @ [1, 1j]
    powers = Beamformer().spectrum(responses)
    spectra = torch.from_numpy(powers / powers.max(axis=(2, 3), keepdims=True)).float()
    coarse = spectra[:, :, few.rows][:, :, :, few.columns]
    assert coarse_loss(coarse[0], coarse[0], few) == pytest.approx(0, abs=1e-6)
    ratio = coarse_loss(coarse[0], coarse[1], few) / composite_loss(spectra[0], spectra[1])
    assert 0.8 < ratio < 1.25


def test_columns_that_are_no_full_turn_are_all_looked_at():
    half = AngularGrid(0.0, 1.0, 0.5)
    assert len(quadrature(Beamformer(grid=half)).columns) == 360


@pytest.mark.parametrize("size", [(4, 4), (8, 8), (1, 4), (2, 2), (8, 1)])
def test_spectra_are_interpolated_from_a_few_pixels(size):
    beamformer = Beamformer(PlanarArray(*size))
    responses = np.random.default_rng(2).standard_normal((5, size[0] * size[1], 2)) @ [1, 1j]
    spectra = beamformer.spectrum(responses)
    spectra /= spectra.max(axis=(1, 2), keepdims=True)
    few = picture_pixels(beamformer)
    rows, columns = interpolation(few)
    found = rows @ spectra[:, few.rows][:, :, few.columns] @ columns.T
    np.testing.assert_allclose(found[:, few.rows][:, :, few.columns], spectra[:, few.rows][:, :, few.columns])
    assert ssim(found.clip(0, 1), spectra).min() > 0.98
