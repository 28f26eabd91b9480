"""How long from dragging the transmitter to the new picture? In the server, and in a headless Chromium.

python benchmarks/view.py runs/demo/run --json
"""

from __future__ import annotations

import contextlib
import io
import json
import shutil
import statistics
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated

import numpy as np
import psutil
import tyro
from playwright.sync_api import Page, sync_playwright
from viser import ViserServer

from learn.view.session import Session
from learn.view.subject import subject
from scenes.stage import on_screen

DRAGS = 40
QUIET = "--no-sandbox --disable-background-networking --use-gl=angle --use-angle=swiftshader".split()

WATCH = """() => {
    window.moved = null; window.seen = [];
    window.addEventListener("pointermove", () => { window.moved = performance.now(); }, true);
    document.querySelector("img[src^='blob:']").addEventListener("load", () => {
        if (window.moved !== null) { window.seen.push(performance.now() - window.moved); window.moved = null; }
    });
}"""


class Timed(Session):
    """A tab that says when it has shown a position."""

    shown = threading.Event()

    def _show(self, position: np.ndarray) -> None:
        super()._show(position)
        self.shown.set()


def sent(session: Timed, region: np.ndarray) -> list[float]:
    """Milliseconds from a drag's arrival to the picture's departure."""
    times = []
    for position in np.random.default_rng(0).uniform(*region, (DRAGS, 3)):
        session.shown.clear()
        began = time.perf_counter()
        arrived = session._dragged(SimpleNamespace(target=SimpleNamespace(position=position), phase="update"))
        with contextlib.suppress(StopIteration):
            arrived.send(None)  # viser's event loop would; it waits for nothing
        session.shown.wait()
        times.append(1e3 * (time.perf_counter() - began))
        time.sleep(0.05)
    return times


def seen(page: Page, x: float, y: float) -> list[float]:
    """Milliseconds from a move of the mouse to the picture on the page."""
    page.evaluate(WATCH)
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(DRAGS // 2):
        page.mouse.move(x + 3 * (step % 10), y - 2 * (step % 10))
        page.wait_for_timeout(400)
    page.mouse.up()
    return page.evaluate("() => window.seen")


def main(run: tyro.conf.Positional[Path], json_output: Annotated[bool, tyro.conf.arg(name="json")] = False) -> None:
    """Measure.

    Args:
        run: a run folder.
        json_output: print one JSON object.
    """
    looked_at = subject(str(run))
    with contextlib.redirect_stdout(io.StringIO()):
        server = ViserServer(host="127.0.0.1", port=8700, verbose=False)
    sessions: list[Timed] = []
    server.on_client_connect(lambda client: sessions.append(Timed(client, looked_at, None)))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=QUIET)
        page = browser.new_page(viewport={"width": 800, "height": 600})
        page.set_default_timeout(60_000)
        page.goto(f"http://127.0.0.1:{server.get_port()}")
        page.wait_for_selector("img[src^='blob:']")
        page.wait_for_timeout(10_000)  # test positions are being scored
        drawing = [each for each in psutil.Process().children(recursive=True) if "chrom" in each.name()]
        for each in drawing:
            each.suspend()  # without a GPU it would take both cores to draw the room
        in_server = sent(sessions[0], looked_at.region)
        for each in drawing:
            each.resume()
        start = looked_at.region.mean(axis=0)
        sessions[0]._move_to(start)
        page.wait_for_timeout(3000)
        in_browser = seen(page, *handle(page, looked_at, start))
        browser.close()
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()
    model = looked_at.run.config.model if looked_at.run else "copying"
    result = {
        "model": model,
        "sent_ms_median": round(statistics.median(in_server), 1),
        "sent_ms_p95": round(float(np.percentile(in_server, 95)), 1),
        "seen_ms_median": round(statistics.median(in_browser), 1),
        "pictures_seen": len(in_browser),
    }
    print(json.dumps(result) if json_output else json.dumps(result, indent=2))


def handle(page: Page, looked_at, position: np.ndarray) -> tuple[float, float]:
    """Pixel of the arrow along x of the transmitter's handle."""
    room = [] if looked_at.scene is None else [looked_at.scene.bounds]
    everything = np.vstack([looked_at.region, looked_at.gateway.position, *room])
    bounds = np.stack([everything.min(axis=0), everything.max(axis=0)])
    arm = np.array([0.06 * np.linalg.norm(bounds[1] - bounds[0]), 0, 0])
    box = page.locator("canvas").first.bounding_box()
    assert box is not None
    x, y = on_screen(position + arm, bounds, box["width"], box["height"])
    return box["x"] + x, box["y"] + y


if __name__ == "__main__":
    tyro.cli(main)
