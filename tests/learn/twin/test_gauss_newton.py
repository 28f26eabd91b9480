"""A wrongly described scene is corrected by responses to thirty transmitters."""

import numpy as np
import pytest

from learn.twin import gauss_newton
from learn.twin.gauss_newton import Draws, Minimum, Search, halved_to_valid
from learn.twin.linearised import by_materials, over_band
from scenes.checks.validation import validate
from scenes.files.errors import InputError
from scenes.scene.description import SceneObject
from scenes.scene.shapes import box
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import unknowns, vary
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from tests.learn.twin.small_search import search_by
from tests.small_scene import CABINET, small_scene

PROPAGATION = Propagation(max_depth=2, rays=20_000)
TOLERANCES = Tolerances(position=0.04, rotation=3.0, objects=0.06, materials=0.3)


@pytest.fixture(scope="module")
def true():
    return small_scene(CABINET)


@pytest.fixture(scope="module")
def wrong(true):
    """The small scene as described, what may be wrong with it, and by how much it is."""
    which = unknowns(true, TOLERANCES)
    draw = np.random.default_rng(4).normal(size=len(which)) * [each.tolerance for each in which]
    return vary(true, which, draw), which, draw


@pytest.fixture(scope="module")
def measured(true):
    """Positions of transmitters, and the true responses, 30 dB above noise, in a gain of the receiver's own."""
    generator = np.random.default_rng(2)
    positions = generator.uniform(*true.transmitter.region, (30, 3))
    responses = Tracer(true, PROPAGATION).responses(positions).astype(complex)
    noise = generator.normal(size=(*responses.shape, 2)) @ [1, 1j] * 0.03 * np.abs(responses).mean()
    return positions, 5j * (responses + noise)


@pytest.fixture(scope="module")
def with_phases(wrong, measured):
    return search_by(wrong[0], wrong[1], PROPAGATION, *measured, phases_known=True).most_likely()


def misfit_of(search, scene):
    """That of a scene's traced responses."""
    traced = Tracer(scene, PROPAGATION, search.tracers[""].region).responses(search.positions)
    return search.stages[-1].fit(traced.astype(complex)).misfit


def behind_pictures(responses):
    """Responses of which each has a phase and a scale of its own, and every third is flipped."""
    generator = np.random.default_rng(3)
    turned = responses * np.exp(2j * np.pi * generator.random((len(responses), 1)))
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    turned[::3] = turned[::3, ::-1].conj()
    return turned


@pytest.mark.slow
@pytest.mark.parametrize("phases_known", [True, False])
def test_pose_and_cabinet_are_found(phases_known, wrong, measured, with_phases):
    positions, responses = measured
    search = search_by(wrong[0], wrong[1], PROPAGATION, positions, behind_pictures(responses), phases_known=False)
    found = with_phases if phases_known else search.most_likely()
    left = dict(zip([each.label for each in wrong[1]], wrong[2] + found.values, strict=True))
    assert max(abs(left[f"gateway {axis}"]) for axis in "xyz") < 0.005
    assert max(abs(left[f"gateway rotation about {axis}"]) for axis in "xyz") < np.radians(0.4)
    assert abs(left["cabinet y"]) < 0.006
    assert found.fit.misfit < 0.1 * misfit_of(search, wrong[0])


@pytest.mark.slow
def test_pose_is_found_from_a_band_in_which_phases_turn(true, measured):
    """Half as many spectra, at two subcarriers, and a gain of the receiver's own."""
    positions, ratios = measured[0][:8], (0.99, 1.01)
    followed = Propagation(max_depth=1, rays=20_000, diffraction=False)
    band = over_band(Tracer(true, followed), ratios)
    responses = np.concatenate([2j * each.responses(positions).astype(complex) for each in band], axis=1)
    which = unknowns(true, Tolerances(position=0.03, rotation=2.0, objects=0, materials=0))
    off = np.array([0.03, -0.02, 0.03, 0.03, -0.02, 0.02])
    described = vary(true, which, off), which, followed, positions, responses, True
    found = search_by(*described, ratios).most_likely()
    np.testing.assert_allclose(found.values, -off, atol=0.002)
    assert found.fit.gain == pytest.approx(2j, abs=0.05)
    alone = search_by(*described, (1.0, 1.0)).most_likely()
    assert alone.fit.misfit > 10 * found.fit.misfit  # the frequencies matter


@pytest.mark.slow
def test_what_is_left_is_within_what_is_said(wrong, with_phases):
    ratios = (wrong[2] + with_phases.values) / with_phases.deviations
    assert np.abs(ratios).max() < 4 and np.sqrt((ratios**2).mean()) < 2
    assert (with_phases.deviations <= [each.tolerance * 1.001 for each in wrong[1]]).all()
    assert with_phases.fit.gain == pytest.approx(5j, abs=0.25)  # the receiver's


def test_columns_of_materials_are_what_changed_materials_do(true, measured):
    followed, positions = Propagation(max_depth=1, rays=20_000, diffraction=False), measured[0][:8]
    which = unknowns(true, Tolerances(position=0, rotation=0, objects=0, materials=0.3))
    tracer = Tracer(true, followed)
    columns = by_materials(tracer, which, positions, tracer.responses(positions).astype(complex))
    before, expected = tracer.responses(positions).astype(complex), np.zeros_like(columns)
    for column in range(len(which)):
        changed = vary(true, which, 0.02 * np.eye(len(which))[column])
        expected[..., column] = (Tracer(changed, followed).responses(positions) - before) / 0.02
    largest = np.abs(expected).max()
    assert largest > 0.01 * np.abs(before).max()
    np.testing.assert_allclose(columns, expected, atol=0.01 * largest)


