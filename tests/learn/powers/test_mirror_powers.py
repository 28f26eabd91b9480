"""mirror-images for powers: walls that several gateways share are found in powers without phases."""

import numpy as np
import pytest

from learn.powers import mirror_powers
from learn.powers.helmholtz_powers import HelmholtzPowers
from learn.powers.mirror_powers import LEAST_KNOWN, MirrorPowers, PowerImages, images_in_one_plane, images_in_two_planes
from learn.quantities.known import Known
from learn.quantities.known_powers import decades
from tests.learn.taught import taught_powers

WAVELENGTH = 0.33
GATEWAYS = np.array([[-2.0, 0.3, 2.1], [3.0, 2.5, 2.2], [0.4, -1.7, 1.9]])
FLOOR, WALL = 0.1, 3.4  # z and x, metres
REGION = np.array([[0.0, 0.0, 0.7], [1.2, 1.2, 1.3]])
PLACES = np.random.default_rng(2).uniform(*REGION, (180, 3))
KNOWN, OTHERS = slice(0, 100), slice(100, None)


def powers_of_a_room(places: np.ndarray) -> np.ndarray:
    """Powers of the direct wave and its reflections at a floor, at a wall, and at both, dBm."""
    found = np.zeros((len(places), len(GATEWAYS)))
    for column, gateway in enumerate(GATEWAYS):
        floor, wall = gateway.copy(), gateway.copy()
        floor[2], wall[0] = 2 * FLOOR - gateway[2], 2 * WALL - gateway[0]
        both = np.array([wall[0], gateway[1], floor[2]])
        field = 0
        for amplitude, image in ((1, gateway), (-0.6, floor), (0.5j, wall), (-0.3j, both)):
            away = np.linalg.norm(places - image, axis=1)
            field = field + amplitude * np.exp(-2j * np.pi * away / WAVELENGTH) / away
        found[:, column] = -40 - 3 * column + 20 * np.log10(np.abs(field))
    return found


def known(powers: np.ndarray, count: int = 100) -> Known:
    return taught_powers(PLACES[:count], powers[:count], GATEWAYS, -110.0, WAVELENGTH)


@pytest.fixture(scope="module")
def powers():
    return np.round(powers_of_a_room(PLACES))


@pytest.fixture(scope="module")
def fitted(powers):
    method = MirrorPowers()
    method.fit(known(powers))
    return method


def test_powers_in_a_room_are_predicted_far_better_than_by_kriging_and_intervals_hold(powers, fitted):
    kriging = HelmholtzPowers()
    kriging.fit(known(powers))
    of_images, kriged = (np.abs(each.predict(PLACES[OTHERS]).value - powers[OTHERS]) for each in (fitted, kriging))
    assert np.median(of_images) < 0.5 * np.median(kriged)
    assert np.quantile(of_images, 0.9) < 0.7 * np.quantile(kriged, 0.9)
    stated = fitted.predict(PLACES[OTHERS])
    assert 0.82 <= ((stated.low <= powers[OTHERS]) & (powers[OTHERS] <= stated.high)).mean() <= 0.97


def test_the_walls_are_found(powers):
    images = PowerImages(GATEWAYS, REGION, WAVELENGTH)
    images.fit(PLACES[KNOWN], powers[KNOWN])
    for axis, wall in ((2, FLOOR), (0, WALL)):
        along = images.images.axes == axis
        strengths = np.abs(images.amplitudes[:, along]).max(axis=0)
        strongest = images.images.planes[along][strengths.argmax()]
        assert abs(strongest - wall) < WAVELENGTH / 2


def test_powers_without_images_are_predicted_as_by_helmholtz():
    noise = np.random.default_rng(1).normal(0, 3, (len(PLACES), len(GATEWAYS)))
    distances = np.linalg.norm(PLACES[:, None] - GATEWAYS, axis=-1)
    powers = -40 + 2.5 * decades(distances) + noise
    errors = []
    for method in (MirrorPowers(), HelmholtzPowers()):
        method.fit(known(powers))
        errors.append(np.abs(method.predict(PLACES[OTHERS]).value - powers[OTHERS]).mean())
    assert errors[0] < 1.05 * errors[1]


def test_few_known_positions_are_kriged_by_helmholtz(powers):
    found = []
    for method in (MirrorPowers(), HelmholtzPowers()):
        method.fit(known(powers, LEAST_KNOWN - 1))
        found.append(method.predict(PLACES[OTHERS]).value)
    assert np.allclose(*found, atol=1e-6)


def test_gateways_are_searched_in_groups(powers, fitted, monkeypatch):
    monkeypatch.setattr(mirror_powers, "AT_ONCE", 2)
    method = MirrorPowers()
    method.fit(known(powers))
    predicted, whole = method.predict(PLACES[OTHERS]).value, fitted.predict(PLACES[OTHERS]).value
    assert predicted.shape == whole.shape
    assert np.median(np.abs(predicted - whole)) < 1


def test_gateways_that_receive_nothing_do_no_harm(powers, fitted):
    deaf = powers.copy()
    deaf[:, 1] = np.nan
    method = MirrorPowers()
    method.fit(known(deaf))
    predicted, whole = (each.predict(PLACES[OTHERS]).value for each in (method, fitted))
    assert np.isfinite(predicted).all()
    error, usual = (np.median(np.abs(each - powers[OTHERS])[:, 0]) for each in (predicted, whole))
    assert error < 1.5 * usual + 0.3


def test_an_image_in_two_planes_is_behind_neither():
    first = images_in_one_plane(GATEWAYS, REGION, WAVELENGTH)
    strengths = np.ones(len(first.planes))
    perpendicular, parallel = images_in_two_planes(GATEWAYS, first, strengths, REGION, WAVELENGTH)
    assert parallel.sent.all()
    assert not perpendicular.sent.all()
    waves = perpendicular.waves(PLACES[:3], WAVELENGTH)
    assert waves.shape == (3, 3, len(perpendicular.planes))
    assert (waves[~np.broadcast_to(perpendicular.sent[:, None], waves.shape)] == 0).all()
