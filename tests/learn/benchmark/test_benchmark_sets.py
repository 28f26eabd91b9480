"""Named benchmark datasets are the frozen ones, or are refused, and an interrupted one is continued."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import bisplat
from learn.benchmark import frozen as frozen_file
from learn.benchmark.benchmark_sets import SETS, benchmarks
from learn.benchmark.frozen import facts_of, freeze, frozen, require_frozen
from learn.benchmark.make_benchmark import make_benchmark
from scenes.files.errors import InputError


@pytest.fixture(scope="module")
def practice(tmp_path_factory) -> Path:
    """The practice dataset."""
    folder = tmp_path_factory.mktemp("sets") / "practice"
    make_benchmark("practice", folder)
    return folder


@pytest.fixture
def own(practice, tmp_path) -> Path:
    """A copy of it to damage."""
    return Path(shutil.copytree(practice, tmp_path / "practice"))


def test_every_set_is_frozen_with_all_its_tasks():
    assert list(frozen()) == list(SETS)
    for name, each in SETS.items():
        assert list(frozen()[name]["tasks"]) == list(each.tasks)
    assert "rssi-office-blocked-200" in benchmarks() and "lab-random" in benchmarks()
    assert len(benchmarks()) == sum(len(each.tasks) for each in SETS.values())


def test_made_set_is_the_frozen_one_and_a_second_call_only_checks(practice, capsys):
    before = {path: path.stat().st_mtime_ns for path in practice.rglob("*.png")}
    dataset = make_benchmark("practice", practice)
    assert len(dataset) == 60 and before == {path: path.stat().st_mtime_ns for path in practice.rglob("*.png")}
    said = capsys.readouterr().err
    assert "practice: identical to the frozen" in said or "as machines do" in said


def test_interrupted_set_is_continued(own):
    content = facts_of("practice", own)
    (own / "benchmark.json").unlink()
    shutil.rmtree(own / "tasks")
    (own / "test_index.txt").unlink()
    (own / "spectrum" / "00007.png").unlink()
    make_benchmark("practice", own)
    assert facts_of("practice", own) == content


def test_a_finished_set_is_only_checked(own):
    damaged = own / "tasks" / "blocked" / "test_index.txt"
    damaged.write_text("00001\n")
    with pytest.raises(InputError, match="expected"):
        make_benchmark("practice", own)
    assert damaged.read_text() == "00001\n"


def test_a_folder_of_other_powers_is_left_alone(tmp_path):
    bisplat.write_rssi(tmp_path / "mine", [[1, 1, 1], [2, 1, 1]], [[-40], [-50]], {"door": (0, 0, 2)}, "915 MHz")
    with pytest.raises(InputError, match="expected a new folder or one of the set rssi-office, found other positions"):
        make_benchmark("rssi-office", tmp_path / "mine")
    assert not (tmp_path / "mine" / "tasks").exists()


def test_task_has_the_parts_of_its_index_files(practice):
    task = bisplat.read_benchmark("practice-blocked", practice)
    listed = (practice / "tasks" / "blocked" / "test_index.txt").read_text().split()
    assert [task.names[row] for row in task.test] == listed
    assert task.test.tolist() == [*range(10, 20), *range(50, 60)] and len(task.train) == 40


def test_values_may_differ_as_machines_do_and_no_more(own):
    rng = np.random.default_rng(0)
    for path in (own / "spectrum").iterdir():
        grey = np.asarray(Image.open(path)).astype(int) + rng.integers(-1, 2, (90, 360))
        Image.fromarray(grey.clip(0, 255).astype(np.uint8)).save(path)
    assert "grey levels, as machines do" in require_frozen("practice", own)
    for path in (own / "spectrum").iterdir():
        Image.fromarray(np.roll(np.asarray(Image.open(path)), 20, axis=1)).save(path)
    with pytest.raises(InputError, match="expected values within 1 grey levels of the benchmark dataset practice"):
        require_frozen("practice", own)


@pytest.mark.parametrize("name", ["tx_pos.csv", "tasks/blocked/test_index.txt"])
def test_changed_positions_and_parts_are_refused(own, name):
    lines = (own / name).read_text().splitlines()
    (own / name).write_text("\n".join([*lines[:-2], lines[-1], lines[-2]]) + "\n")
    with pytest.raises(InputError, match=f"{name}: expected exactly those of the benchmark dataset practice"):
        require_frozen("practice", own)


def test_folder_of_another_set_is_refused(own):
    with pytest.raises(InputError, match="expected a new folder or one of the set lab, found one of the set practice"):
        make_benchmark("lab", own)
    with pytest.raises(InputError, match="expected the benchmark dataset lab, found practice"):
        bisplat.read_benchmark("lab-blocked", own)
    (own / "benchmark.json").write_text(json.dumps({"set": "x"}))
    with pytest.raises(InputError, match=r"benchmark.json: expected the name of a benchmark dataset, found {'set'"):
        bisplat.read_benchmark("lab-blocked", own)


def test_one_benchmark_has_one_frequency(practice):
    with pytest.raises(InputError, match="frequency: expected none for practice-blocked, which has one, found '1 GHz'"):
        bisplat.read_benchmark("practice-blocked", practice, "1 GHz")


def test_facts_are_kept_one_set_to_the_line(practice, tmp_path, monkeypatch):
    monkeypatch.setattr(frozen_file, "FACTS", tmp_path / "frozen.json")
    frozen.cache_clear()
    freeze("practice", practice)
    text = (tmp_path / "frozen.json").read_text()
    assert json.loads(text) == {"practice": facts_of("practice", practice)} and text.count("\n") < 5
    frozen.cache_clear()
