"""``bisplat view`` in a real headless Chromium: what a user sees, drags and reads."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect, sync_playwright

from learn.run import load_run
from learn.train import train
from scenes.description import Gateway, Scene, SceneObject, Transmitter, facing
from scenes.materials import p2040_material
from scenes.shapes import sheet
from scenes.stage import from_outside
from simulate.dataset import read_dataset
from simulate.generate import generate
from simulate.propagation import Propagation
from simulate.request import Request

CHROMIUM = shutil.which("chromium")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here: apt-get install chromium")

QUIET = (
    "--no-sandbox --disable-quic --no-first-run --disable-background-networking --disable-component-update "
    "--disable-sync --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader"
).split()
"""No GPU, no root's sandbox, nothing that looks for Google."""

PATIENCE = 60_000
"""Milliseconds; WebGL in software on a busy machine is slow."""

SHOTS = os.environ.get("BISPLAT_SCREENSHOTS")
"""Folder to keep screenshots in: those of the README are made so."""


@pytest.fixture(scope="module")
def room() -> Scene:
    """Floor, two walls and a table."""
    concrete, wood = (p2040_material(name, 915e6) for name in ("concrete", "wood"))
    return Scene(
        name="nook",
        frequency=915e6,
        gateway=Gateway((0.05, 1.5, 1.4), facing((1, 0, 0))),
        transmitter=Transmitter((1.2, 0.8, 0.9), (2.6, 2.2, 1.6)),
        objects=(
            SceneObject("floor", sheet((0, 0, 0), (3, 0, 0), (0, 3, 0)), "concrete"),
            SceneObject("wall", sheet((0, 3, 0), (3, 0, 0), (0, 0, 2.4)), "concrete"),
            SceneObject("back", sheet((0, 0, 0), (0, 3, 0), (0, 0, 2.4)), "concrete"),
            SceneObject("table", sheet((1.2, 0.8, 0.7), (1.0, 0, 0), (0, 1.2, 0)), "wood"),
        ),
        materials={"concrete": concrete, "wood": wood},
    )


@pytest.fixture(scope="module")
def run(room, small, tiny_config, tmp_path_factory) -> Path:
    """A small model, trained a little on spectra traced in the room."""
    folder = tmp_path_factory.mktemp("view")
    low, high = room.transmitter.region_min, room.transmitter.region_max
    positions = np.random.default_rng(0).uniform(low, high, (40, 3))
    generate(Request(room, positions, "uniform", Propagation(max_depth=1, rays=20_000), 0), folder / "nook")
    config = replace(tiny_config, dataset=str(folder / "nook"), size=asdict(small), steps=30)
    train(config, folder / "run")
    return folder / "run"


class Viewer:
    """A ``bisplat view`` in a process of its own."""

    def __init__(self, what: Path | str, port: int):
        self.process = subprocess.Popen(
            [sys.executable, "-m", "bisplat", "view", str(what), "--port", str(port)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=Path(__file__).parents[2],
            env={**os.environ, "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"},
        )
        assert self.process.stdout is not None
        self.said = self.process.stdout.readline()
        found = re.search(r"http://127\.0\.0\.1:(\d+)", self.said)
        assert found, self.process.communicate()[1]
        self.url, self.port = found.group(), int(found.group(1))

    def end(self) -> tuple[int, str]:
        """Ctrl-C; the exit status and what was said on stderr."""
        self.process.send_signal(signal.SIGINT)
        _, errors = self.process.communicate(timeout=30)
        return self.process.returncode, errors


@pytest.fixture(scope="module")
def viewer(run) -> Iterator[Viewer]:
    started = Viewer(run, 8650)
    yield started
    if started.process.poll() is None:
        started.end()


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET)
        yield started
        started.close()


@pytest.fixture(scope="module")
def open_tab(browser) -> Iterator[Callable[[str], Page]]:
    """Function: url -> a tab whose first picture is there. No tab may have had an error."""
    errors = []

    def open_page(url: str) -> Page:
        page = browser.new_context(viewport={"width": 1100, "height": 720}).new_page()
        page.set_default_timeout(PATIENCE)
        page.on("console", lambda message: message.type == "error" and errors.append(message.text))
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(url)
        expect(page.get_by_text("dominant direction").first).to_be_visible(timeout=PATIENCE)
        return page

    yield open_page
    assert not [each for each in errors if "ERR_FILE_NOT_FOUND" not in each]  # viser drops a picture that is overtaken


@pytest.fixture(scope="module")
def tab(viewer, open_tab) -> Page:
    """A tab of the viewer."""
    return open_tab(viewer.url)


