"""Distances from test positions to known ones, and the guard and the areas that keep them apart."""

import re
from dataclasses import replace

import numpy as np
import pytest

from learn.data.split_distances import SplitDistances
from learn.data.splits import AREAS, split
from scenes.files.errors import InputError
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


def test_a_guard_that_leaves_nothing_is_refused_with_the_largest_that_works(line):
    parts = split(line, "files", 0)
    with pytest.raises(InputError, match="found 50 wavelengths, which leaves 0 of 27 and 0 of 3 of them; ") as refused:
        split(line, "files", 0, guard=50.0)
    # Position 30 is tested, and each part has to keep its farthest position from there.
    apart = 0.3 * WAVELENGTH / line.wavelength
    most = float(re.search("; (.*) wavelengths is the largest that does", str(refused.value))[1])
    assert most == pytest.approx(apart * min(30 - parts.train.min(), 30 - parts.validation.min()), abs=1e-3)
    left = split(line, "files", 0, guard=most)
    assert len(left.train) and len(left.validation)


def test_areas_are_apart_from_one_another(square):
    parts = split(square, "area", seed=3)
    assert sorted([*parts.known, *parts.test]) == list(range(300))
    assert 0.1 < len(parts.test) / 300 < 0.35 and len(parts.validation) > 10
    at_random, by_area = distances(square, kind="random", seed=3), distances(square, kind="area", seed=3)
    assert np.median(by_area.distance) > 2.5 * np.median(at_random.distance)
    assert np.array_equal(split(square, "area", seed=3).test, parts.test)
    assert not np.array_equal(split(square, "area", seed=4).test, parts.test)


@pytest.fixture(scope="module")
def places() -> dict:
    """Positions of many kinds: even, along a walk, in an L, on a grid, mostly in one corner, and each six times."""
    draw = np.random.default_rng(1)
    corner = draw.uniform(0, 5, (900, 3)) * [1, 1, 0]
    return {
        "box": draw.uniform(0, 3, (300, 3)),
        "line": np.outer(np.arange(100), [0.05, 0, 0]),
        "walk": np.cumsum(draw.normal(0, 0.02, (400, 3)), axis=0),
        "l": corner[(corner[:, 0] < 1.5) | (corner[:, 1] < 1.5)],
        "grid": np.stack(np.meshgrid(np.arange(15), np.arange(15), [0.0]), axis=-1).reshape(-1, 3) / 10,
        "uneven": np.concatenate([draw.normal(0, 0.1, (200, 3)), draw.uniform(0, 3, (100, 3))]),
        "repeated": np.repeat(draw.uniform(0, 3, (25, 3)), 6, axis=0),
    }


@pytest.mark.parametrize("kind", ["box", "line", "walk", "l", "grid", "uneven", "repeated"])
def test_areas_hold_out_about_a_fifth_of_any_positions(places, kind):
    at = places[kind]
    dataset = dataset_of(at, np.ones((len(at), 16), complex))
    for seed in range(3):
        parts = split(dataset, "area", seed)
        assert 0.14 < len(parts.test) / len(at) < 0.27 and 0.04 < len(parts.validation) / len(parts.known) < 0.21
        assert sorted([*parts.known, *parts.test]) == list(range(len(at)))
        for first, second in (("train", "test"), ("train", "validation"), ("validation", "test")):
            one, other = ({tuple(place) for place in at[getattr(parts, part)]} for part in (first, second))
            assert not one & other  # no place is in two parts


@pytest.mark.parametrize("seed", range(6))
def test_rounding_does_not_decide_about_areas(places, seed):
    """Positions of a grid are as near to one centre as to another. Another origin rounds all distances otherwise."""
    here = places["grid"]
    there = here + np.array([1.7, -0.3, 0.9])
    one, other = (split(dataset_of(at, np.ones((len(at), 16), complex)), "area", seed) for at in (here, there))
    assert np.array_equal(one.test, other.test) and np.array_equal(one.validation, other.validation)


def test_too_few_places_for_areas_are_refused(line):
    few = replace(line, places=np.repeat(line.positions[: 2 * AREAS - 1], 3, axis=0)[:40])
    with pytest.raises(InputError, match="expected at least 20 positions for the split area, found 14"):
        split(few, "area", seed=0)
