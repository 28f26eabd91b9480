"""Files appear whole, through no link that was planted, and what a killed process left is removed."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from scenes.files.atomic import (
    is_temporary,
    remove_left,
    require_writable,
    temporary_folder,
    write_atomically,
    written_atomically,
)
from scenes.files.errors import InputError

WRITE = """
import sys, time
from pathlib import Path
from scenes.files.atomic import written_atomically
with written_atomically(Path(sys.argv[1])) as temporary:
    temporary.write_text("half")
    print("half", flush=True)
    time.sleep(60)
"""


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_neither_a_file_of_the_user_nor_what_a_link_leads_to_is_touched(tmp_path):
    (tmp_path / "thesis.tex").write_text("precious")
    (tmp_path / "a.h5.tmp").write_text("my own")
    (tmp_path / "b.h5.tmp").symlink_to("thesis.tex")
    (tmp_path / "c.h5").symlink_to("thesis.tex")
    for name in ("a.h5", "b.h5", "c.h5"):
        write_atomically(tmp_path / name, b"new")
        assert (tmp_path / name).read_bytes() == b"new"
    assert (tmp_path / "thesis.tex").read_text() == "precious" and (tmp_path / "a.h5.tmp").read_text() == "my own"
    assert names(tmp_path) == ["a.h5", "a.h5.tmp", "b.h5", "b.h5.tmp", "c.h5", "thesis.tex"]


def test_no_two_temporary_names_are_the_same_and_others_may_read_the_file(tmp_path):
    with written_atomically(tmp_path / "a") as first, written_atomically(tmp_path / "a") as second:
        assert first != second and is_temporary(first.name) and is_temporary(second.name)
    umask = os.umask(0o027)
    try:
        write_atomically(tmp_path / "b", b"")
    finally:
        os.umask(umask)
    assert stat.S_IMODE((tmp_path / "b").stat().st_mode) == 0o640


def test_an_error_names_the_file_and_not_the_temporary_one(tmp_path):
    with pytest.raises(OSError) as error, written_atomically(tmp_path / "a") as temporary:
        temporary.unlink()
    assert error.value.filename == str(tmp_path / "a") and not names(tmp_path)


def test_what_a_killed_process_left_is_removed_but_nothing_of_a_living_one(tmp_path):
    command = [sys.executable, "-c", WRITE, str(tmp_path / "below" / "a")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        try:
            assert process.stdout is not None and process.stdout.readline() == "half\n"
            remove_left(tmp_path, deep=True)
            (left,) = names(tmp_path / "below")
            assert is_temporary(left)
        finally:
            process.kill()
    remove_left(tmp_path)
    assert names(tmp_path / "below") == [left]  # in a folder below
    require_writable(tmp_path / "below" / "a")
    assert not names(tmp_path / "below")


def test_links_of_temporary_names_are_left_alone_with_what_they_lead_to(tmp_path):
    (tmp_path / "victim").mkdir()
    (tmp_path / "victim" / "thesis.tex").write_text("precious")
    (tmp_path / ".bisplat-0123456789abcdef.unfinished").symlink_to("victim")
    (tmp_path / ".bisplat-0123456789abcdef.tmp").symlink_to("victim/thesis.tex")
    os.mkfifo(tmp_path / ".bisplat-fedcba9876543210.tmp")
    with temporary_folder(tmp_path) as held:
        remove_left(tmp_path, deep=True)
        assert held.is_dir()
    assert (tmp_path / "victim" / "thesis.tex").read_text() == "precious"
    assert len(names(tmp_path)) == 3


def test_what_cannot_be_written_is_found_out_and_nothing_is_left(tmp_path):
    (tmp_path / "file").write_text("")
    for name in ("out", "deep/new/out", "file"):
        require_writable(tmp_path / name)
    with pytest.raises(InputError, match="file: expected a folder, found a file"):
        require_writable(tmp_path / "file" / "deep" / "out")
    (tmp_path / "link").symlink_to("nowhere")
    with pytest.raises(InputError, match="link: expected a folder, found a link to nothing"):
        require_writable(tmp_path / "link" / "out")
    with pytest.raises(OSError, match="File name too long"):
        require_writable(tmp_path / ("x" * 300))
    with pytest.raises(OSError) as error:
        require_writable(Path("/proc/none/out"))
    assert error.value.filename == "/proc"
    assert names(tmp_path) == ["file", "link"]
