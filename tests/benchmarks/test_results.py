"""docs/generated/measurements.md keeps the figures of runs that are not there, and takes those of runs that are."""

import json
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = "generated/measurements.md"
FIGURES = {"ratio": 12.5, "chains": None, "date": "2031-02-03", "machine": "1 core of a test", "smallest": False}


@pytest.fixture
def docs(tmp_path):
    """A folder with the figures that are kept in the repository."""
    folder = tmp_path / "docs"
    folder.mkdir()
    shutil.copy(ROOT / "benchmarks" / "ledger" / "results.json", folder)
    return folder


@pytest.fixture
def make_page(run_python, docs, tmp_path):
    """Function: () -> the names of the sections that benchmarks/results.py updated from runs/."""
    (tmp_path / "runs").mkdir()

    def make():
        told = run_python(
            "-m",
            "benchmarks.results",
            "--runs",
            tmp_path / "runs",
            "--docs",
            docs,
            "--ledger",
            docs / "results.json",
            "--json",
        )
        return json.loads(told)["updated"]

    return make


def sections(page: str) -> dict[str, str]:
    """Text of each section by its heading."""
    return dict(section.split("\n", 1) for section in page.split("\n## ")[1:])


def test_page_without_runs_is_the_one_in_the_repository(make_page, docs):
    assert make_page() == []
    kept = {"results.json": "benchmarks/ledger/results.json", PAGE: f"docs/{PAGE}"}
    for name, path in kept.items():
        assert (docs / name).read_bytes() == (ROOT / path).read_bytes(), "run python -m benchmarks.results"


def test_only_the_section_of_a_run_changes(make_page, docs, tmp_path):
    before = sections((ROOT / "docs" / PAGE).read_text())
    (tmp_path / "runs" / "simulation.json").write_text(json.dumps(FIGURES))
    assert make_page() == ["simulation"]
    first = {name: (docs / name).read_bytes() for name in ("results.json", PAGE)}
    after = sections(first[PAGE].decode())
    assert after.keys() == before.keys()
    (changed,) = [title for title in before if after[title] != before[title]]
    assert "Measured on 2031-02-03, 1 core of a test." in after[changed]
    assert "\n| ratio | 12.5 |\n| chains | – |\n" in after[changed] and "| ssim_median |" not in after[changed]

    assert make_page() == []
    assert first == {name: (docs / name).read_bytes() for name in first}


def test_texts_of_a_table_are_its_conditions(make_page, docs, tmp_path):
    made = {"date": "2031-02-03", "machine": "1 core of a test", "smallest": False, "device": "a GPU of a test"}
    (tmp_path / "runs" / "train.json").write_text(json.dumps({"mlp": {"ratio": 2}, "nerf2": {"steps": 3}, **made}))
    assert make_page() == ["train"]
    section = sections((docs / PAGE).read_text())["Training at all pixels, at few, and from responses"]
    assert "Measured on 2031-02-03, 1 core of a test; device a GPU of a test." in section
    assert "\n| | ratio | steps |\n| --- | --- | --- |\n| mlp | 2 | – |\n| nerf2 | – | 3 |\n" in section


@pytest.mark.benchmark
def test_folder_of_an_experiment_is_read(make_page, docs, tmp_path):
    folder = tmp_path / "runs" / "sweep-closet"
    folder.mkdir()
    protocol = {"dataset": "lab", "split": "blocked", "split_seed": 0, "steps": 7, "device": "1 CPU thread"}
    (folder / "protocol.json").write_text(json.dumps(protocol))
    figures = {"ssim_median": 0.75, "ssim_mean": 0.7, "ssim_p05": 0.5, "psnr_mean": 20, "mae_mean": 0.1}
    rows = [
        {"label": "nearest", "seed": seed, "train_size": 50, "test": 9, **figures, "aoa_error_median_deg": 2.25 + seed}
        for seed in (0, 1)
    ]
    (folder / "results.jsonl").write_text("\n".join(json.dumps({**row, "date": "2031-02-03"}) for row in rows))
    assert make_page() == []  # its picture is not there
    (folder / "sweep.png").write_bytes(b"a picture")
    assert make_page() == ["sweep-closet"]
    section = sections((docs / PAGE).read_text())["How many spectra are needed: the closet in full wave"]
    assert (
        "Measured on 2031-02-03, " in section and "; 1 CPU thread; 7 steps of training each; 9 test spectra." in section
    )
    assert "\n| nearest | – | 0.750 | 0.000 (2) | 0.700 | 0.500 | 20.0 | 0.100 | 2.8 | – | – | – |\n" in section
    assert (docs / "generated" / "sweep-closet.png").read_bytes() == b"a picture"


def test_figures_of_the_smallest_run_are_refused(run_python, docs, tmp_path):
    (tmp_path / "render.json").write_text(json.dumps({**FIGURES, "smallest": True}))
    with pytest.raises(AssertionError, match=r"render\.json: expected the figures of a whole run, found .* --smallest"):
        run_python("-m", "benchmarks.results", "--runs", tmp_path, "--docs", docs, "--ledger", docs / "results.json")
    assert not (docs / PAGE).exists()
