"""A run knows its dataset: one that was replaced is refused, one that moved is found again."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from learn.comparison.compare import compare
from learn.evaluation.crossvalidate import crossvalidate
from learn.evaluation.evaluate import evaluate
from learn.planning.next_positions import plan
from learn.training.train import train_run
from learn.view.subject import subject
from scenes.files.errors import InputError
from simulate.dataset.dataset_folder import read_dataset

pytestmark = pytest.mark.usefixtures("small_models")


@pytest.fixture
def replaced(tmp_path, tiny, finished_run) -> Callable[..., tuple[Path, Path]]:
    """Function: a copy of the run, and a copy of its dataset in whose place other spectra may be put."""

    def copy() -> tuple[Path, Path]:
        run, data = shutil.copytree(finished_run, tmp_path / "run"), shutil.copytree(tiny, tmp_path / "data")
        config = json.loads((run / "config.json").read_text())
        (run / "config.json").write_text(json.dumps(config | {"dataset": str(data)}))
        return run, data

    return copy


def put_other_spectra(data: Path) -> None:
    """Exchange two pictures: names, positions and files are all valid."""
    one, other = (data / "spectrum" / f"{name}.png" for name in ("00001", "00024"))
    first = one.read_bytes()
    one.write_bytes(other.read_bytes())
    other.write_bytes(first)


def test_run_on_a_dataset_that_was_replaced_is_refused(replaced, tiny_config):
    run, data = replaced()
    put_other_spectra(data)
    words = f"{data}: expected the dataset that {run} was trained on, found other spectra"
    same = replace(tiny_config, dataset=str(data))
    for use in (
        lambda: evaluate(run),
        lambda: evaluate(run, data),
        lambda: crossvalidate(run, "closet"),
        lambda: plan(run, 2),
        lambda: train_run(same, run),
    ):
        with pytest.raises(InputError, match=words):
            use()
    assert words.removesuffix(" spectra") in subject(str(run)).missing[0]


@pytest.mark.usefixtures("no_ceiling")
def test_dataset_that_moved_is_known_by_its_spectra(replaced, tiny):
    run, data = replaced()
    moved = data.rename(data.with_name("moved"))
    with pytest.raises(InputError, match=f"{data}: .*nothing there; if it has moved, write .* in {run}/config.json"):
        evaluate(run)
    assert sorted(evaluate(run, moved).test) == sorted(read_dataset(tiny).test)
    (run / "config.json").write_text((run / "config.json").read_text().replace(str(data), str(moved)))
    assert len(evaluate(run).test) == 5
    put_other_spectra(moved)
    (run / "config.json").write_text((run / "config.json").read_text().replace(str(moved), str(data)))
    with pytest.raises(InputError, match=f"{data}: expected the dataset that {run} .* found nothing there"):
        evaluate(run, moved)


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"frequency_hz": 2.4e9}, "expected a run at 2400 MHz, found one at 915 MHz"),
        ({"array": {"rows": 4, "columns": 4, "spacing": 0.4}}, "expected a run of 4 × 4 elements 0.4 λ apart on"),
    ],
)
def test_training_does_not_start_from_another_receiver(stated, words, finished_run, tiny, tiny_config, tmp_path):
    data = shutil.copytree(tiny, tmp_path / "data")
    (data / "metadata.json").write_text(json.dumps(stated))
    by_steps = replace(tiny_config.by_steps, init=str(finished_run))
    with pytest.raises(InputError, match=f"{finished_run}: {words}"):
        train_run(replace(tiny_config, dataset=str(data), by_steps=by_steps), tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.usefixtures("no_ceiling")
def test_experiment_is_not_continued_on_other_spectra(tiny, tmp_path):
    data = shutil.copytree(tiny, tmp_path / "data")
    compare(data, ["nearest"], output=tmp_path / "out")
    put_other_spectra(data)
    with pytest.raises(InputError, match=f"{data}: expected the data with which {tmp_path / 'out'} was begun"):
        compare(data, ["mean-picture"], output=tmp_path / "out")
