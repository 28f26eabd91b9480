"""Positional encoding γ against the paper's formula."""

import math

import torch

from learn.models.encoding import DIRECTIONS, TX_ORDER, TransmitterEncoding, positional_encoding


def test_encoding_is_the_papers_formula_at_any_order():
    generator = torch.Generator().manual_seed(0)
    points = 2 * torch.rand(2, 5, 3, dtype=torch.float64, generator=generator) - 1
    found = positional_encoding(points, order=6)
    for index in torch.cartesian_prod(torch.arange(2), torch.arange(5)).tolist():
        t = points[tuple(index)].tolist()
        sines = [math.sin(2**k * math.pi * value) for k in range(6) for value in t]
        cosines = [math.cos(2**k * math.pi * value) for k in range(6) for value in t]
        torch.testing.assert_close(found[tuple(index)], torch.tensor([*t, *sines, *cosines], dtype=torch.float64))


REGION, WAVELENGTH = torch.tensor([[1.0, 2.0, 0.5], [2.0, 2.8, 1.1]]), torch.tensor(0.33)


def test_octaves_are_those_of_the_position_in_its_box():
    encoding = TransmitterEncoding("octaves")
    corners = encoding(REGION, REGION, WAVELENGTH)
    torch.testing.assert_close(corners, positional_encoding(torch.tensor([[-1.0] * 3, [1.0] * 3]), TX_ORDER))
    assert corners.shape[1] == encoding.size == 39


def test_waves_are_linear_in_the_field_of_a_far_source():
    """e^{-jk|r − q|} of a source a metre beside the box is a sum of the encoding's waves, to a hundredth."""
    encoding = TransmitterEncoding("waves")
    places = REGION[0] + torch.rand(900, 3, generator=torch.Generator().manual_seed(0)) * (REGION[1] - REGION[0])
    waves = encoding(places, REGION, WAVELENGTH).double()
    assert waves.shape[1] == encoding.size == 2 * DIRECTIONS
    distance = torch.linalg.vector_norm(places - torch.tensor([3.0, 2.4, 0.8]), dim=1).double()
    field = torch.cos(2 * torch.pi * distance / WAVELENGTH) / distance
    known, new = slice(0, 700), slice(700, 900)
    weights = torch.linalg.lstsq(waves[known], field[known, None], rcond=1e-7, driver="gelsd").solution
    error = (waves[new] @ weights)[:, 0] - field[new]
    assert error.norm() / field[new].norm() < 0.01
    octaves = TransmitterEncoding("octaves")(places, REGION, WAVELENGTH).double()
    weights = torch.linalg.lstsq(octaves[known], field[known, None]).solution
    assert ((octaves[new] @ weights)[:, 0] - field[new]).norm() / field[new].norm() > 0.5
