"""Fixtures for pages in Chromium: a command that serves one, a tab, where on screen a point is, a picture."""

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

QUIET = (
    "--no-sandbox --disable-quic --no-first-run --disable-background-networking --disable-component-update "
    "--disable-sync --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader"
).split()
"""No GPU, no sandbox (root has none), nothing that looks for servers elsewhere."""


PATIENCE = 180_000  # Milliseconds; WebGL in software on a busy machine is slow


class Served:
    """A ``bisplat`` command that serves a page, in a process of its own."""

    def __init__(self, *arguments: str):
        self.process = subprocess.Popen(
            [sys.executable, "-m", "bisplat", *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=Path(__file__).parents[1],
            env={**os.environ, "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"},
        )
        assert self.process.stdout is not None
        found = re.search(r"http://127\.0\.0\.1:(\d+)/\S+", self.process.stdout.readline())
        assert found, self.process.communicate()[1]
        self.url, self.port = found.group(), int(found.group(1))

    def end(self) -> tuple[int, str]:
        """Ctrl-C; the exit status and what was said on stderr."""
        self.process.send_signal(signal.SIGINT)
        _, errors = self.process.communicate(timeout=30)
        return self.process.returncode, errors


@pytest.fixture(scope="module")
def serve() -> Iterator[Callable[..., Served]]:
    """Function: arguments of ``bisplat`` -> the page it serves."""
    started: list[Served] = []

    def start(*arguments: str) -> Served:
        started.append(Served(*arguments))
        return started[-1]

    yield start
    for each in started:
        if each.process.poll() is None:
            each.process.kill()


@pytest.fixture(scope="module")
def open_tab() -> Iterator[Callable[..., Any]]:
    """Function: url and a text that shows that the page is there -> a Playwright page. None may have had an error."""
    chromium = shutil.which("chromium")
    if chromium is None:
        pytest.skip("no Chromium here: apt-get install chromium")
    from playwright.sync_api import expect, sync_playwright

    expect.set_options(timeout=PATIENCE)
    errors: list[str] = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=QUIET)

        def open_page(url: str, text: str):
            page = browser.new_context(viewport={"width": 1200, "height": 760}).new_page()
            page.set_default_timeout(PATIENCE)
            page.on("console", lambda message: message.type == "error" and errors.append(message.text))
            page.on("pageerror", lambda error: errors.append(str(error)))
            page.goto(url)
            expect(page.get_by_text(text).first).to_be_visible()
            return page

        yield open_page
        browser.close()
    assert not [error for error in errors if "ERR_FILE_NOT_FOUND" not in error]  # of a picture that was overtaken


def pixel_of(point: np.ndarray, bounds: np.ndarray, width: float, height: float) -> tuple[float, float]:
    """Return the pixel at which a page shows a point before its camera moves."""
    from scenes.browser import scene_view

    camera, look_at = scene_view.from_outside(bounds)
    ahead = (look_at - camera) / np.linalg.norm(look_at - camera)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    towards = np.subtract(point, camera)
    pixels = height / 2 / np.tan(np.radians(scene_view.FIELD_OF_VIEW) / 2) / (towards @ ahead)
    x, y = width / 2 + pixels * (towards @ right), height / 2 - pixels * (towards @ np.cross(right, ahead))
    return round(float(x), 3), round(float(y), 3)


@pytest.fixture
def on_screen() -> Callable[..., tuple[float, float]]:
    """Function: page, point in the world, bounds of what is seen -> pixel, by the camera our pages begin with."""

    def project(page, point: np.ndarray, bounds: np.ndarray) -> tuple[float, float]:
        canvas = page.locator("canvas").first.bounding_box()
        x, y = pixel_of(point, bounds, canvas["width"], canvas["height"])
        return canvas["x"] + x, canvas["y"] + y

    return project


@pytest.fixture
def keep_screenshot() -> Callable[..., np.ndarray]:
    """Function: page, name -> its pixels; kept as a file where ``BISPLAT_SCREENSHOTS`` names a folder."""
    from io import BytesIO

    from PIL import Image

    def keep(page, name: str) -> np.ndarray:
        folder = os.environ.get("BISPLAT_SCREENSHOTS")
        if folder:
            page.wait_for_timeout(5000)  # the scene fades in
            for button in page.locator(".mantine-Notification-closeButton").all():  # that WebGL runs in software
                button.click()
            page.wait_for_timeout(1000)
        shot = page.screenshot(timeout=PATIENCE)
        if folder:
            (Path(folder) / f"{name}.png").write_bytes(shot)
        return np.asarray(Image.open(BytesIO(shot)).convert("RGB"))

    return keep
