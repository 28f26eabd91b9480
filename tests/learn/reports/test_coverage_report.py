"""What ``bisplat predict --map`` writes: arrays and figures."""

import json
import shutil

import numpy as np
import pytest
from PIL import Image

import bisplat
from learn.reports import coverage_report
from scenes.files.errors import InputError


@pytest.fixture(scope="module")
def coverage(tmp_path_factory):
    """A map of two gateways whose names have characters that XML and figures escape."""
    generator = np.random.default_rng(0)
    places = generator.uniform((1, 1, 1), (4, 3, 1.5), (40, 3))
    gateways = {"Küche & <hall>": (0.0, 0, 2), "$roof_1$": (9.0, 0, 2)}
    powers = -40 - 20 * np.log10(np.linalg.norm(places[:, None] - list(gateways.values()), axis=-1))
    powers[powers < -57] = np.nan
    folder = tmp_path_factory.mktemp("coverage") / "yard"
    return bisplat.coverage_map(
        bisplat.write_dataset(folder, places, powers=powers, gateways=gateways, frequency=2.4e9, floor_dbm=-57),
        step=0.5,
    )


@pytest.fixture
def undrawn(monkeypatch):
    """Without the figures, which take a second."""
    for name in ("draw_coverage", "draw_intervals"):
        monkeypatch.setattr(coverage_report, name, lambda *arguments: None)


def test_arrays_are_those_of_the_map(coverage, undrawn, tmp_path):
    bisplat.export(coverage, tmp_path / "map")
    with np.load(tmp_path / "map" / "coverage.npz") as stored:
        for name in ("median", "low", "high", "x", "y", "inside", "strongest"):
            np.testing.assert_array_equal(stored[name], getattr(coverage, name))
        assert stored["gateway_names"].tolist() == coverage.dataset.gateway_names
        assert stored["height"] == coverage.height and stored["floor_dbm"] == -57


def test_figures_are_there_with_a_scene_and_without_intervals(coverage, tmp_path):
    bisplat.export(coverage, tmp_path / "map", scene=bisplat.load_scene("lab"))
    files = {path.name for path in (tmp_path / "map").iterdir()}
    assert files == {
        "coverage.npz",
        *(f"{a}.{b}" for a in ("coverage", "interval") for b in ("png", "pdf")),
    }
    pixels = np.asarray(Image.open(tmp_path / "map" / "coverage.png").convert("RGB")).reshape(-1, 3)
    assert len(np.unique(pixels, axis=0)) > 300
    grey = round(0.82 * 255)
    assert (pixels == grey).all(axis=1).mean() > 0.005  # where nothing is received


def test_method_without_intervals_has_medians_alone(coverage, tmp_path, monkeypatch):
    monkeypatch.setattr(coverage_report, "draw_coverage", lambda *arguments: None)
    plain = bisplat.coverage_map(coverage.dataset, step=0.5, method="mean")
    bisplat.export(plain, tmp_path / "map")
    assert {path.name for path in (tmp_path / "map").iterdir()} == {"coverage.npz"}
    with np.load(tmp_path / "map" / "coverage.npz") as stored:
        assert stored["median"].shape == plain.median.shape and "low" not in stored


def test_scene_of_the_folder_is_drawn_or_said_to_be_unreadable(coverage, tmp_path, monkeypatch, capsys):
    drawn = []
    monkeypatch.setattr(coverage_report, "draw_coverage", lambda coverage, path, scene: drawn.append(scene))
    monkeypatch.setattr(coverage_report, "draw_intervals", lambda *arguments: None)
    folder = shutil.copytree(coverage.dataset.folder, tmp_path / "yard")
    metadata = json.loads((folder / "metadata.json").read_text())
    (folder / "metadata.json").write_text(json.dumps({**metadata, "scene_file": "scene/scene.yaml"}))
    bisplat.write_scene(bisplat.load_scene("closet"), folder / "scene")
    bisplat.export(bisplat.coverage_map(folder, step=1.0, method="mean"), tmp_path / "one")
    shutil.rmtree(folder / "scene")
    bisplat.export(bisplat.coverage_map(folder, step=1.0, method="mean"), tmp_path / "two")
    assert drawn[0].name == "closet" and drawn[1] is None
    assert "the map is drawn without its scene, which cannot be read" in capsys.readouterr().err


def test_folder_with_other_files_is_refused_unless_forced(coverage, undrawn, tmp_path):
    (tmp_path / "map").mkdir()
    (tmp_path / "map" / "coverage.npz").write_text("mine")
    with pytest.raises(InputError, match="expected a new folder, found other files"):
        bisplat.export(coverage, tmp_path / "map")
    bisplat.export(coverage, tmp_path / "map", force=True)
    assert np.load(tmp_path / "map" / "coverage.npz")["median"].shape == coverage.median.shape
