"""The paper's models against its text."""

import numpy as np
import pytest
import torch
from scipy.stats import kstest

from learn.data.metrics import ssim
from learn.models.networks.bisplat import SCALE_MAX, SCALE_MIN, BiSplatWRF, Primitives
from learn.models.quadrature import composite_loss
from learn.training.registry import MODELS
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import normalise

POSITIONS = torch.tensor([[0.5, 0.0, 1.0], [3.0, -0.7, 2.2]])


WAVELENGTH = 0.33


@pytest.fixture
def make(small, region):
    """Function: a small BiSplatWRF, with the same weights at every call."""

    def build(bypass=(), size=small):
        torch.manual_seed(0)
        return BiSplatWRF(region, Beamformer(), WAVELENGTH, **size, bypass=bypass)

    return build


def ffn(inputs, outputs, width, layers):
    """Into the width, then per layer a norm (gain, bias) and a square matrix with bias, then out."""
    return (inputs + 1) * width + layers * (2 * width + (width + 1) * width) + (width + 1) * outputs


def papers_count(width, layers, count, encoder_layers, encoder_width, encoder_ffn):
    primitives = count * (3 + 2 + 1 + 1)  # (φ, θ, d), (s_x, s_y), ρ, o
    static = ffn(51, 2, width, layers)  # GS-PE -> amplitude, phase
    dynamic = ffn(encoder_width, 2, width, layers)  # global features -> amplitude, phase
    delta = ffn(51 + 39 + encoder_width, 4, width, layers)  # both encodings, global features -> ρ, s_x, s_y, o
    project = (51 + 39 + 1) * encoder_width
    attention = 4 * (encoder_width + 1) * encoder_width  # queries, keys, values, output
    own_ffn = (encoder_width + 1) * encoder_ffn + (encoder_ffn + 1) * encoder_width
    transformer = encoder_layers * (attention + own_ffn + 2 * 2 * encoder_width)  # two norms
    return {
        "primitives": primitives,
        "static": static,
        "dynamic": dynamic,
        "delta": delta,
        "bst": project + transformer,
    }


def counts(model):
    parts = {name: sum(p.numel() for p in part.parameters()) for name, part in model.named_children()}
    return {name: count for name, count in parts.items() if count}


def test_bisplat_has_the_parameters_of_the_papers_widths(region):
    # 500 primitives, FFNs of 4 layers and width 128, transformer of 3 layers; its own FFNs' width is left open: 256
    expected = papers_count(128, 4, 500, 3, 128, 256)
    assert counts(BiSplatWRF(region, Beamformer(), WAVELENGTH)) == expected
    assert expected["static"] == 51 * 128 + 128 + 4 * (128 + 128 + 128 * 128 + 128) + 128 * 2 + 2 == 73986


def test_bisplat_plus_has_the_parameters_of_the_papers_widths(region):
    # 2000 primitives, FFNs of 12 layers and width 256, transformer of 6 layers with internal FFNs of width 512
    expected = papers_count(256, 12, 2000, 6, 256, 512)
    assert counts(BiSplatWRF(region, Beamformer(), WAVELENGTH, **MODELS["bisplat-plus"].options)) == expected
    assert expected["bst"] == 91 * 256 + 6 * (4 * 257 * 256 + 257 * 512 + 513 * 256 + 4 * 256) == 3185920


@pytest.fixture(scope="module")
def fresh():
    torch.manual_seed(0)
    return Primitives(2000).requires_grad_(False).double()


def assert_uniform(values, low, high):
    assert values.min() >= low - 1e-5 * (high - low) and values.max() <= high + 1e-5 * (high - low)
    assert kstest(values, "uniform", (low, high - low)).pvalue > 0.01


def test_thirty_per_cent_are_coarse(fresh):
    assert fresh.coarse.numpy().sum() == 600
    assert Primitives(40).coarse.sum() == 12


def test_coarse_depths_are_uniform_from_20_to_50_and_fine_ones_from_1_to_20(fresh):
    assert_uniform(fresh.depth.numpy()[fresh.coarse.numpy()], 20, 50)
    assert_uniform(fresh.depth.numpy()[~fresh.coarse.numpy()], 1, 20)


def test_angles_are_uniform(fresh):
    assert_uniform(fresh.azimuth.numpy(), 0, 360)
    assert_uniform(fresh.elevation.numpy(), 0, 90)
    assert_uniform(fresh.rotation.numpy(), 0, np.pi)


def test_a_step_of_the_optimiser_moves_azimuths_about_as_far_as_elevations():
    torch.manual_seed(0)
    primitives = Primitives(500)
    before = primitives.azimuth.detach(), primitives.elevation.detach()
    optimiser = torch.optim.Adam(primitives.parameters(), lr=1e-3)
    (primitives.azimuth + primitives.elevation).sum().backward()
    optimiser.step()
    moved = [
        (now - then).abs().mean() for now, then in zip((primitives.azimuth, primitives.elevation), before, strict=True)
    ]
    assert 1 < moved[0] / moved[1] < 5


