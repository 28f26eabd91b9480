"""Progress where there is no terminal."""

import time

from scenes.files import long_work
from scenes.files import progress as progress_module
from scenes.files.long_work import doing, told
from scenes.files.progress import progress_bar


def test_a_line_for_each_tenth_that_takes_long_and_none_is_cut(capsys, monkeypatch):
    monkeypatch.setattr(progress_module, "AFTER", 0.0)  # seconds between lines
    long = "finding paths, " + "28 edges " * 20
    with progress_bar() as progress:
        search = progress.add_task("search", total=None)
        progress.update(search, description="still searching")
        progress.update(search, description=long, total=1, completed=1)
        spectra = progress.add_task("spectra", total=200)
        for _ in range(200):
            progress.advance(spectra)
        for _ in progress.track(range(2), description="pictures"):
            pass
    lines = capsys.readouterr().err.splitlines()
    assert lines[:2] == ["bisplat: still searching", f"bisplat: {long}"]  # the first one at once
    assert lines[2:12] == [f"bisplat: spectra: {count} of 200" for count in range(20, 201, 20)]
    assert lines[-1] == "bisplat: pictures: 2 of 2"


def test_what_takes_long_is_told_once(capsys, monkeypatch):
    monkeypatch.setattr(long_work, "AFTER", 0.05)
    with told():
        doing("reading 2 objects")
        time.sleep(0.5)
        doing("a moment's work")
        doing("")
    assert capsys.readouterr().err == "bisplat: reading 2 objects\n"
