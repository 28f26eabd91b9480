"""Splatting against the equations, looped pixel by pixel: the compiled renderer and the readable one alike."""

import math

import numba
import numpy as np
import pytest
import torch

from learn.models.splatting import splat as splat_module
from learn.models.splatting import splat_cpu as splat_cpu_module
from learn.models.splatting.splat_cpu import CUTOFF

NAMES = ("azimuth", "elevation", "depth", "scale", "rotation", "opacity", "coefficient")


@pytest.fixture(params=["compiled", "reference"])
def renderer(request, monkeypatch):
    """``splat`` as it is on a CPU, and with the reference renderer."""
    if request.param == "reference":
        monkeypatch.setattr(splat_cpu_module, "splat_cpu", splat_module.splat_reference)
    return request.param


def splat(azimuths, elevations, coefficient, **others):
    """``learn.models.splatting.splat.splat`` of complex numbers."""
    splats = splat_module.Splats(coefficient=torch.view_as_real(coefficient), **others)
    return torch.view_as_complex(splat_module.splat(splats, azimuths, elevations).contiguous())


def primitives(count, batch=2, seed=0, scales=(5, 40)):
    """Random attributes in float64."""
    generator = np.random.default_rng(seed)
    shape = (batch, count)
    attributes = {
        "azimuth": generator.uniform(0, 360, count),
        "elevation": generator.uniform(0, 90, count),
        "depth": generator.uniform(1, 50, count),
        "scale": generator.uniform(*scales, (*shape, 2)),
        "rotation": generator.uniform(0, math.pi, shape),
        "opacity": generator.uniform(0.05, 0.95, shape),
        "coefficient": generator.normal(size=shape) + 1j * generator.normal(size=shape),
    }
    return {name: torch.from_numpy(values) for name, values in attributes.items()}


def axis(start, stop, step):
    return torch.arange(start, stop, step, dtype=torch.float64)


def equations(azimuth, elevation, depth, scale, rotation, opacity, coefficient, azimuths, elevations):
    """The paper's equations, one pixel and one primitive at a time; azimuth the nearer way round."""
    field = np.zeros((len(opacity), len(elevations), len(azimuths)), complex)
    order = sorted(range(len(depth)), key=lambda i: depth[i])
    for sample in range(len(opacity)):
        precisions = []
        for i in order:
            cos, sin = math.cos(rotation[sample, i]), math.sin(rotation[sample, i])
            turn = np.array([[cos, -sin], [sin, cos]])
            precisions.append(np.linalg.inv(turn @ np.diag(scale[sample, i] ** 2) @ turn.T))
        for row, theta in enumerate(elevations):
            for column, phi in enumerate(azimuths):
                transmittance = 1.0
                for i, precision in zip(order, precisions, strict=True):
                    offset = np.array([(phi - azimuth[i] + 180) % 360 - 180, theta - elevation[i]])
                    alpha = opacity[sample, i] * math.exp(-0.5 * offset @ precision @ offset)
                    field[sample, row, column] += coefficient[sample, i] * alpha * transmittance
                    transmittance *= 1 - alpha
    return field


def assert_renders_the_equations(attributes, azimuths, elevations):
    found = splat(**attributes, azimuths=azimuths, elevations=elevations)
    expected = equations(*(attributes[name].numpy() for name in NAMES), azimuths.numpy(), elevations.numpy())
    most = attributes["coefficient"].abs().sum().item()
    assert np.abs(expected).max() > 0.01 * most  # there is something to see
    np.testing.assert_allclose(found.numpy(), expected, atol=(2 * CUTOFF + 1e-10) * most, rtol=0)


GRID = axis(0, 360, 10), axis(5, 90, 10)


def degrees(*values: float) -> torch.Tensor:
    return torch.tensor(values, dtype=torch.float64)


CASES = {
    "random": (15, {}, {}),
    "on top and on the horizon": (8, {}, {"elevation": degrees(*[0, 90] * 4)}),
    "on the seam": (8, {"scales": (10, 20)}, {"azimuth": degrees(0, 359.999, 0.001, 358, 2, 180, 0.5, 359.5)}),
    "far narrower than a pixel": (
        6,
        {"scales": (0.01, 0.1)},
        {"azimuth": degrees(0, 120, 350, 33, 44, 55), "elevation": degrees(5, 45, 85, 33, 44, 55)},
    ),
    "wider than the chart, two exactly 180° from a pixel": (
        6,
        {"scales": (100, 1000)},
        {"azimuth": degrees(0, 90, 11, 99, 200, 301)},
    ),
    "long and thin": (6, {}, {"scale": degrees(80, 2).expand(2, 6, 2)}),
    "almost invisible and almost opaque": (8, {}, {"opacity": degrees(*[1e-9, 1 - 1e-9, 1e-4, 1] * 2).expand(2, 8)}),
    "of equal depths, in the order given": (8, {}, {"depth": degrees(*[7, 3] * 4)}),
}


@pytest.mark.parametrize("case", CASES)
def test_primitives_render_as_the_equations_say(renderer, case):
    count, drawn, changed = CASES[case]
    assert_renders_the_equations(primitives(count, **drawn) | changed, *GRID)


def test_spectrum_grid_renders_as_the_equations_say(renderer):
    assert_renders_the_equations(primitives(6, batch=1, scales=(2, 10)), axis(0, 360, 1), axis(1, 91, 20))


