"""How long the viewer takes from a drag of the transmitter to the new picture.

python -m benchmarks.product.view runs/demo/run --json

The times are in milliseconds. ``sent`` is measured in the server, from the arrival of a drag until the new picture and
the 3D layers are on their way to the browser. A tab that draws nothing is connected meanwhile. ``seen`` is measured in
a headless Chromium, from the move of the mouse until the picture is loaded. It is null if there is no Chromium.
"""

from __future__ import annotations

import contextlib
import io
import shutil
import statistics
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated

import msgspec
import numpy as np
import tyro
import viser
from websockets.sync.client import connect

from benchmarks.ledger.printing import print_figures
from learn.view.subject import Subject, subject
from learn.view.tab import Tab
from scenes.scene.shapes import bounding_box
from tests.browser import pixel_of

DRAGS = 40
"""Drags of the transmitter."""

QUIET = "--no-sandbox --disable-background-networking --use-gl=angle --use-angle=swiftshader".split()

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, 0.0, 1.0),
    "fov": 1.0,
    "near": 0.1,
    "far": 100.0,
    "image_height": 600,
    "image_width": 800,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 1.0, 0.0),
}
"""The first message of a tab to viser's server, which waits for it before it builds the tab."""

WATCH = """() => {
    window.moved = null; window.seen = [];
    window.addEventListener("pointermove", () => { window.moved = performance.now(); }, true);
    document.querySelector("img[src^='blob:']").addEventListener("load", () => {
        if (window.moved !== null) { window.seen.push(performance.now() - window.moved); window.moved = null; }
    });
}"""


class Timed(Tab):
    """A tab that says when it has shown a position."""

    shown = threading.Event()

    def _show(self, position: np.ndarray) -> None:
        super()._show(position)
        self.shown.set()


@contextlib.contextmanager
def served(looked_at: Subject) -> Iterator[tuple[str, list[Timed]]]:
    """Serve the viewer's page within a context. Yields its address, and the tabs opened so far."""
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=8700, verbose=False)
    tabs: list[Timed] = []
    server.on_client_connect(lambda client: tabs.append(Timed(client, looked_at, None)))
    try:
        yield f"127.0.0.1:{server.get_port()}", tabs
    finally:
        for tab in tabs:
            tab.close()
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def sent(looked_at: Subject, drags: int, scoring: float) -> list[float]:
    """Milliseconds from the arrival of a drag until the picture is sent."""
    times = []
    with (
        served(looked_at) as (address, tabs),
        connect(f"ws://{address}", subprotocols=[f"viser-v{viser.__version__}"], max_size=None) as tab,
    ):
        tab.send(msgspec.msgpack.encode(CAMERA))
        threading.Thread(target=lambda: [None for _ in tab], daemon=True).start()  # reads what is sent, draws nothing
        while not tabs:
            time.sleep(0.1)
        Timed.shown.wait()
        time.sleep(scoring)
        # Simulated datasets draw their rows in the same region with small seeds; a drag meets no recorded row.
        for position in np.random.default_rng(915).uniform(*looked_at.region, (drags, 3)):
            Timed.shown.clear()
            began = time.perf_counter()
            arrived = tabs[0]._dragged(SimpleNamespace(target=SimpleNamespace(position=position), phase="update"))
            with contextlib.suppress(StopIteration):
                arrived.send(None)  # viser's event loop would; it waits for nothing
            Timed.shown.wait()
            times.append(1e3 * (time.perf_counter() - began))
            time.sleep(0.05)
    return times


def seen(looked_at: Subject, chromium: str, drags: int, scoring: float) -> list[float]:
    """Milliseconds from a move of the mouse to the picture on the page; arguments as for ``sent``."""
    from playwright.sync_api import sync_playwright

    with served(looked_at) as (address, tabs), sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=QUIET)
        page = browser.new_page(viewport={"width": 800, "height": 600})
        page.set_default_timeout(60_000)
        page.goto(f"http://{address}")
        page.wait_for_selector("img[src^='blob:']")
        page.wait_for_timeout(1e3 * scoring)
        start = looked_at.region.mean(axis=0)
        tabs[0]._move_to(start)
        page.wait_for_timeout(3000)
        canvas = page.locator("canvas").first.bounding_box()
        assert canvas is not None
        x, y = handle(looked_at, start, canvas["width"], canvas["height"])
        x, y = canvas["x"] + x, canvas["y"] + y
        page.evaluate(WATCH)
        page.mouse.move(x, y)
        page.mouse.down()
        for step in range(drags):
            page.mouse.move(x + 3 * (step % 10), y - 2 * (step % 10))
            page.wait_for_timeout(400)
        page.mouse.up()
        times = page.evaluate("() => window.seen")
        browser.close()
    return times


def handle(looked_at: Subject, position: np.ndarray, width: float, height: float) -> tuple[float, float]:
    """Pixel of the x arrow of the transmitter's handle, in a canvas of this size."""
    room = [] if looked_at.scene is None else [looked_at.scene.bounds]
    everything = np.vstack([looked_at.region, looked_at.gateway.position, *room])
    bounds = bounding_box(everything)
    arm = np.array([0.06 * np.linalg.norm(bounds[1] - bounds[0]), 0, 0])
    return pixel_of(position + arm, bounds, width, height)


def main(
    run: tyro.conf.Positional[Path],
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Drag the transmitter in the viewer."""
    looked_at = subject(str(run))
    drags, scoring = (3, 0.0) if smallest else (DRAGS, 10.0)
    in_server = sent(looked_at, drags, scoring)
    chromium = shutil.which("chromium")
    in_browser = seen(looked_at, chromium, drags // 2, scoring) if chromium is not None else []
    result = {
        "model": looked_at.run.config.model if looked_at.run else "copying",
        "sent_ms_median": round(statistics.median(in_server), 1),
        "sent_ms_p95": round(float(np.percentile(in_server, 95)), 1),
        "seen_ms_median": round(statistics.median(in_browser), 1) if in_browser else None,
        "pictures_seen": len(in_browser),
    }
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
