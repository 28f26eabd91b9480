"""The page of ``bisplat demo`` from its first minute to its end."""

from learn.reports.demo_report import DemoReport
from scenes.drawing.scene_drawing import draw_scene
from tests.small_scene import small_scene


def test_page_shows_the_scene_then_the_first_look_then_the_dataset(tmp_path):
    report = DemoReport(tmp_path, small_scene(), 12)
    draw_scene(report.scene, tmp_path / "scene.png")
    report.write(["six spectra", "the scores of <model>"])
    page = report.path.read_text()
    assert page.count("<img") == 1 and 'http-equiv="refresh"' in page
    assert "<li>six spectra</li><li>the scores of &lt;model&gt;</li>" in page
    (report.folder / "first_look.png").write_bytes((report.folder / "scene.png").read_bytes())
    report.write(["the scores"])
    assert "traced quickly" in report.path.read_text()
    (report.folder / "spectra.png").write_bytes((report.folder / "first_look.png").read_bytes())
    report.write(["the scores"])
    page = report.path.read_text()
    assert "traced quickly" not in page and "first six spectra of the dataset" in page and page.count("<img") == 2