@pytest.mark.parametrize(
    "azimuths",
    [
        axis(0, 180, 10),
        -axis(0, 360, 10),
        -axis(0, 90, 5),
        axis(0, 720, 40),
        axis(0, 70, 7),
        axis(0, 1, 1),
        axis(0, 36, 12),
    ],
    ids=["half a turn", "mirrored", "a mirrored quarter", "two turns", "no part of a turn", "one column", "a tenth"],
)
def test_columns_that_are_not_one_turn_render_as_the_equations_say(renderer, azimuths):
    assert_renders_the_equations(primitives(8), azimuths, GRID[1])


def test_transmitters_with_primitives_at_places_of_their_own_render_as_each_alone(renderer):
    attributes = primitives(12, batch=3)
    moved = attributes | {
        "azimuth": (attributes["azimuth"] + torch.tensor([[0.0], [40.0], [300.0]])) % 360,
        "elevation": (attributes["elevation"] * torch.tensor([[1.0], [0.5], [0.1]])),
    }
    found = splat(**moved, azimuths=GRID[0], elevations=GRID[1])
    for sample in range(3):
        alone = {name: x if name == "depth" else x[[sample]] for name, x in moved.items()}
        alone |= {name: moved[name][sample] for name in ("azimuth", "elevation")}
        torch.testing.assert_close(found[[sample]], splat(**alone, azimuths=GRID[0], elevations=GRID[1]))


def test_single_precision_is_nearly_as_good(renderer):
    """A model's own numbers, all of them and the result in float32."""
    attributes = primitives(50, scales=(2, 30))
    single = {name: x.to(torch.complex64 if x.is_complex() else torch.float32) for name, x in attributes.items()}
    found = splat(**single, azimuths=GRID[0].float(), elevations=GRID[1].float())
    expected = splat(**attributes, azimuths=GRID[0], elevations=GRID[1])
    assert found.dtype == torch.complex64
    assert (found - expected).abs().max() < 1e-4 * expected.abs().max()


LEARNED = tuple(name for name in NAMES if name != "depth")  # depth only orders


@pytest.mark.parametrize("azimuths", [axis(0, 360, 30), -axis(0, 180, 30)], ids=["a turn", "mirrored half"])
def test_gradients_are_those_of_finite_differences(renderer, azimuths):
    attributes = primitives(4, scales=(20, 60), seed=5)
    attributes["azimuth"][0] = 359.5

    def field(*learned):
        named = dict(zip(LEARNED, learned, strict=True))
        return splat(**named, depth=attributes["depth"], azimuths=azimuths, elevations=axis(3, 90, 30))

    inputs = [attributes[name].requires_grad_() for name in LEARNED]
    assert torch.autograd.gradcheck(field, inputs, eps=1e-6, atol=1e-5)


def gradients(attributes, seed=0):
    """Of a random weighting of the field's real and imaginary parts, on a 10° grid."""
    inputs = {name: x.clone().requires_grad_(name != "depth") for name, x in attributes.items()}
    field = splat(**inputs, azimuths=GRID[0], elevations=GRID[1])
    weights = torch.randn(field.shape, dtype=field.dtype, generator=torch.Generator().manual_seed(seed))
    return torch.autograd.grad((field * weights).real.sum(), [inputs[name] for name in LEARNED])


@pytest.mark.parametrize("own_places", [False, True])
@pytest.mark.parametrize("scales", [(0.05, 2), (5, 40), (100, 1000)])
def test_compiled_gradients_are_the_references(monkeypatch, scales, own_places):
    """Many primitives, and every extreme that finite differences cannot take: seam, ends, almost opaque."""
    attributes = primitives(60, scales=scales)
    attributes["azimuth"][:4] = torch.tensor([0.0, 359.999, 0.001, 180.0], dtype=torch.float64)
    attributes["elevation"][:2] = torch.tensor([0.0, 90.0], dtype=torch.float64)
    attributes["opacity"][:, :4] = torch.tensor([1e-6, 1 - 1e-6, 0.999, 0.5], dtype=torch.float64)
    for name in ("azimuth", "elevation") if own_places else ():
        attributes[name] = torch.stack([attributes[name], attributes[name].flip(0)])
    compiled = gradients(attributes)
    monkeypatch.setattr(splat_cpu_module, "splat_cpu", splat_module.splat_reference)
    for name, found, expected in zip(LEARNED, compiled, gradients(attributes), strict=True):
        most = expected.abs().max().item()
        torch.testing.assert_close(
            found, expected, atol=1e-6 * most, rtol=1e-6, msg=lambda text, n=name: f"{n}: {text}"
        )


def test_number_of_threads_changes_nothing():
    """Tasks add to sums of their own: no race, and a resumed run has the weights of an uninterrupted one."""
    attributes = primitives(30, batch=3)
    results = []
    for threads in (1, numba.config.NUMBA_NUM_THREADS):
        torch.set_num_threads(threads)
        numba.set_num_threads(threads)
        try:
            results.append([splat(**attributes, azimuths=GRID[0], elevations=GRID[1]), *gradients(attributes)])
        finally:
            torch.set_num_threads(1)
            numba.set_num_threads(1)
    for found, expected in zip(results[1], results[0], strict=True):
        torch.testing.assert_close(found, expected, atol=1e-12, rtol=1e-10)
