"""Tabs of the viewer at once, without a browser."""

import shutil

import numpy as np

import bisplat
from learn.view.session import Session
from learn.view.subject import subject
from scenes.browser.served_page import serving


def test_tabs_of_a_folder_of_any_name_have_pictures_and_end(tiny, tmp_path, join):
    odd = shutil.copytree(tiny, tmp_path / "<img src=x onerror=alert(1)>$\\frac{$[red]\x1b[31m")
    shown, closed = subject(str(odd)), []

    def open_tab(client):
        session = Session(client, shown, None)
        return lambda: (session.close(), closed.append(session))

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
    assert "transmitter as a yellow dot" in shown.missing[-1]
    with serving("moving", 8691, lambda client: Session(client, shown, None).close) as address, join(address) as tab:
        moved = tab.next("SetPositionMessage")
        while moved["name"] != "/gateway" or tuple(moved["position"]) == (0.5, 0.5, 2.0):
            moved = tab.next("SetPositionMessage")
        np.testing.assert_allclose(moved["position"], positions[0])
        standing = tab.next("IcosphereMessage")
        while standing["name"] != "/standing":
            standing = tab.next("IcosphereMessage")
