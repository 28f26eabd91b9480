"""Which array and grid a folder's pictures were made with: stated, found, or assumed."""

import numpy as np
import pytest

from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import METADATA_GRID, beamformer_of, identify, larger_array
from simulate.spectra.spectrum import picture


def pictures_of(beamformer: Beamformer, count: int = 6) -> np.ndarray:
    responses = np.random.default_rng(0).standard_normal((count, beamformer.array.elements, 2)) @ [1, 1j]
    return picture(beamformer.spectrum(responses))


@pytest.mark.parametrize("grid", [AngularGrid(0.0), AngularGrid(1.0), AngularGrid(89.0, -1.0)])
def test_array_and_grid_are_found(grid):
    truth = Beamformer(PlanarArray(spacing=0.47), grid)
    found = identify(pictures_of(truth), None)
    assert found.source == "fitted" and found.beamformer == truth
    assert found.residual < 0.4


def test_what_metadata_states_is_taken_and_its_residual_told():
    made_with, stated = Beamformer(), Beamformer(PlanarArray(spacing=0.4))
    found = identify(pictures_of(made_with), stated)
    assert found.source == "metadata" and found.beamformer == stated and found.residual > 3


def test_pictures_of_no_array_are_assumed_to_be_nerf2s():
    noise = np.random.default_rng(0).integers(0, 256, (4, 90, 360), dtype=np.uint8)
    found = identify(noise, None)
    assert found.source == "assumed" and found.beamformer == Beamformer() and found.residual > 3


def test_grids_that_explain_pictures_equally_well_are_not_told_apart():
    """A spectrum without any direction is explained by every array on every grid."""
    assert identify(np.full((3, 90, 360), 255, np.uint8), None).source == "assumed"


def test_the_array_of_a_larger_gateway_is_suggested():
    truth = Beamformer(PlanarArray(5, 5, 0.5))
    pictures = pictures_of(truth)
    assert identify(pictures, None).source == "assumed"
    assert larger_array(pictures).beamformer == truth


def test_metadata_of_version_01_means_rows_from_1_degree():
    assert beamformer_of({"array": {"spacing": 0.45}}) == Beamformer(PlanarArray(spacing=0.45), METADATA_GRID)
    assert beamformer_of({"scene": "lab"}) is None
