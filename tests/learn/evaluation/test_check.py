"""A dataset folder is checked without an error, whatever is wrong with it."""

import numpy as np
import pytest

from learn.data.splits import split
from learn.evaluation.check import check
from scenes.files.errors import InputError


def test_check_of_a_good_folder_describes_it(tiny):
    found = check(str(tiny))
    assert found.valid and found.problems == [] and len(found.dataset.names) == 24
    assert found.split.leakage.distance.shape == found.split.leakage.ssim.shape == (5,)
    described = found.description()
    assert described["training / test"] == "19 / 5" and described["gateway looks along"] == "[0.0, 0.0, 1.0]"
    assert described["copying the nearest"] == found.split.leakage.similarity()
    assert described["test positions"] == found.split.distances.sentence() and described["split"] == "the folder's own"


def test_check_of_another_split_tells_what_train_would_use(tmp_path, write_folder):
    folder = write_folder(tmp_path / "path", count=60)
    found = check(folder, "blocked", seed=2)
    parts = split(found.dataset, "blocked", 2)
    assert np.array_equal(found.split.parts.test, parts.test) and np.array_equal(found.split.parts.train, parts.train)
    positions = found.dataset.positions
    each = np.linalg.norm(positions[parts.test][:, None] - positions[parts.known], axis=-1).min(axis=1)
    assert found.split.distances.distance == pytest.approx(each)
    figures = found.figures()["split"]
    assert [figures[part] for part in ("kind", "train", "validation", "test")] == ["blocked", 30, 10, 20]
    assert figures["test_to_known_least_m"] == pytest.approx(each.min(), abs=1e-4)
    assert figures["test_nearer_than_half_a_wavelength"] == (each < found.dataset.wavelength / 2).sum()
    assert found.description()["training / validation / test"] == "30 / 10 / 20"


def test_check_of_another_split_warns_once_of_near_positions(tmp_path, write_folder):
    folder = write_folder(tmp_path / "path", count=60)
    near = check(folder, "blocked")
    assert not near.split.leakage.leaks and near.warnings == [near.split.distances.warning()]
    leaking = check(folder, "random")
    assert leaking.split.leakage.leaks and leaking.warnings == [leaking.split.leakage.warning()]


def test_a_guard_changes_what_check_finds(tmp_path, write_folder):
    folder = write_folder(tmp_path / "path", count=60)
    least = check(folder, "blocked").split.distances.distance.min()
    wavelength = check(folder).dataset.wavelength
    guarded = check(folder, "blocked", guard=1.01 * least / wavelength)
    assert guarded.split.distances.distance.min() > 1.01 * least * (1 - 1e-9)
    with pytest.raises(InputError, match="expected a guard that leaves training and validation spectra"):
        check(folder, "blocked", guard=100)
