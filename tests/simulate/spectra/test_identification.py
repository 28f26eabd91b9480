"""Which array and grid a folder's pictures were made with: stated, found, or assumed."""

import numpy as np
import pytest

from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import identify
from simulate.spectra.spectrum import picture
from tests.simulate.spectra.random_spectra import random_spectra


def pictures_of(beamformer: Beamformer, count: int = 6) -> np.ndarray:
    return picture(random_spectra(beamformer, count))


GRIDS = [AngularGrid(0.0), AngularGrid(1.0), AngularGrid(89.0, -1.0)]
SHAPES = [(1, 4), (3, 4), (2, 2)]  # elements that explain nothing are left out
TRUTHS = [
    *(Beamformer(PlanarArray(spacing=0.47), grid) for grid in GRIDS),
    *(Beamformer(PlanarArray(*shape, 0.48)) for shape in SHAPES),
]


@pytest.mark.parametrize("truth", TRUTHS)
def test_array_and_grid_are_found(truth):
    found = identify(pictures_of(truth))
    assert found.source == "fitted" and found.beamformer == truth
    assert found.residual < 0.4


def test_what_metadata_states_is_taken_and_its_residual_told():
    made_with, stated = Beamformer(), Beamformer(PlanarArray(spacing=0.4))
    found = identify(pictures_of(made_with), stated.array, stated.grid)
    assert found.source == "metadata" and found.beamformer == stated and found.residual > 3


def test_pictures_of_no_array_are_assumed_to_be_nerf2s():
    noise = np.random.default_rng(0).integers(0, 256, (4, 90, 360), dtype=np.uint8)
    found = identify(noise)
    assert found.source == "assumed" and found.beamformer == Beamformer() and found.residual > 3
    # A spectrum without any direction is explained by every array on every grid.
    assert identify(np.full((3, 90, 360), 255, np.uint8)).source == "assumed"


@pytest.mark.parametrize("levels", [2, 17])
def test_pictures_of_few_levels_show_no_array(levels):
    """8 bits stored in 16 leave two levels, and 12 bits leave 17. Every array explains them to a grey level."""
    dark = (pictures_of(Beamformer()) // (256 / (levels - 1))).astype(np.uint8)
    found = identify(dark)
    assert found.source == found.grid_source == "assumed" and found.residual is None


def test_black_pictures_among_others_are_not_examined():
    pictures = np.concatenate([np.zeros((60, 90, 360), np.uint8), pictures_of(Beamformer(), 3)])
    assert identify(pictures).source == "fitted"


def test_what_is_stated_is_taken_and_the_rest_is_found():
    truth = Beamformer(PlanarArray(2, 5, 0.46), AngularGrid(1.0))
    found = identify(pictures_of(truth), array=truth.array)
    assert (found.source, found.grid_source, found.beamformer) == ("metadata", "fitted", truth)
    truth = Beamformer(PlanarArray(spacing=0.46), AngularGrid(10.0, 0.75))
    found = identify(pictures_of(truth), grid=truth.grid)
    assert (found.source, found.grid_source, found.beamformer) == ("fitted", "metadata", truth)
