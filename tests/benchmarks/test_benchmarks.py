"""Every benchmark runs as its documentation says, at its smallest size, and prints one JSON object."""

import json
import shutil
from pathlib import Path

import pytest

pytestmark = pytest.mark.benchmark

ROOT = Path(__file__).parents[2]
BENCHMARKS = sorted(path.name for path in (ROOT / "benchmarks").glob("*.py"))

ARGUMENTS = {
    "diffraction.py": ["--figure", "{folder}/diffraction.png", "--smallest"],
    "front.py": ["--figure", "{folder}/front.png", "--smallest"],
    "fullwave.py": ["--ship", "{folder}/field", "--smallest"],
    "gallery.py": ["--figures", "{folder}", "--smallest"],
    "grid.py": ["{dataset}", "--smallest"],
    "ladder.py": ["{dataset}", "{dataset}", "--smallest"],
    "limits.py": ["{dataset}", "{dataset}", "--smallest"],
    "interval_coverage.py": ["{dataset}", "--smallest"],
    "locate.py": ["{dataset}", "{dataset}", "--smallest"],
    "mechanisms.py": ["--figures", "{folder}", "--smallest"],
    "paper_size.py": ["{dataset}", "--figure", "{folder}/paper.png", "--smallest"],
    "path.py": ["{dataset}", "--smallest"],
    "plateau.py": ["{dataset}", "{dataset}", "--figure", "{folder}/plateau.png", "--smallest"],
    "prediction_speed.py": ["{dataset}", "--smallest"],
    "random_rooms.py": ["--weights", "{folder}/weights.json", "--smallest"],
    "robustness.py": ["{dataset}", "{dataset}", "--smallest"],
    "render.py": ["--figure", "{folder}/render.png", "--smallest"],
    "results.py": ["--runs", "{folder}/runs", "--docs", "{folder}", "--ledger", "{folder}/results.json"],
    "spacing.py": ["{dataset}", "--figure", "{folder}/expected-score.png", "--smallest"],
    "split_distances.py": ["{dataset}", "--smallest"],
    "simulation.py": ["--figure", "{folder}/simulation.png", "--smallest"],
    "train.py": ["{dataset}", "--smallest"],
    "view.py": ["{run}", "--smallest"],
}
"""What is typed after the name, where that is not --smallest alone."""


@pytest.mark.parametrize("name", BENCHMARKS)
def test_benchmark_prints_one_json_object(name, run_python, small_dataset, short_run, tmp_path):
    shutil.copy(ROOT / "benchmarks" / "ledger" / "results.json", tmp_path)
    places = {"dataset": small_dataset, "run": short_run, "folder": tmp_path}
    arguments = [each.format(**places) for each in ARGUMENTS.get(name, ["--smallest"])]
    figures = json.loads(run_python(f"benchmarks/{name}", *arguments, "--json"))
    assert isinstance(figures, dict) and figures
    for figure in [each for each in arguments if each.endswith(".png")]:
        assert Path(figure).stat().st_size > 1000


def test_help_of_every_benchmark_starts_without_lightning(run_python):
    script = (
        "import contextlib, runpy, sys\n"
        "sys.path.insert(0, 'benchmarks')\n"
        "names, sys.argv[1:] = sys.argv[1:], ['--help']\n"
        "for name in names:\n"
        "    with contextlib.suppress(SystemExit):\n"
        "        runpy.run_path(f'benchmarks/{name}', run_name='__main__')\n"
        "print('lightning' in sys.modules)"
    )
    printed = run_python("-c", script, *BENCHMARKS)
    assert printed.count("usage:") == len(BENCHMARKS)
    assert printed.endswith("False\n")
