"""A new engine is one file and one line: the command line, metadata.json and cross-validation find it."""

import inspect
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import bisplat
from scenes.files.errors import InputError, ParameterError
from simulate.dataset.metadata import read_metadata_file
from simulate.engines.engine_table import ENGINES
from simulate.generation.simulation import simulate
from tests.folders import contents
from tests.simulate.engines.free_space import FreeSpace, FreeSpaceField

ROOT = Path(__file__).parents[3]

COMMAND = """
import sys
from simulate.engines.engine_table import ENGINES
from tests.folders import contents
from tests.simulate.engines.free_space import FreeSpace
ENGINES[FreeSpace.name] = FreeSpace  # the one line
from bisplat.__main__ import main
main()
"""


@pytest.fixture
def known(monkeypatch):
    monkeypatch.setitem(ENGINES, FreeSpace.name, FreeSpace)


def command(*words: object) -> str:
    program = [sys.executable, "-c", COMMAND, *map(str, words)]
    return subprocess.run(program, cwd=ROOT, capture_output=True, text=True, check=True).stdout


def test_the_command_line_has_it(tmp_path):
    helped = command("simulate", "--help")
    assert "{rays,fullwave,freespace}" in helped and "what a cable takes, dB" in helped
    command("simulate", "closet", "-o", tmp_path / "data", "-n", 12, "--engine", "freespace", "--loss", 3)
    metadata = json.loads((tmp_path / "data" / "metadata.json").read_text())
    assert metadata["engine"] == "freespace" and metadata["freespace"] == {"loss": 3.0}
    assert set(metadata["versions"]) == {"numpy"}


def test_python_has_it_and_its_dataset_is_made_again_with_the_same_bytes(known, tmp_path):
    dataset = simulate("closet", tmp_path / "a", n=12, engine="freespace", loss=3.0)
    expected = FreeSpaceField(bisplat.load_scene("closet"), 3).responses(dataset.positions)
    assert np.array_equal(dataset.responses, expected)
    simulate("closet", tmp_path / "b", 12, engine=FreeSpace(loss=3.0))
    assert contents(tmp_path / "b") == contents(tmp_path / "a")
    simulate(tmp_path / "a", tmp_path / "again")
    assert contents(tmp_path / "again") == contents(tmp_path / "a")
    (tmp_path / "b" / "spectrum" / "00003.png").unlink()
    simulate("closet", tmp_path / "b", n=12, engine="freespace", loss=3.0)
    assert contents(tmp_path / "b") == contents(tmp_path / "a")


@pytest.mark.slow
def test_crossvalidation_takes_it_from_the_dataset(known, tmp_path):
    dataset = simulate("closet", tmp_path / "data", n=40, engine="freespace")
    run = bisplat.train(dataset, tmp_path / "run", split="random")
    fresh = bisplat.crossvalidate(run, "closet", positions=6)
    assert fresh.truth_by == "free space" and fresh.metrics()["channel_correlation_median"] > 0.99


def test_its_part_of_metadata_is_checked(known, tmp_path):
    path = tmp_path / "metadata.json"
    for content, sentence in (('{"loss": -1}', "freespace.loss: .* found -1"), ('{"gain": 1}', "found 'gain'")):
        path.write_text(f'{{"freespace": {content}}}')
        with pytest.raises(InputError, match=sentence):
            read_metadata_file(path, "settings")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"loss": 3}, "loss: expected none, or the engine freespace, found 3 for rays"),
        ({"engine": "freespace", "loss": -1}, "loss: expected a loss in dB from 0 to 100, found -1"),
        ({"engine": FreeSpace(), "cell": 0.1}, "cell: expected it as an argument of the engine, found 0.1"),
        ({"engine": FreeSpace(), "frequencies": (1e9, 2e9)}, "frequencies: .* engine freespace"),
        ({"engine": FreeSpace(), "bandwidth": 2e7, "subcarriers": 4}, "bandwidth: .* engine freespace"),
        ({"engine": "freespace", "lost": 3}, "lost: "),
    ],
)
def test_options_that_do_not_fit_are_refused(known, tmp_path, options, sentence):
    with pytest.raises(ParameterError, match=sentence):
        simulate("closet", tmp_path / "data", n=4, **options)
    assert not list(tmp_path.iterdir())


def test_an_option_stands_in_signature_and_docstring():
    """Those of the engines in the table when the function was defined."""
    parameters = inspect.signature(simulate).parameters
    assert parameters["cell"].default is None and parameters["seed"].default == 0
    assert "cell: side of the cells in full wave, metres" in inspect.getdoc(simulate)
