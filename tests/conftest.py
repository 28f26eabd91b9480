"""What all tests share: Triton's interpreter where there is no GPU, a small dataset and run, a browser, a bare tab."""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
import torch

signal.signal(signal.SIGINT, signal.default_int_handler)  # for tests of Ctrl-C, which a shell's background jobs ignore

if not torch.cuda.is_available():  # before anything imports Triton
    os.environ["TRITON_INTERPRET"] = "1"

QUIET = (
    "--no-sandbox --disable-quic --no-first-run --disable-background-networking --disable-component-update "
    "--disable-sync --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader"
).split()
"""No GPU, no sandbox (root has none), nothing that looks for servers elsewhere."""


@pytest.fixture(scope="session")
def workplace(tmp_path_factory) -> Path:
    """A folder with the dataset data/lab and the run runs/lab, which examples in docstrings use."""
    import bisplat

    folder = tmp_path_factory.mktemp("workplace")
    coarse = bisplat.Propagation(max_depth=1, diffraction=False, rays=20_000)
    dataset = bisplat.simulate("lab", folder / "data" / "lab", n=40, propagation=coarse)
    bisplat.train(dataset, folder / "runs" / "lab")
    return folder


PATIENCE = 60_000
"""Milliseconds; WebGL in software on a busy machine is slow."""


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


@pytest.fixture
def on_screen() -> Callable[..., tuple[float, float]]:
    """Function: page, point in the world, bounds of what is seen -> pixel, by the camera our pages begin with."""
    from scenes.browser import scene_view

    def project(page, point: np.ndarray, bounds: np.ndarray) -> tuple[float, float]:
        canvas = page.locator("canvas").first.bounding_box()
        x, y = scene_view.on_screen(point, bounds, canvas["width"], canvas["height"])
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
        shot = page.screenshot(timeout=PATIENCE)
        if folder:
            (Path(folder) / f"{name}.png").write_bytes(shot)
        return np.asarray(Image.open(BytesIO(shot)).convert("RGB"))

    return keep


CAMERA = {
    "type": "ViewerCameraMessage",
    **{"wxyz": (1.0, 0.0, 0.0, 0.0), "position": (0.0, 0.0, 0.0), "look_at": (1.0, 0.0, 0.0)},
    **{"up_direction": (0.0, 0.0, 1.0), "fov": 0.8, "near": 0.1, "far": 10.0, "image_height": 6, "image_width": 8},
}
"""What a tab of viser says first."""


def _label(message: dict[str, Any]) -> Any:
    return (message.get("props") or message.get("updates") or {}).get("label")


class Tab:
    """A tab without a browser: what viser sends it, and buttons that are pressed."""

    def __init__(self, address: str, host: str | None, **options: Any):
        import viser
        from websockets.sync.client import connect

        url = urlsplit(address)
        uri, sock = f"ws://{host or url.netloc}{url.path}", socket.create_connection((url.hostname, url.port))
        protocol: Any = f"viser-v{viser.__version__}"
        self._websocket = connect(uri, sock=sock, subprotocols=[protocol], max_size=None, **options)
        self._messages: list[dict[str, Any]] = []
        self._seen: dict[str, int] = {}
        self._send(CAMERA)

    def __enter__(self) -> "Tab":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """As when the user closes it."""
        self._websocket.close()

    def break_off(self) -> None:
        """As when the machine goes away: without a farewell."""
        self._websocket.socket.shutdown(socket.SHUT_RDWR)

    def next(self, kind: str) -> dict[str, Any]:
        """The next message of a kind."""
        seen = self._seen.get(kind, 0)
        while not (new := [n for n, m in enumerate(self._messages) if n >= seen and m["type"] == kind]):
            self._receive()
        self._seen[kind] = new[0] + 1
        return self._messages[new[0]]

    def press(self, label: str) -> None:
        """Press a button, which may be made or named so later."""
        while not (found := [m for m in self._messages if _label(m) == label]):
            self._receive()
        self._send({"type": "GuiUpdateMessage", "uuid": found[0]["uuid"], "updates": {"value": True}})

    def _send(self, message: dict[str, Any]) -> None:
        import msgspec

        self._websocket.send(msgspec.msgpack.encode(message))

    def _receive(self) -> None:
        import msgspec
        import zstandard

        packed = self._websocket.recv(timeout=10)
        assert isinstance(packed, bytes)
        size = int.from_bytes(packed[8:16], "little")
        self._messages += msgspec.msgpack.decode(zstandard.decompress(packed[16 : 16 + size]))["messages"]


@pytest.fixture
def join() -> Callable[..., Tab]:
    """Function: address of a page, the host that is named (the address's), options of ``connect`` -> a tab."""
    return lambda address, host=None, **options: Tab(address, host, **options)
