"""Every benchmark runs as its documentation says, at its smallest size, and prints one JSON object."""

import json
import shutil
from pathlib import Path

import pytest

pytestmark = pytest.mark.benchmark

ROOT = Path(__file__).parents[2]
BENCHMARKS = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for path in (ROOT / "benchmarks").rglob("*.py")
    if path.name != "__init__.py" and path.parent.name != "ledger"
)

ARGUMENTS = {
    "diffraction": ["--figure", "{folder}/diffraction.png", "--smallest"],
    "front": ["--figure", "{folder}/front.png", "--smallest"],
    "fullwave": ["--ship", "{folder}/field", "--smallest"],
    "gallery": ["--figures", "{folder}", "--smallest"],
    "grid": ["{dataset}", "--smallest"],
    "ladder": ["{dataset}", "{dataset}", "--smallest"],
    "limits": ["{dataset}", "{dataset}", "--smallest"],
    "interval_coverage": ["{dataset}", "--smallest"],
    "locate": ["{dataset}", "{dataset}", "--smallest"],
    "mechanisms": ["--figures", "{folder}", "--smallest"],
    "paper_size": ["{dataset}", "--figure", "{folder}/paper.png", "--smallest"],
    "path": ["{dataset}", "--smallest"],
    "plateau": ["{dataset}", "{dataset}", "--figure", "{folder}/plateau.png", "--smallest"],
    "prediction_speed": ["{dataset}", "--smallest"],
    "random_rooms": ["--weights", "{folder}/weights.json", "--smallest"],
    "robustness": ["{dataset}", "{dataset}", "--smallest"],
    "render": ["--figure", "{folder}/render.png", "--smallest"],
    "results": ["--runs", "{folder}/runs", "--docs", "{folder}", "--ledger", "{folder}/results.json"],
    "spacing": ["{dataset}", "--figure", "{folder}/expected-score.png", "--smallest"],
    "split_distances": ["{dataset}", "--smallest"],
    "simulation": ["--figure", "{folder}/simulation.png", "--smallest"],
    "train": ["{dataset}", "--smallest"],
    "view": ["{run}", "--smallest"],
}
"""What is typed after the name, where that is not --smallest alone."""


@pytest.mark.parametrize("name", BENCHMARKS)
def test_benchmark_prints_one_json_object(name, run_python, small_dataset, short_run, tmp_path):
    shutil.copy(ROOT / "benchmarks" / "ledger" / "results.json", tmp_path)
    places = {"dataset": small_dataset, "run": short_run, "folder": tmp_path}
    arguments = [each.format(**places) for each in ARGUMENTS.get(name.rpartition(".")[2], ["--smallest"])]
    figures = json.loads(run_python("-m", name, *arguments, "--json"))
    assert isinstance(figures, dict) and figures
    for figure in [each for each in arguments if each.endswith(".png")]:
        assert Path(figure).stat().st_size > 1000


def test_help_of_every_benchmark_starts_without_lightning(run_python):
    script = (
        "import contextlib, runpy, sys\n"
        "names, sys.argv[1:] = sys.argv[1:], ['--help']\n"
        "for name in names:\n"
        "    with contextlib.suppress(SystemExit):\n"
        "        runpy.run_module(name, run_name='__main__')\n"
        "print('lightning' in sys.modules)"
    )
    printed = run_python("-c", script, *BENCHMARKS)
    assert printed.count("usage:") == len(BENCHMARKS)
    assert printed.endswith("False\n")
