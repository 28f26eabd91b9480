"""The posterior of a few unknowns and the steps that lower it; a scene that changed a little keeps its chains."""

import numpy as np
import pytest
from scipy.linalg import cho_factor

from learn.twin.gauss_newton import Quadratic
from learn.twin.linearised import moved, over_band
from learn.twin.response_residual import ResponseFit, ResponseResidual
from scenes.scene.description import SceneObject, shifted
from scenes.scene.shapes import box
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from tests.small_scene import small_scene


def quadratic(alike, rest, jacobian, traced, values, prior):
    """The posterior of unknowns that responses with a rest depend on linearly."""
    residual = ResponseResidual(rest, alike, phases_known=True, flips=False)
    precision, towards = residual.quadratic(ResponseFit(0, 0, 1, rest), traced, jacobian * prior)
    return Quadratic(precision + np.eye(len(prior)), towards - values / prior, prior)


def test_stated_deviations_are_those_of_a_linear_problem():
    """Of three unknowns that responses with errors of unknown size depend on linearly."""
    generator = np.random.default_rng(1)
    jacobian, traced = generator.normal(size=(12, 4, 3, 2)) @ [1, 1j], generator.normal(size=(12, 4, 2)) @ [1, 1j]
    correlation = 0.3 * np.eye(12) + 0.7 * np.exp(-np.abs(np.subtract.outer(np.arange(12), np.arange(12))) / 3)
    root, alike = np.linalg.cholesky(correlation), cho_factor(correlation, lower=True)
    steps, deviations = [], []
    for _ in range(2000):
        rest = 0.1 * root @ (generator.normal(size=(12, 4, 2)) @ [1, 1j])
        model = quadratic(alike, rest, jacobian, traced, np.zeros(3), np.full(3, 1e3))
        steps.append(model.step(np.inf))
        deviations.append(model.deviations)
    np.testing.assert_allclose(np.sqrt(np.mean(np.square(deviations), axis=0)), np.std(steps, axis=0), rtol=0.05)


def test_repeated_responses_that_do_not_count_make_nothing_surer():
    """Positions that are repeated twenty times, with the same errors, say what they say once."""
    generator = np.random.default_rng(1)
    jacobian, traced = generator.normal(size=(10, 16, 3, 2)) @ [1, 1j], generator.normal(size=(10, 16, 2)) @ [1, 1j]
    rest = 0.1 * generator.normal(size=(10, 16, 2)) @ [1, 1j]
    steps, unlikely = [], []
    for times in (1, 20):
        alike = cho_factor(np.eye(10 * times))
        left, by_unknown, there = (np.concatenate([each] * times) for each in (rest, jacobian, traced))
        model = quadratic(alike, left, by_unknown, there, np.full(3, 0.1), np.full(3, 0.2))
        steps.append((model.step(np.inf), model.deviations))
        unlikely.append(ResponseResidual(left + there, alike, True, False).fit(there).unlikely)
    np.testing.assert_allclose(steps[0], steps[1])
    assert unlikely[0] == pytest.approx(unlikely[1])


@pytest.mark.parametrize("phases_known", [True, False])
def test_the_gain_of_the_traced_responses_says_nothing(phases_known):
    generator = np.random.default_rng(5)
    traced, noise = generator.normal(size=(2, 12, 4, 2)) @ [1, 1j]
    alike = cho_factor(0.5 * np.eye(12) + 0.5, lower=True)

    def of(scaled):
        return ResponseResidual(traced + 0.1 * noise, alike, phases_known, flips=True).fit(scaled).unlikely

    assert of(1.5 * traced) == pytest.approx(of(traced), abs=1e-6)
    assert of(traced + 0.1 * noise[::-1]) > of(traced) + 10


def test_slope_is_that_of_the_posterior():
    """By finite differences, where the responses are linear in unknowns of unequal priors, and phases are known."""
    generator = np.random.default_rng(6)
    jacobian, traced, noise = (generator.normal(size=(12, 4, n, 2)) @ [1, 1j] for n in (3, 1, 1))
    prior, values = np.array([0.2, 0.02, 1.0]), np.array([0.1, 0.03, -0.5])
    measured = traced[..., 0] + 0.1 * noise[..., 0]
    alike = cho_factor(0.5 * np.eye(12) + 0.5, lower=True)

    residual = ResponseResidual(measured, alike, phases_known=True, flips=False)

    def unlikely(step):
        return residual.fit(traced[..., 0] + jacobian @ step).unlikely + (((values + step) / prior) ** 2).sum()

    model = quadratic(alike, residual.fit(traced[..., 0]).rest, jacobian, traced[..., 0], values, prior)
    for number, small in enumerate(1e-5 * np.diag(prior)):
        slope = (unlikely(small) - unlikely(-small)) / 2e-5
        assert slope == pytest.approx(-2 * model.towards[number], rel=0.02, abs=0.2)