PICTURE = "img[src^='blob:']"
NUMBERS = "p:has-text('dominant direction azimuth')"


def change(page: Page, act: Callable[[], None]) -> None:
    """Do something that must change the picture in the panel."""
    before = page.locator(PICTURE).get_attribute("src") or ""
    act()
    expect(page.locator(PICTURE)).not_to_have_attribute("src", before, timeout=PATIENCE)


def handle_on_screen(page: Page, run: Path, room: Scene) -> tuple[float, float]:
    """Where the arrow along x of the transmitter's handle is: seen by a camera of 75° from where the viewer puts it."""
    dataset = read_dataset(json.loads((run / "config.json").read_text())["dataset"])
    seen = np.vstack([dataset.positions, room.gateway.position, room.bounds])
    bounds = np.stack([seen.min(axis=0), seen.max(axis=0)])
    camera, look_at = from_outside(bounds)
    arrow = dataset.positions[0] + [0.06 * np.linalg.norm(bounds[1] - bounds[0]), 0, 0]
    ahead = (look_at - camera) / np.linalg.norm(look_at - camera)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    canvas = page.locator("canvas").first.bounding_box()
    assert canvas is not None
    pixels = canvas["height"] / 2 / np.tan(np.radians(75) / 2) / ((arrow - camera) @ ahead)
    x = canvas["x"] + canvas["width"] / 2 + pixels * ((arrow - camera) @ right)
    y = canvas["y"] + canvas["height"] / 2 - pixels * ((arrow - camera) @ up)
    return float(x), float(y)


def type_position(page: Page, *position: float) -> None:
    fields = page.locator("input[inputmode=decimal], input[type=number]")
    for index, value in enumerate(position):
        fields.nth(index).fill(f"{value}")
        fields.nth(index).press("Enter")


def drag(page: Page, x: float, y: float) -> None:
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 6):
        page.mouse.move(x + 10 * step, y - 5 * step)
    page.mouse.up()


def keep(page: Page, name: str) -> np.ndarray:
    """A screenshot, kept where ``BISPLAT_SCREENSHOTS`` says."""
    shot = page.screenshot(timeout=PATIENCE)
    if SHOTS:
        (Path(SHOTS) / f"{name}.png").write_bytes(shot)
    return np.asarray(Image.open(BytesIO(shot)).convert("RGB"))


def test_page_shows_room_and_spectra(tab):
    expect(tab.get_by_text("SSIM").first).to_be_visible()
    shot = keep(tab, "view")
    room, panel = shot[:, :680], shot[:, 720:]
    assert len(np.unique(room.reshape(-1, 3), axis=0)) > 100 and room.std() > 5
    assert len(np.unique(panel.reshape(-1, 3), axis=0)) > 300


def test_numbers_shown_are_those_of_bisplat_predict(tab, run):
    change(tab, lambda: type_position(tab, 1.75, 1.25, 1.3))
    predicted = load_run(run).predict(np.array([[1.75, 1.25, 1.3]]))[0]
    elevation, azimuth = np.unravel_index(predicted.argmax(), predicted.shape)
    expected = f"predicted: dominant direction azimuth {azimuth}°, elevation {elevation + 1}°"
    expect(tab.get_by_text(expected)).to_be_visible()


def test_tabs_have_states_of_their_own(tab, viewer, run, room, open_tab):
    numbers = tab.locator(NUMBERS).inner_text()
    second = open_tab(viewer.url)
    others = second.locator(NUMBERS).inner_text()
    change(second, lambda: drag(second, *handle_on_screen(second, run, room)))
    expect(second.locator(NUMBERS)).not_to_have_text(others)
    expect(second.get_by_text("ray-traced:")).to_be_visible()
    assert tab.locator(NUMBERS).inner_text() == numbers
    second.context.close()


def test_run_without_its_scene_says_so_on_another_port_until_interrupted(run, viewer, tmp_path, open_tab):
    copy = shutil.copytree(run, tmp_path / "run")
    config = json.loads((copy / "config.json").read_text())
    data = shutil.copytree(config["dataset"], tmp_path / "data")
    shutil.rmtree(data / "scene")
    (copy / "config.json").write_text(json.dumps({**config, "dataset": str(data)}))
    other = Viewer(copy, viewer.port)
    try:
        assert other.port != viewer.port
        expect(open_tab(other.url).get_by_text("The scene of this dataset is not there")).to_be_visible()
    finally:
        status, errors = other.end()
    assert status == 0 and f"port {viewer.port} is taken" in errors and "Traceback" not in errors
