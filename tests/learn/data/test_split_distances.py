"""Distances from test positions to known ones, and the guard and the areas that keep them apart."""

from dataclasses import replace

import numpy as np
import pytest

from learn.data.split_distances import SplitDistances
from learn.data.splits import AREAS, split
from scenes.files.errors import InputError, ParameterError
from tests.plane_wave_field import WAVELENGTH, dataset_of, plane_waves


@pytest.fixture(scope="module")
def line():
    """40 positions 0.3 wavelengths apart; the test positions are those from 30 on."""
    places = np.outer(np.arange(40), [0.3 * WAVELENGTH, 0, 0])
    return replace(dataset_of(places, plane_waves(places, 5, 0)), train=np.arange(30), test=np.arange(30, 40))


@pytest.fixture(scope="module")
def square():
    places = np.random.default_rng(0).uniform(0, 3, (300, 3)) * [1, 1, 0]
    return dataset_of(places, np.ones((300, 16), complex))


def distances(dataset, **settings):
    parts = split(dataset, **settings)
    known, tested = dataset.positions[parts.known], dataset.positions[parts.test]
    return SplitDistances.between(known, tested, dataset.wavelength)


def test_distances_of_a_line(line):
    found = distances(line, kind="files", seed=0)
    expected = 0.3 * WAVELENGTH * np.arange(1, 11)
    missing = np.isin(29, split(line, "files", 0).known)
    assert missing and found.distance == pytest.approx(expected)
    assert found.near == 1 and found.known == 30
    assert found.facts()["test_to_known_least_wavelengths"] == 0.3
    assert found.facts()["test_to_known_median_m"] == pytest.approx(5.5 * 0.3 * WAVELENGTH, abs=1e-4)
    assert found.warning().startswith("1 of 10 test positions are nearer than half a wavelength")


def test_a_guard_leaves_out_what_is_nearer(line):
    guarded = distances(line, kind="files", seed=0, guard=0.8)
    assert guarded.distance.min() == pytest.approx(0.9 * WAVELENGTH) and guarded.known == 28
    assert guarded.warning() is None
    parts = split(line, "files", 0)
    assert np.array_equal(split(line, "files", 0, guard=0.8).test, parts.test)


@pytest.mark.parametrize("guard", [-0.1, 101.0, np.nan, "wide", None, True])
def test_a_guard_out_of_range_is_refused(line, guard):
    with pytest.raises(ParameterError, match="guard"):
        split(line, "files", 0, guard=guard)


def test_a_guard_that_leaves_nothing_is_refused(line):
    with pytest.raises(InputError, match="at least 50 wavelengths from every test position, found none; the farthest"):
        split(line, "files", 0, guard=50.0)


def test_areas_are_apart_from_one_another(square):
    parts = split(square, "area", seed=3)
    assert sorted([*parts.known, *parts.test]) == list(range(300))
    assert 0.1 < len(parts.test) / 300 < 0.35 and len(parts.validation) > 10
    at_random, by_area = distances(square, kind="random", seed=3), distances(square, kind="area", seed=3)
    assert np.median(by_area.distance) > 2.5 * np.median(at_random.distance)
    # An area is the positions nearest to its centre, so that the mean of a test area is nearer to them than to others.
    assert np.array_equal(split(square, "area", seed=3).test, parts.test)
    assert not np.array_equal(split(square, "area", seed=4).test, parts.test)


def test_too_few_places_for_areas_are_refused(line):
    few = replace(line, positions=np.repeat(line.positions[: 2 * AREAS - 1], 3, axis=0)[:40])
    with pytest.raises(InputError, match="expected at least 20 positions for the split area, found 14"):
        split(few, "area", seed=0)
