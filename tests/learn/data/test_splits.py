"""Splits: disjoint, complete, deterministic, and blocked ones without neighbours across the cut."""

from pathlib import Path

import numpy as np
import pytest

from learn.data.splits import split
from scenes.files.errors import InputError
from simulate.dataset.dataset import Dataset
from simulate.dataset.receivers import ArrayReceiver

KINDS = ("files", "random", "blocked")


def make(count, train=None, test=None):
    """A dataset of which only names and index files matter."""
    train = np.arange(0, count - count // 5) if train is None else np.array(train, dtype=int)
    test = np.arange(count - count // 5, count) if test is None else np.array(test, dtype=int)
    names = [f"{number:05d}" for number in range(1, count + 1)]
    nothing = np.broadcast_to(np.uint8(0), (count, 90, 360))
    gateway = ArrayReceiver(np.zeros(3), np.zeros(4))
    return Dataset(Path("folder"), names, {"spectrum": nothing}, gateway, np.zeros((count, 3)), train, test)


@pytest.mark.parametrize("count", [40, 163, 500])
@pytest.mark.parametrize("kind", KINDS)
def test_parts_are_disjoint_and_complete(kind, count):
    parts = split(make(count), kind, seed=1)
    together = np.concatenate([parts.train, parts.validation, parts.test])
    assert sorted(together) == list(range(count))
    assert min(len(parts.train), len(parts.validation), len(parts.test)) > 0
    assert sorted(parts.known) == sorted(set(range(count)) - set(parts.test))


def test_files_split_tests_on_the_folders_own_test_index():
    shuffled = np.random.default_rng(0).permutation(50)
    parts = split(make(50, shuffled[:30], shuffled[30:44]), "files", seed=1)
    assert sorted(parts.test) == sorted(shuffled[30:44])
    assert sorted(parts.known) == sorted(shuffled[:30])  # six spectra are in neither file


def test_random_split_tests_on_a_fifth_drawn_from_everywhere():
    parts = split(make(500), "random", seed=1)
    assert len(parts.test) == 100
    assert np.histogram(parts.test, bins=5, range=(0, 500))[0].min() >= 10
    assert not np.array_equal(parts.test, split(make(500), "random", seed=2).test)


def test_blocked_split_holds_out_every_fourth_run_of_ten():
    parts = split(make(163), "blocked", seed=1)
    expected = [*range(10, 20), *range(50, 60), *range(90, 100), *range(130, 140)]
    assert parts.test.tolist() == expected
    assert parts.test.tolist() == split(make(163), "blocked", seed=2).test.tolist()


@pytest.mark.parametrize("kind", KINDS)
def test_validation_is_a_tenth_of_the_training_part_and_none_of_the_test_part(kind):
    parts = split(make(1600), kind, seed=1)
    assert len(parts.validation) == pytest.approx(0.1 * len(parts.known), abs=10)


def test_blocked_validation_is_whole_runs_of_ten():
    parts = split(make(1603), "blocked", seed=1)
    runs = {index // 10 for index in parts.validation}
    assert sorted(parts.validation) == [i for run in sorted(runs) for i in range(10 * run, min(10 * run + 10, 1603))]
    assert len(runs) > 1


@pytest.mark.parametrize("kind", KINDS)
def test_split_is_decided_by_the_seed(kind):
    first, again, other = (split(make(200), kind, seed) for seed in (5, 5, 6))
    for part in ("train", "validation", "test"):
        np.testing.assert_array_equal(getattr(first, part), getattr(again, part))
    assert not np.array_equal(first.validation, other.validation)


@pytest.mark.parametrize(
    ("kind", "count"), [("files", 1), ("files", 5), ("random", 1), ("random", 2), ("blocked", 10), ("blocked", 20)]
)
def test_too_few_spectra_are_refused_with_their_number(kind, count):
    # files: 5 spectra, of which 4 are for testing
    dataset = make(5, [0], [1, 2, 3, 4]) if (kind, count) == ("files", 5) else make(count)
    with pytest.raises(InputError, match=f"folder: expected enough spectra for a {kind} split .* found {count}"):
        split(dataset, kind, seed=0)


@pytest.mark.parametrize("kind", KINDS)
def test_a_cut_training_part_leaves_baselines_no_more_to_copy_from(kind):
    whole, less, least = (split(make(1600), kind, seed=1, train_size=size) for size in (None, 400, 100))
    assert len(less.train) == 400 and len(least.train) == 100
    assert set(least.train) <= set(less.train) <= set(whole.train)
    assert len(least.known) == pytest.approx(100 / 0.9, abs=2)
    assert set(least.validation) <= set(less.validation) <= set(whole.validation)
    np.testing.assert_array_equal(least.test, whole.test)
