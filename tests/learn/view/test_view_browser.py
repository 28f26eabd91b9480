"""``bisplat view`` in a real headless Chromium: what a user sees, drags and reads."""

import json
import os
import socket
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page, expect

import bisplat
from learn.fitted.runs import load_run
from learn.training.train import train_run
from scenes.places.built_in import lab
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_material
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet
from scenes.storage.scene_writing import write_scene
from simulate.dataset.dataset_folder import read_dataset
from simulate.engines.rays_engine import Rays
from simulate.generation.generate import generate
from simulate.generation.request import Request
from simulate.rays.core.propagation import Propagation
from tests.browser import PATIENCE

pytestmark = pytest.mark.browser

FOR_THE_DOCS = "BISPLAT_SCREENSHOTS" in os.environ
"""Screenshots are kept: then of the lab and of a model that knows it, for which there is no time otherwise."""


@pytest.fixture(scope="module")
def room() -> Scene:
    """Floor, two walls and a table; for the docs the lab."""
    if FOR_THE_DOCS:
        return lab()
    concrete, wood = (p2040_material(name, 915e6) for name in ("concrete", "wood"))
    return Scene(
        name="room",
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
def run(room, small_aperture, tiny_config, changed, tmp_path_factory) -> Path:
    """A small model, trained a little on spectra traced in the room."""
    folder = tmp_path_factory.mktemp("view")
    low, high = room.transmitter.region_min, room.transmitter.region_max
    positions = np.random.default_rng(0).uniform(low, high, (600 if FOR_THE_DOCS else 40, 3))
    propagation = Propagation(max_depth=3 if FOR_THE_DOCS else 1, diffraction=FOR_THE_DOCS, rays=20_000)
    generate(Request(room, positions, "uniform", Rays(propagation), 0), folder / "data")
    config = changed(tiny_config, dataset=str(folder / "data"), options=small_aperture, steps=30)
    if FOR_THE_DOCS:
        config = changed(config, options={"primitives": 250}, steps=800, batch_size=8)
    train_run(config, folder / "run")
    return folder / "run"


@pytest.fixture(scope="module")
def viewer(serve, run):
    """``bisplat view`` of the run."""
    return serve("view", str(run), "--port", "8650")


SHOWN = "dominant direction azimuth"


@pytest.fixture(scope="module")
def tab(viewer, open_tab) -> Page:
    """A tab of the viewer."""
    return open_tab(viewer.url, SHOWN)


PICTURE = "img[src^='blob:']"
NUMBERS = "p:has-text('dominant direction azimuth')"


def change(page: Page, act: Callable[[], None]) -> None:
    """Do something that must change the picture in the panel."""
    before = page.locator(PICTURE).get_attribute("src") or ""
    act()
    expect(page.locator(PICTURE)).not_to_have_attribute("src", before)


def type_position(page: Page, *position: float) -> None:
    fields = page.locator("input[inputmode=decimal], input[type=number]")
    for index, value in enumerate(position):
        fields.nth(index).fill(f"{value}")
        fields.nth(index).press("Enter")
        page.wait_for_timeout(300)  # nobody types faster


def drag(page: Page, x: float, y: float) -> None:
    """Drag the handle's arrow along x, once it is drawn and has noticed the pointer (the panel is there earlier)."""
    wait_for_colour(page, x, y, lambda red, green, blue: red - max(green, blue) > 60)  # the arrow's own red
    page.mouse.move(x, y)
    wait_for_colour(page, x, y, lambda red, green, blue: min(red, green) - blue > 40)  # yellow under the pointer
    page.mouse.down()
    for step in range(1, 6):
        page.mouse.move(x + 10 * step, y - 5 * step)
    page.mouse.up()


def wait_for_colour(page: Page, x: float, y: float, seen: Callable[[int, int, int], bool]) -> None:
    """Wait until a pixel has a colour."""
    found = []
    for _ in range(PATIENCE // 500):
        shot = page.screenshot(clip={"x": x, "y": y, "width": 1, "height": 1}, timeout=PATIENCE)
        red, green, blue = Image.open(BytesIO(shot)).convert("RGB").getpixel((0, 0))
        found.append((red, green, blue))
        if seen(red, green, blue):
            return
        page.wait_for_timeout(500)
    raise AssertionError(f"the pixel at {x:.0f}, {y:.0f} stays {found[-1]}")


def test_page_shows_room_and_spectra(tab, keep_screenshot):
    expect(tab.get_by_text("SSIM").first).to_be_visible()
    shot = keep_screenshot(tab, "view")
    room, panel = shot[:, :780], shot[:, 820:]
    assert len(np.unique(room.reshape(-1, 3), axis=0)) > 100 and room.std() > 5
    assert len(np.unique(panel.reshape(-1, 3), axis=0)) > 300


def test_numbers_shown_are_those_of_bisplat_predict(tab, run):
    change(tab, lambda: type_position(tab, 1.75, 1.25, 1.3))
    predicted = load_run(run).predict(np.array([[1.75, 1.25, 1.3]])).spectra[0]
    elevation, azimuth = np.unravel_index(predicted.argmax(), predicted.shape)
    expected = f"predicted: dominant direction azimuth {azimuth}°, elevation {elevation}°"
    expect(tab.get_by_text(expected)).to_be_visible()


def test_switches_change_the_picture(tab, keep_screenshot):
    for name, choice in (("view", "polar"), ("quantity", "phase"), ("quantity", "magnitude"), ("scale", "dB")):
        tab.get_by_role("combobox", name=name, exact=True).click()
        change(tab, tab.get_by_role("option", name=choice, exact=True).click)
    tab.get_by_text("primitives").scroll_into_view_if_needed()
    before = keep_screenshot(tab, "view_primitives")
    tab.get_by_role("checkbox", name="primitives").check()
    tab.get_by_role("checkbox", name="spectrum on the hemisphere").uncheck()
    tab.wait_for_timeout(3000)
    assert (keep_screenshot(tab, "view_primitives")[:, :780] != before[:, :780]).any()


def test_tabs_have_states_of_their_own(tab, viewer, run, room, open_tab, on_screen):
    numbers = tab.locator(NUMBERS).inner_text()
    second = open_tab(viewer.url, SHOWN)
    others = second.locator(NUMBERS).inner_text()
    dataset = read_dataset(json.loads((run / "config.json").read_text())["dataset"])
    seen = np.vstack([dataset.positions, room.gateway.position, room.bounds])
    bounds = np.stack([seen.min(axis=0), seen.max(axis=0)])
    arrow = dataset.positions[0] + [0.06 * np.linalg.norm(bounds[1] - bounds[0]), 0, 0]  # of the handle, along x
    change(second, lambda: drag(second, *on_screen(second, arrow, bounds)))
    expect(second.locator(NUMBERS)).not_to_have_text(others)
    expect(second.get_by_text("ray-traced:")).to_be_visible()
    assert tab.locator(NUMBERS).inner_text() == numbers
    second.context.close()


def free_port() -> str:
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        return str(probe.getsockname()[1])


def drag_a_corner(page: Page, room: Scene, on_screen: Callable[..., tuple[float, float]]) -> None:
    """Drag the highest corner of the region along x, and see the lines change."""
    corner = room.transmitter.region_max
    for name in ("spectrum on the hemisphere", "dominant directions"):
        page.get_by_role("checkbox", name=name, exact=True).uncheck()
    page.get_by_role("checkbox", name="show the handles").check()
    lines = page.get_by_text("--region-max")
    lines.scroll_into_view_if_needed()
    expect(lines).to_contain_text("--region-max " + " ".join(map(str, corner)))
    arrow = 0.045 * np.linalg.norm(np.ptp(room.bounds, axis=0))
    drag(page, *on_screen(page, np.add(corner, [arrow, 0, 0]), room.bounds))
    expect(lines).not_to_contain_text(f"--region-max {corner[0]} ")
    expect(lines).to_contain_text(f" {corner[1]} {corner[2]}")


def test_scene_alone(room, tmp_path, serve, open_tab, on_screen, keep_screenshot):
    served = serve("view", str(write_scene(room, tmp_path / "place")), "--port", free_port())
    page = open_tab(served.url, "ray-traced: dominant direction")
    expect(page.get_by_text("predicted:")).to_have_count(0)
    drag_a_corner(page, room, on_screen)
    keep_screenshot(page, "view_scene")
    page.context.close()
    status, said = served.end()
    assert status == 0 and "Traceback" not in said


@pytest.mark.skipif(FOR_THE_DOCS, reason="no picture of it is in the docs")
def test_map_of_received_powers_lies_in_the_world_and_changes_with_the_gateway(tmp_path, serve, open_tab, on_screen):
    places = np.random.default_rng(0).uniform((0, 0, 1), (4, 3, 1), (40, 3))
    places[:3] = (2, 1.5, 1), (0, 0, 1), (4, 3, 1)  # the transmitter is at the first, and hides nothing
    gateways = {"low": (0.0, 0.0, 1.5), "high": (4.0, 3.0, 1.5)}
    powers = -40 - 20 * np.log10(np.linalg.norm(places[:, None] - list(gateways.values()), axis=-1))
    bisplat.write_dataset(tmp_path / "yard", places, powers=powers, gateways=gateways, frequency=2.4e9)
    page = open_tab(serve("view", str(tmp_path / "yard"), "--port", free_port()).url, "Recorded position 1")
    for name in ("training positions", "test positions", "gateways"):
        page.get_by_role("checkbox", name=name, exact=True).uncheck()
    bounds = np.array([[0, 0, 1], [4, 3, 1.5]])
    near, far = (on_screen(page, np.array(place), bounds) for place in ((0.4, 0.3, 1.0), (3.6, 2.7, 1.0)))

    def strong(red, green, blue):
        return green > 190 and green - blue > 60  # yellow-green; weak powers are violet, and the floor is white

    wait_for_colour(page, *near, strong)
    wait_for_colour(page, *far, lambda red, green, blue: green < 100)
    page.get_by_role("combobox", name="gateway", exact=True).click()
    page.get_by_role("option", name="high", exact=True).click()
    wait_for_colour(page, *far, strong)
    page.context.close()
