"""``bisplat scene --view`` in a real headless Chromium: what is typed and clicked is what is saved."""

import numpy as np
import pytest
from playwright.sync_api import expect

from scenes.scene.orientation import facing
from scenes.storage.scene_writing import write_scene
from scenes.storage.scene_yaml import load_scene

pytestmark = pytest.mark.browser


def test_what_is_edited_is_what_is_saved(scene, tmp_path, serve, open_tab, on_screen, keep_screenshot):
    path = write_scene(scene, tmp_path / "outdoors")
    served = serve("scene", str(path), "--view", "-o", str(tmp_path / "edited"), "--port", "8640")
    page = open_tab(served.url, "Save scene.yaml")

    fields = page.locator("input[inputmode=decimal], input[type=number]")
    for index, value in {1: 0.5, 2: 1.25, 3: 0, 4: -1, 5: 0, 9: 1.5}.items():  # gateway y and z, boresight, max x
        fields.nth(index).fill(f"{value}")
        fields.nth(index).press("Enter")
        page.wait_for_timeout(300)  # nobody types faster
    page.mouse.click(*on_screen(page, np.array([0.6, 0.7, 1 / 3]), scene.bounds))  # the crate's lid
    expect(page.get_by_role("combobox", name="object")).to_have_value("crate")
    page.get_by_role("combobox", name="material").click()
    page.get_by_role("option", name="brick").click()
    shot = keep_screenshot(page, "editor")
    assert len(np.unique(shot[:, :780].reshape(-1, 3), axis=0)) > 50
    page.get_by_role("button", name="Save scene.yaml").click()
    expect(page.get_by_text("Saved", exact=True)).to_be_visible()

    saved = load_scene(tmp_path / "edited" / "scene.yaml")
    assert saved.gateway.position == (4.0, 0.5, 1.25)
    np.testing.assert_allclose(saved.gateway.orientation, facing((0, -1, 0)), atol=1e-6)
    assert saved.transmitter.region_max == (1.5, 1.0, 1.5) and saved.transmitter.region_min == (-1.0, -1.0, 0.5)
    assert [item.material for item in saved.objects] == ["concrete", "brick"]

    expect(page.get_by_role("textbox", disabled=True)).to_have_value(str(tmp_path / "edited"))
    (tmp_path / "edited" / "scene.yaml").write_text("mine")
    page.get_by_role("button", name="Save scene.yaml").click()
    page.get_by_role("button", name="Replace 1 file").click()
    expect(page.get_by_text("Saved", exact=True)).to_have_count(2)
    assert load_scene(tmp_path / "edited" / "scene.yaml") == saved
    page.context.close()
    status, errors = served.end()
    assert status == 0 and "Traceback" not in errors