@pytest.fixture
def model():
    """Of three unknowns of which the responses tell one well, one badly, and one not at all."""
    generator = np.random.default_rng(2)
    jacobian, traced = generator.normal(size=(12, 4, 3, 2)) @ [1, 1j], generator.normal(size=(12, 4, 2)) @ [1, 1j]
    rest = 0.1 * generator.normal(size=(12, 4, 2)) @ [1, 1j] + jacobian @ [0.3, 1.0, 0.0]
    prior = np.array([0.2, 0.4, 2.0])
    return quadratic(cho_factor(np.eye(12)), rest, jacobian * [1, 0.01, 0], traced, np.full(3, 0.1), prior)


def change(model, steps):
    """What steps change of the posterior that the model is of."""
    scaled = steps / model.prior
    return np.einsum("...i,ij,...j->...", scaled, model.precision, scaled) - 2 * scaled @ model.towards


@pytest.mark.parametrize("reach", [0.01, 0.3])
def test_a_step_is_the_best_of_its_length(model, reach):
    step = model.step(reach)
    assert np.linalg.norm(step / model.prior) == pytest.approx(reach)
    assert np.linalg.norm(model.step(np.inf) / model.prior) > 0.5
    others = np.random.default_rng(0).normal(size=(20_000, 3))
    others *= reach * model.prior / np.linalg.norm(others, axis=1, keepdims=True)
    assert change(model, step) <= change(model, others).min()


def test_a_step_whose_end_is_near_is_not_damped(model):
    whole = model.step(np.inf)
    np.testing.assert_allclose(model.precision @ (whole / model.prior), model.towards)
    np.testing.assert_array_equal(model.step(1.01 * np.linalg.norm(whole / model.prior)), whole)
    assert change(model, whole) < change(model, 0.99 * whole)


def test_steps_are_longer_the_more_they_gain(model):
    step = model.step(0.3)
    expected = -change(model, step)
    reaches = [model.next_reach(step, 0.3, share * expected) for share in (-1, 0.2, 0.5, 0.9)]
    np.testing.assert_allclose(reaches, [0.15, 0.15, 0.3, 0.6])
    whole = model.step(np.inf)
    assert model.next_reach(whole, np.inf, -change(model, whole)) == np.inf


POSITIONS = np.random.default_rng(0).uniform((2.0, -0.5, 1.0), (3.0, 0.5, 1.6), (5, 3))


def two_boxes(apart):
    """The small scene with two metal boxes whose fronts lie in one plane, but for a distance in metres."""
    left = SceneObject("left", box((1.0, 1.5, 0.001), (2.0, 2.0, 3.0)), "metal")
    right = SceneObject("right", box((2.5, 1.5 + apart, 0.001), (3.5, 2.0 + apart, 3.0)), "metal")
    return small_scene(left, right)


@pytest.mark.parametrize("diffraction", [False, True])
@pytest.mark.parametrize("apart", [0.0, 0.005])
def test_moved_scene_has_the_paths_of_a_new_one(apart, diffraction):
    propagation = Propagation(max_depth=2, rays=20_000, diffraction=diffraction)
    tracer = moved(Tracer(two_boxes(0.0), propagation), two_boxes(apart))
    expected = Tracer(two_boxes(apart), propagation).responses(POSITIONS)
    np.testing.assert_allclose(tracer.responses(POSITIONS), expected, atol=1e-5 * np.abs(expected).max())


def test_frequencies_of_a_band_are_traced_far_from_the_origin_too():
    """Where the tracer counts coordinates from a point of its own, as for map coordinates."""
    scene, away = small_scene(), np.array([1000.0, 0.0, 0.0])
    coarse = Propagation(max_depth=1, rays=20_000, diffraction=False)
    near, far = (over_band(Tracer(each, coarse), (0.99,))[0] for each in (scene, shifted(scene, away)))
    np.testing.assert_allclose(far.responses(POSITIONS + away), near.responses(POSITIONS), rtol=1e-4)
