"""Many tabs of the viewer at once, without a browser."""

import shutil

from learn.view.session import Session
from learn.view.subject import subject
from scenes.browser.served_page import serving


def test_twenty_tabs_of_which_some_go_away_midway_all_have_pictures(tiny, tmp_path, join):
    odd = shutil.copytree(tiny, tmp_path / "<img src=x onerror=alert(1)>$\\frac{$[red]\x1b[31m")
    shown, closed = subject(str(odd)), []

    def open_tab(client):
        session = Session(client, shown, None)
        return lambda: (session.close(), closed.append(session))

    with serving(f"bisplat: {shown.name}", 8690, open_tab) as address:
        tabs = [join(address) for _ in range(20)]
        for tab in tabs[:5]:
            tab.break_off()
        for tab in tabs[5:]:
            assert tab.next("GuiImageMessage")
            tab.close()
        last = join(address)
        assert last.next("GuiImageMessage")
        last.close()
    assert len(closed) == 21
