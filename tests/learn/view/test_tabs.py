"""Tabs of the viewer at once, without a browser."""

import shutil

import numpy as np

import bisplat
from learn.view.subject import subject
from learn.view.tab import Tab
from scenes.browser.served_page import serving


def test_tabs_of_a_folder_of_any_name_have_pictures_and_end(tiny, tmp_path, join):
    odd = shutil.copytree(tiny, tmp_path / "<img src=x onerror=alert(1)>$\\frac{$[red]\x1b[31m")
    shown, closed = subject(str(odd)), []

    def open_tab(client):
        opened = Tab(client, shown, None)
        return lambda: (opened.close(), closed.append(opened))

    with serving(f"bisplat: {shown.name}", 8690, open_tab) as address:
        going, *staying = (join(address) for _ in range(4))
        going.break_off()
        for tab in staying:
            assert tab.next("GuiImageMessage")
            tab.close()
    assert len(closed) == 4


def test_an_array_that_moves_is_drawn_where_it_is(tmp_path, join):
    array, positions = bisplat.PlanarArray(), [[3.0, 0, 1], [2, 2, 1]]
    waves = array.manifold(np.radians([200.0, 60.0]), np.radians([40.0, 10.0]))
    bisplat.write_dataset(
        tmp_path / "data", positions, waves, array, "2.4 GHz", gateway_position=(0.5, 0.5, 2.0), moving="receiver"
    )
    shown = subject(str(tmp_path / "data"))
    assert "transmitter as a dot" in shown.missing[-1]
    with serving("moving", 8691, lambda client: Tab(client, shown, None).close) as address, join(address) as tab:
        moved = tab.next("SetPositionMessage")
        while moved["name"] != "/gateway" or tuple(moved["position"]) == (0.5, 0.5, 2.0):
            moved = tab.next("SetPositionMessage")
        np.testing.assert_allclose(moved["position"], positions[0])
        standing = tab.next("IcosphereMessage")
        while standing["name"] != "/standing":
            standing = tab.next("IcosphereMessage")


def test_layers_of_a_scene_are_hidden_each_on_its_own(join):
    shown = subject("closet")
    with serving("closet", 8692, lambda client: Tab(client, shown).close) as address, join(address) as tab:
        tab.press("furniture")
        while not (hidden := tab.next("SetSceneNodeVisibilityMessage"))["name"].startswith("/furniture/"):
            pass
        assert hidden["visible"]
