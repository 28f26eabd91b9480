"""The bilinear spatial transformer against the paper's equations."""

import numpy as np
import pytest
import torch
from torch import nn

from learn.fitted.runs import train
from learn.models.networks.bisplat import BilinearSpatialTransformer, bilinear_weights
from learn.models.networks.feed_forward import Interpolated, LinearOfParts
from scenes.files.errors import InputError


def papers_weights(azimuth, elevation, clusters):
    """w_ij by the paper's formula, looped; grid points at jΔφ and (j + ½)Δθ, elevation by elevation."""
    side = round(clusters**0.5)
    step_azimuth, step_elevation = 360 / side, 90 / side
    weights = np.zeros((len(azimuth), clusters))
    for i, (phi, theta) in enumerate(zip(azimuth, elevation, strict=True)):
        for j in range(clusters):
            phi_j, theta_j = (j % side) * step_azimuth, (j // side + 0.5) * step_elevation
            distance = min(abs(phi - phi_j), 360 - abs(phi - phi_j))
            weights[i, j] = max(0, 1 - distance / step_azimuth) * max(0, 1 - abs(theta - theta_j) / step_elevation)
    return weights


def weights_of(azimuth, elevation, clusters=16):
    return bilinear_weights(
        torch.tensor(azimuth, dtype=torch.float64), torch.tensor(elevation, dtype=torch.float64), clusters
    ).numpy()


@pytest.mark.parametrize("clusters", [4, 16, 64])
def test_weights_are_the_papers_formula(clusters):
    generator = np.random.default_rng(0)
    azimuth, elevation = generator.uniform(0, 360, 50), generator.uniform(0, 90, 50)
    found = weights_of(azimuth, elevation, clusters)
    np.testing.assert_allclose(found, papers_weights(azimuth, elevation, clusters), atol=1e-12)
    assert ((found > 0).sum(axis=1) <= 4).all()  # the four nearest grid points


def test_clusters_must_be_a_square(tiny, tmp_path):
    with pytest.raises(ValueError, match="square number of clusters, found 60"):
        weights_of([0.0], [0.0], 60)
    with pytest.raises(InputError, match=r"bisplat: expected .*square number"):
        train(tiny, tmp_path / "run", model="bisplat", options={"clusters": 60})


class Recorder(nn.Module):
    """In the transformer's place: keeps what comes in, gives out something else."""

    def __init__(self, answer):
        super().__init__()
        self.answer = answer

    def forward(self, clusters):
        self.heard = clusters
        return self.answer


def features_of(bst, *inputs):
    """The transformer's output at the primitives."""
    found = bst(*inputs)
    return found.weights @ found.values if isinstance(found, Interpolated) else found


@pytest.fixture
def make_bst():
    def make(bypass=False, clusters=16, inputs=5, width=8):
        torch.manual_seed(0)
        return BilinearSpatialTransformer(inputs, width, clusters, 1, 2, 16, bypass).double()

    return make


@pytest.fixture
def scattered():
    """30 primitives on the chart and two transmitters' encodings of them."""
    generator = torch.Generator().manual_seed(1)
    azimuth = 360 * torch.rand(30, dtype=torch.float64, generator=generator)
    elevation = 90 * torch.rand(30, dtype=torch.float64, generator=generator)
    return torch.randn(2, 30, 5, dtype=torch.float64, generator=generator), azimuth, elevation


def test_cluster_features_are_the_weighted_means_of_the_primitives(make_bst, scattered):
    bst, (encoded, azimuth, elevation) = make_bst(), scattered
    bst.transformer = Recorder(torch.zeros(2, 16, 8, dtype=torch.float64))
    features_of(bst, azimuth, elevation, encoded)

    weights = papers_weights(azimuth.numpy(), elevation.numpy(), 16)
    local = encoded.numpy() @ bst.project.weight.detach().numpy().T + bst.project.bias.detach().numpy()
    for sample in range(2):
        for j in range(16):
            near = np.flatnonzero(weights[:, j])
            g = sum(weights[i, j] * local[sample, i] for i in near) / sum(weights[i, j] for i in near)
            np.testing.assert_allclose(bst.transformer.heard[sample, j].detach().numpy(), g, atol=1e-12)


def test_global_features_are_the_weighted_means_of_the_clusters(make_bst, scattered):
    bst, (encoded, azimuth, elevation) = make_bst(), scattered
    answer = torch.randn(2, 16, 8, dtype=torch.float64, generator=torch.Generator().manual_seed(2))
    bst.transformer = Recorder(answer)
    found = features_of(bst, azimuth, elevation, encoded).detach().numpy()

    weights = papers_weights(azimuth.numpy(), elevation.numpy(), 16)
    for sample in range(2):
        for i in range(30):
            near = np.flatnonzero(weights[i])
            f = sum(weights[i, j] * answer[sample, j].numpy() for j in near) / sum(weights[i, j] for j in near)
            np.testing.assert_allclose(found[sample, i], f, atol=1e-12)


def test_every_primitive_learns_of_every_other(make_bst, scattered):
    """Through attention even of one on the other side; without the transformer of none."""
    encoded, azimuth, elevation = scattered
    changed = encoded.clone()
    changed[:, 0] += 1
    for bypass, others in ((False, 29), (True, 0)):
        bst = make_bst(bypass)
        before, after = (features_of(bst, azimuth, elevation, each) for each in (encoded, changed))
        moved = (before - after).abs().amax(-1)[0] > 1e-9
        assert moved[0] and moved[1:].sum() == others


def test_bypass_returns_the_linear_projection(make_bst, scattered):
    bst, (encoded, azimuth, elevation) = make_bst(bypass=True), scattered
    torch.testing.assert_close(
        features_of(bst, azimuth, elevation, encoded), nn.functional.linear(encoded, *bst.parameters())
    )


def test_clusters_without_primitives_do_no_harm(make_bst):
    """One primitive between four grid points: twelve clusters are empty, their features 0."""
    bst = make_bst()
    encoded = torch.ones(1, 1, 5, dtype=torch.float64)
    azimuth = torch.tensor([100.0], dtype=torch.float64, requires_grad=True)
    heard = []
    bst.transformer.register_forward_pre_hook(lambda _, inputs: heard.append(inputs[0]))
    features = features_of(bst, azimuth, torch.tensor([40.0], dtype=torch.float64), encoded)
    features.sum().backward()
    assert features.isfinite().all() and azimuth.grad.isfinite().all()
    assert (heard[0][0].abs().amax(-1) > 0).sum() == 4


def test_linear_of_parts_is_linear_of_their_concatenation():
    torch.manual_seed(0)
    layer = LinearOfParts(2 + 3 + 4, 5).double()
    weights = torch.rand(7, 6, dtype=torch.float64)
    shared, own = torch.randn(1, 7, 2, dtype=torch.float64), torch.randn(8, 1, 3, dtype=torch.float64)
    between = Interpolated(weights / weights.sum(1, keepdim=True), torch.randn(8, 6, 4, dtype=torch.float64))
    whole = torch.cat([shared.expand(8, -1, -1), own.expand(-1, 7, -1), between.weights @ between.values], dim=-1)
    torch.testing.assert_close(layer(shared, own, between), nn.functional.linear(whole, layer.weight, layer.bias))