def test_scales_follow_the_depth(fresh):
    """s = (1 … 1.5) · (s_min + (s_max − s_min) exp(−(d − 0.1) / 99.9)), each axis by itself."""
    base = SCALE_MIN + (SCALE_MAX - SCALE_MIN) * np.exp(-(fresh.depth.numpy() - 0.1) / 99.9)
    ratio = fresh.scale_raw.exp().numpy() / base[:, None]
    for axis in ratio.T:
        assert_uniform(axis, 1, 1.5)
    assert abs(np.corrcoef(ratio.T)[0, 1]) < 0.1


def test_bisplats_spectrum_is_the_fields_power(small, region):
    torch.manual_seed(0)
    model = BiSplatWRF(region, Beamformer(), WAVELENGTH, **small)
    with torch.no_grad():
        torch.testing.assert_close(model(POSITIONS), torch.view_as_complex(model.field(POSITIONS)).abs() ** 2)


def test_coefficients_are_mixed_by_the_papers_formula(monkeypatch, small, region):
    """c = (amp_static + w amp_mod) e^{j(phase_static + phase_mod)}, w smaller for coarse primitives than for fine."""
    from learn.models.networks import bisplat as module

    seen = {}

    def catch(*arguments):
        seen["coefficient"] = arguments[0].coefficient
        return torch.zeros(2, 90, 360, 2)

    monkeypatch.setattr(module, "splat", catch)
    assert 0 <= module.W_SCALE_COARSE < module.W_SCALE_FINE
    torch.manual_seed(0)
    model = BiSplatWRF(region, Beamformer(), WAVELENGTH, **small)
    for part in (model.static, model.dynamic):  # as if trained: no part is zero
        torch.nn.init.normal_(part.outward.weight)
    outputs = {}
    for part in ("static", "dynamic"):
        hook = lambda _, __, output, part=part: outputs.update({part: output.double().numpy()})  # noqa: E731
        getattr(model, part).register_forward_hook(hook)
    with torch.no_grad():
        model.field(POSITIONS)
    static, dynamic = np.broadcast_to(outputs["static"], (2, 40, 2)), outputs["dynamic"]
    weight = np.where(np.arange(40) < 12, module.W_SCALE_COARSE, module.W_SCALE_FINE)
    amplitude = static[..., 0] + weight * dynamic[..., 0]
    expected = amplitude * np.exp(1j * (static[..., 1] + dynamic[..., 1]))
    found = torch.view_as_complex(seen["coefficient"]).numpy()
    np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("branch", ["dynamic", "delta"])
def test_bypassed_branch_acts_as_one_whose_output_is_zero(make, branch):
    silenced, bypassed = make(), make([branch])
    for model in (silenced, bypassed):
        for part in (model.dynamic, model.delta):
            torch.nn.init.normal_(part.outward.weight, generator=torch.Generator().manual_seed(1))
    with torch.no_grad():
        whole = silenced(POSITIONS)
        getattr(silenced, branch).outward.weight.zero_()
        getattr(silenced, branch).outward.bias.zero_()
        torch.testing.assert_close(bypassed(POSITIONS), silenced(POSITIONS))
        assert (bypassed(POSITIONS) - whole).abs().max() > 1e-3


def test_without_dynamic_network_and_delta_decoder_the_transmitter_plays_no_role(make):
    for bypass, depends in (([], True), (["dynamic"], True), (["delta"], True), (["dynamic", "delta"], False)):
        model = make(bypass)
        for part in (model.dynamic, model.delta):
            torch.nn.init.normal_(part.outward.weight, generator=torch.Generator().manual_seed(1))
        with torch.no_grad():
            here, there = model(POSITIONS)
        assert ((here - there).abs().max() > 1e-4) == depends, bypass


@pytest.mark.slow
def test_bisplat_learns_a_spectrum_of_two_plane_waves(plane_waves, small, region):
    truth = normalise(Beamformer().spectrum(plane_waves((1, 200, 40), (0.6j, 60, 25))))[None]
    torch.manual_seed(0)
    model = BiSplatWRF(region, Beamformer(), WAVELENGTH, **{**small, "primitives": 400})

    def similarity():
        with torch.no_grad():
            return ssim(model(POSITIONS[:1]).double().numpy(), truth)[0]

    assert similarity() < 0.9
    whole = model.azimuths, model.elevations
    model.azimuths, model.elevations = (axis[::2] for axis in whole)  # every other pixel, for the time it takes
    optimiser = torch.optim.Adam(model.parameters(), 2e-2)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 2e-2, total_steps=300, pct_start=0.1)
    for _ in range(300):
        optimiser.zero_grad()
        composite_loss(model(POSITIONS[:1]), torch.from_numpy(truth[:, ::2, ::2]).float()).backward()
        optimiser.step()
        schedule.step()
    model.azimuths, model.elevations = whole
    assert similarity() > 0.99
