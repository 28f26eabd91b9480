"""The page of ``bisplat demo`` from its first minute to its end, and what the demo says last."""

import re

import numpy as np
import pytest

from bisplat.commands.demo_run import next_steps
from learn.reports.demo_report import SHOWN, DemoReport, draw_first_look
from scenes.drawing.scene_drawing import draw_scene
from simulate.rays.tracer import Tracer
from tests.small_scene import small_scene


@pytest.fixture
def report(tmp_path) -> DemoReport:
    """The report of a demo that has drawn its scene."""
    scene = small_scene()
    draw_scene(scene, tmp_path / "scene.png")
    return DemoReport(tmp_path, scene, 12)


def test_first_page_shows_the_scene_and_what_is_to_come(report):
    report.write(["six spectra", "the scores of <model>"])
    page = report.path.read_text()
    assert page.count("<img") == 1 and 'http-equiv="refresh"' in page
    assert "<li>six spectra</li><li>the scores of &lt;model&gt;</li>" in page
    assert re.search(r"A spatial spectrum is a picture", page)


def test_first_look_is_shown_until_the_dataset_has_spectra(report, monkeypatch):
    traced = []

    def responses(self, positions):
        traced.append(len(positions))
        return np.exp(1j * np.arange(16 * len(positions))).reshape(-1, 16)

    monkeypatch.setattr(Tracer, "__init__", lambda self, *_, **__: None)
    monkeypatch.setattr(Tracer, "responses", responses)
    draw_first_look(report.scene, np.ones((10, 3)), 0, report.folder)
    assert traced == [SHOWN]
    report.write(["the scores"])
    assert "traced quickly" in report.path.read_text()
    (report.folder / "spectra.png").write_bytes((report.folder / "first_look.png").read_bytes())
    report.write(["the scores"])
    page = report.path.read_text()
    assert "traced quickly" not in page and "first six spectra of the dataset" in page and page.count("<img") == 2


def test_next_steps_name_the_report_and_the_commands(tmp_path):
    lines = next_steps(tmp_path / "demo").splitlines()
    assert any((tmp_path / "demo" / "report.html").as_uri() in line for line in lines)
    assert any(f"bisplat view {tmp_path / 'demo' / 'run'}" in line for line in lines)
    assert any("bisplat train FOLDER" in line for line in lines) and len(lines) <= 7
