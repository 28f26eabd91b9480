"""The page of ``bisplat demo`` from its first minute to its end."""

import pytest

from learn.reports.demo_report import DemoReport
from scenes.drawing.scene_drawing import draw_scene
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


def test_first_look_is_shown_until_the_dataset_has_spectra(report):
    (report.folder / "first_look.png").write_bytes((report.folder / "scene.png").read_bytes())
    report.write(["the scores"])
    assert "traced quickly" in report.path.read_text()
    (report.folder / "spectra.png").write_bytes((report.folder / "first_look.png").read_bytes())
    report.write(["the scores"])
    page = report.path.read_text()
    assert "traced quickly" not in page and "first six spectra of the dataset" in page and page.count("<img") == 2