def test_a_step_that_puts_the_gateway_into_a_box_is_halved():
    post = SceneObject("post", box((-0.1, 0.2, 1.38), (-0.07, 0.3, 1.46)), "concrete")
    place, pose = small_scene(CABINET, post), Tolerances(position=0.06, rotation=0, objects=0, materials=0)
    which, start = unknowns(place, pose), np.zeros(3)
    search = search_by(place, which, Propagation(max_depth=0), np.ones((1, 3)), np.ones((1, 16)), True)
    into_the_post = np.array([-0.04, 0.0, 0.0])
    with pytest.raises(InputError, match="behind: gateway"):
        validate(vary(place, which, into_the_post), "behind")
    valid = search.is_valid
    np.testing.assert_allclose(halved_to_valid(start, into_the_post, valid), into_the_post / 2)
    np.testing.assert_array_equal(halved_to_valid(into_the_post, np.array([1e-4, 0, 0]), valid), start)
    np.testing.assert_array_equal(halved_to_valid(start, -into_the_post, valid), -into_the_post)


@pytest.mark.slow
def test_a_gateway_is_not_taken_for_one_half_a_wavelength_away(true, measured):
    """Steps that compare all responses in one common phase end 15 cm away from here, with the opposite gain."""
    which = unknowns(true, Tolerances(position=0.06, rotation=4.0, objects=0.06, materials=0.4))
    draw = np.random.default_rng(13).normal(size=len(which)) * [each.tolerance for each in which]
    search = search_by(vary(true, which, draw), which, PROPAGATION, *measured, phases_known=True)
    found = search.most_likely()
    near = 0.02  # metres; so far away, the gain of the best fit has turned by as much as the phase of a wave
    assert np.linalg.norm((found.values + draw)[:3]) < near
    assert found.fit.gain == pytest.approx(5j, abs=5 * 2 * np.pi / true.wavelength * near)
    assert found.fit.misfit < 0.01 < 0.3 < misfit_of(search, vary(true, which, draw))


@pytest.mark.parametrize(("off", "likelier", "expected"), [(0.1, True, 0.11), (0.1, False, 0.01), (0.03, True, 0.01)])
def test_the_likelier_of_two_ends_is_taken(true, measured, monkeypatch, off, likelier, expected):
    """A search from the description ends 1 cm beside it, another one from a guess, if this is not near there."""
    which = unknowns(true, Tolerances(rotation=0, objects=0, materials=0))
    guess = np.array([0.0, off, 0.0])

    def from_start(search, tracers, start):
        assert tracers[0].scene.gateway.position == vary(true, which, start).gateway.position
        unlikely = -1.0 if start.any() == likelier else 1.0
        return Minimum(start + np.array([0, 0.01, 0]), np.full(3, 0.1), tracers, unlikely)

    monkeypatch.setattr(Search, "from_start", from_start)
    monkeypatch.setattr(Draws, "nearby", lambda *arguments: guess)
    found = search_by(true, which, PROPAGATION, *measured, phases_known=True).most_likely()
    np.testing.assert_allclose(found.values, [0, expected, 0])


def test_a_step_to_where_no_path_reaches_is_followed_by_shorter_ones(true, monkeypatch):
    """Of the gateway's x alone, with a tolerance of 1 m and given responses; the scene is not traced."""
    which = unknowns(true, Tolerances(position=1.0, rotation=0, objects=0, materials=0))[:1]
    ours, other, tried = np.exp(1j * np.arange(16)), np.exp(3j * np.arange(16)), []

    def linearised(x, which, positions, gateway):
        tried.append(x)
        reached = x < 0.2
        return reached * (ours + (0.5 - x) * other)[None], -reached * other[None, :, None]

    search = search_by(true, which, Propagation(max_depth=0), np.zeros((1, 3)), ours[None], True)
    monkeypatch.setattr(gauss_newton, "moved", lambda tracer, scene: scene.gateway.position[0])
    monkeypatch.setattr(gauss_newton, "linearised", linearised)
    monkeypatch.setattr(gauss_newton, "by_materials", lambda *arguments: np.zeros((1, 16, 1)))
    monkeypatch.setattr(gauss_newton, "is_valid", lambda scene: True)
    end = search.minimum(Minimum(np.zeros(1), np.ones(1), [0.0]), search.stages[-1], 1e-3)
    assert tried[1] > tried[2] > 0.2 > tried[3]
    np.testing.assert_allclose(tried[2:4], [tried[1] / 2, tried[1] / 4])
    assert tried[3] < end.values[0] < 0.2


def test_position_that_no_path_reaches_does_no_harm(true):
    in_the_open = np.random.default_rng(0).uniform(*true.transmitter.region, (5, 3))
    positions = np.concatenate([in_the_open, [[2.0, 2.5, 1.2]]])  # the last one is behind the cabinet
    propagation = Propagation(max_depth=0, rays=20_000, diffraction=False)
    responses = Tracer(true, propagation, np.array([[2.0, -0.5, 1.0], [3.0, 2.5, 1.6]])).responses(positions)
    assert not responses[-1].any() and responses[:-1].all()
    responses[-1] = 1e-3
    found = search_by(true, unknowns(true, TOLERANCES), propagation, positions, responses, False).most_likely()
    assert np.isfinite(found.values).all() and np.isfinite(found.deviations).all()
