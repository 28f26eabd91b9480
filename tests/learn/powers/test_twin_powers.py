"""The method twin for powers: rays in a wrong description, corrected, predict what kriging cannot know."""

from dataclasses import replace

import numpy as np
import pytest

import bisplat
from learn.fitted.fitted_method import fit_method
from learn.powers.helmholtz_powers import HelmholtzPowers
from learn.powers.twin_powers import TwinPowers
from learn.quantities.known import Known
from learn.quantities.powers import Powers, score_powers
from scenes.files import optional_packages as extras
from scenes.files.errors import InputError
from scenes.scene.description import SceneObject
from scenes.scene.shapes import sheet
from scenes.scene.tolerances import Tolerances
from simulate.rays.core.propagation import Propagation
from tests.small_scene import CABINET, small_scene

DIRECT = Propagation(max_depth=0, rays=1000, diffraction=False)
ONCE = Propagation(max_depth=1, rays=2000, diffraction=False)
GATEWAYS = {"door": (0.0, 0.0, 1.5), "wall": (2.5, -2.0, 1.4)}
PLACES = Tolerances(position=0.03, objects=0, materials=0)
PLACE = small_scene(CABINET)


def moved_to(heard, positions):
    return replace(heard, receiver=replace(heard.receiver, positions=positions))


@pytest.fixture(scope="module")
def heard(tmp_path_factory):
    """Powers of the direct path and the reflections at the floor and the cabinet, at 240 positions."""
    folder = tmp_path_factory.mktemp("twin") / "heard"
    return bisplat.simulate_rssi(PLACE, folder, GATEWAYS, n=240, shadowing_db=1, propagation=ONCE)


@pytest.fixture(scope="module")
def fitted(heard):
    """The twin of a description whose gateways are 3 cm off along each axis, fitted to 60 of the powers."""
    described = moved_to(heard, heard.gateway_positions + np.array([0.03, -0.03, 0.03]))
    twin = TwinPowers(PLACE, described, PLACES, ONCE)
    twin.fit(Known.of(described, Powers(), np.arange(60)))
    return twin


def test_the_corrected_scene_predicts_better_than_kriging_and_says_how_well(heard, fitted):
    kriging = HelmholtzPowers()
    kriging.fit(Known.of(heard, Powers(), np.arange(60)))
    test = slice(60, None)
    kriged, traced = (
        score_powers(method.predict(heard.positions[test]), heard.powers[test], heard.floor_dbm)
        for method in (kriging, fitted)
    )
    assert traced["error_median_db"] < 0.75 * kriged["error_median_db"]
    assert 0.8 <= traced["coverage_90"] <= 0.95
    assert traced["interval_median_db"] < 0.75 * kriged["interval_median_db"]


def test_a_description_of_another_place_does_no_harm(heard):
    """It has no cabinet, its floor is 4 m lower, and a wall of metal is not there in truth."""
    floor = SceneObject("floor", sheet((-9, -9, -4), (18, 0, 0), (0, 18, 0)), "concrete")
    wall = SceneObject("wall", sheet((-9, -3, -4), (18, 0, 0), (0, 0, 9)), "metal")
    other = replace(PLACE, objects=(floor, wall))
    errors = []
    for method in (HelmholtzPowers(), TwinPowers(other, heard, PLACES, ONCE)):
        method.fit(Known.of(heard, Powers(), np.arange(60)))
        found = method.predict(heard.positions[60:])
        errors.append(score_powers(found, heard.powers[60:], heard.floor_dbm)["error_median_db"])
    assert errors[1] < 1.15 * errors[0]


def test_where_no_path_leads_the_trend_stays_in_its_range(heard, fitted):
    behind = np.array([[2.0, 1.75, 1.5]])  # inside the cabinet of metal
    found = fitted.predict(behind)
    assert np.isfinite(found.value).all() and (found.value > heard.powers.min() - 40).all()
    assert (found.low < found.value).all() and (found.value < found.high).all()


def test_a_scene_gives_compare_its_twin(heard, monkeypatch):
    monkeypatch.setattr(TwinPowers.__init__, "__defaults__", (PLACES, DIRECT))
    comparison = bisplat.compare(heard, ["twin"], split="random", sizes=[12], scene=replace(PLACE, name="hall"))
    (row,) = [row for row in comparison if row["label"] == "twin"]
    assert "hall" in row["found"] and "low" in comparison.each["twin, 12"]
    fitted = fit_method(heard, "power", "twin", known=np.arange(12), scene=PLACE)
    assert bisplat.coverage_map(fitted, step=0.5).width is not None


@pytest.mark.parametrize(
    ("methods", "scene", "expected"),
    [
        ({"rays": "twin"}, None, "scene: expected .*, found none"),
        (["mean"], "closet", "scene: expected the method twin .* found mean"),
        (None, "nowhere", "nowhere"),
        (["twin"], replace(PLACE, frequency=2.4e9), "small: expected 915 MHz as in"),
    ],
)
def test_what_does_not_fit_is_refused_before_any_fit(heard, methods, scene, expected):
    with pytest.raises(InputError, match=expected):
        bisplat.compare(heard, methods, split="random", scene=scene)


def test_a_gateway_inside_an_object_is_refused(heard):
    inside = moved_to(heard, np.array([[2.0, 1.75, 1.5], [2.5, -2.0, 1.4]]))
    with pytest.raises(InputError, match="heard: gateway door"):
        bisplat.compare(inside, ["twin"], split="random", scene=PLACE)


def test_without_the_ray_tracer_all_else_works(heard, monkeypatch):
    monkeypatch.setattr(extras, "find_spec", lambda module: None)
    assert bisplat.compare(heard, ["mean"], split="random").rows
    with pytest.raises(InputError, match=r"bisplat-wrf\[rays\]"):
        bisplat.compare(heard, ["twin"], split="random", scene=PLACE)
