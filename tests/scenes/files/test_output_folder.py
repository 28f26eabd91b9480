"""What is written appears whole, nothing that was there is lost, and one process at a time writes to a folder."""

import errno
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from scenes.files import output_folder
from scenes.files.errors import InputError
from scenes.files.output_folder import LOCK, locked, new_folder

SHARED_MEMORY = Path("/dev/shm")


def files(folder) -> dict[str, str]:
    return {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*") if path.is_file()}


def write(output, force=None) -> None:
    with new_folder(output, force) as folder:
        (folder / "meshes").mkdir()
        (folder / "meshes" / "floor.ply").write_text("new mesh")
        assert not (output / "meshes" / "floor.ply").exists() or force
        (folder / "scene.yaml").write_text("new scene")


WRITTEN = {"meshes/floor.ply": "new mesh", "scene.yaml": "new scene"}


def test_new_and_empty_folders_are_taken_and_nothing_else_is_left(tmp_path):
    (tmp_path / "empty").mkdir()
    for name in ("new", "empty", "deep/new"):
        write(tmp_path / name)
        assert files(tmp_path / name) == WRITTEN
    assert len(files(tmp_path)) == 6


def test_folder_with_files_is_refused_and_with_force_keeps_those_of_other_names(tmp_path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "floor.ply").write_text("my mesh")
    (tmp_path / "thesis.tex").write_text("precious")
    before = files(tmp_path)
    for force in (False, None):
        with pytest.raises(InputError) as error:
            write(tmp_path, force)
        assert str(error.value).startswith(f"{tmp_path}: ")
        assert ("--force" in str(error.value)) == (force is False)
        assert files(tmp_path) == before
    write(tmp_path, force=True)
    assert files(tmp_path) == {**WRITTEN, "thesis.tex": "precious"}


def test_error_leaves_nothing_and_what_a_killed_process_left_is_removed(tmp_path):
    with pytest.raises(ZeroDivisionError), new_folder(tmp_path / "new") as folder:
        (folder / "half").write_text("")
        raise ZeroDivisionError
    assert not list(tmp_path.iterdir())
    (tmp_path / "new" / ".bisplat-0123456789abcdef.unfinished" / "half").mkdir(parents=True)
    (tmp_path / "new" / LOCK).write_text("process 1")
    write(tmp_path / "new")
    assert files(tmp_path / "new") == WRITTEN
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["meshes", "scene.yaml"]


def test_second_process_is_refused(tmp_path):
    with new_folder(tmp_path / "new") as folder:
        (folder / "mine").write_text("first")
        with pytest.raises(InputError, match="no other process writes to"):
            write(tmp_path / "new")
        with pytest.raises(InputError, match="no other process writes to"), locked(tmp_path / "new"):
            pass
    assert files(tmp_path / "new") == {"mine": "first"}


def test_links_are_replaced_and_not_followed(tmp_path):
    """Whether they have the name of a temporary folder of old, of one of today, or of what is written."""
    (tmp_path / "victim").mkdir()
    (tmp_path / "victim" / "thesis.tex").write_text("precious")
    (tmp_path / "out").mkdir()
    for name in (".out.unfinished", "out/.bisplat-0123456789abcdef.unfinished", "out/meshes"):
        (tmp_path / name).symlink_to(tmp_path / "victim")
    (tmp_path / "out" / "scene.yaml").symlink_to(tmp_path / "victim" / "thesis.tex")
    write(tmp_path / "out", force=True)
    assert files(tmp_path / "victim") == {"thesis.tex": "precious"}
    assert (tmp_path / "out" / "meshes" / "floor.ply").read_text() == "new mesh"
    assert not (tmp_path / "out" / "scene.yaml").is_symlink()


@pytest.mark.skipif(not SHARED_MEMORY.is_dir(), reason="needs a second disk")
def test_empty_folder_on_another_disk(tmp_path):
    """As a volume of a container is; and a link to it."""
    with tempfile.TemporaryDirectory(dir=SHARED_MEMORY) as disk:
        (tmp_path / "out").symlink_to(disk)
        write(tmp_path / "out")
        assert files(Path(disk)) == WRITTEN and (tmp_path / "out").is_symlink()


@pytest.mark.parametrize(("name", "found"), [("file", "a file"), ("link", "a link to nothing")])
def test_what_is_no_folder_is_refused(tmp_path, name, found):
    (tmp_path / "file").write_text("precious")
    (tmp_path / "link").symlink_to(tmp_path / "nothing")
    for force in (False, True):
        with pytest.raises(InputError, match=f"{name}: expected a new folder, found {found}"):
            write(tmp_path / name, force)
    with pytest.raises(InputError, match="found a file on the path"):
        write(tmp_path / "file" / "new")
    assert (tmp_path / "file").read_text() == "precious"


def test_the_root_folder_is_refused_without_force():
    with pytest.raises(InputError, match=r"/: .*--force"):
        write(Path("/"), force=False)


# The lock: a killed process leaves none, and the second one is told who has it

HOLD = """
import sys, time
from pathlib import Path
from scenes.files.output_folder import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def holder(tmp_path):
    """A process that holds the folder."""
    command = [sys.executable, "-c", HOLD, str(tmp_path)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    assert process.stdout is not None and process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.wait()


def test_second_process_is_told_who_has_the_folder_until_that_one_is_killed(holder, tmp_path):
    with pytest.raises(InputError, match=rf"process {holder.pid} of \S+ \(.*, since \d{{4}}-"), locked(tmp_path):
        pass
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    assert (tmp_path / LOCK).exists()
    with locked(tmp_path):
        pass
    assert not list(tmp_path.iterdir())


def test_folder_is_held_once_in_a_process_too_and_free_after_an_error(tmp_path):
    with pytest.raises(ZeroDivisionError), locked(tmp_path):
        with pytest.raises(InputError, match=f"process {os.getpid()} "), locked(tmp_path):
            pass
        raise ZeroDivisionError
    with locked(tmp_path):
        pass
    assert not list(tmp_path.iterdir())


def test_lock_of_a_renamed_folder_is_removed(tmp_path):
    (tmp_path / "old").mkdir()
    with locked(tmp_path / "old"):
        (tmp_path / "old").rename(tmp_path / "new")
    assert not list((tmp_path / "new").iterdir())


def test_lock_file_removed_before_it_is_locked_is_made_again(tmp_path, monkeypatch):
    """The process that held it ended just after this one had opened it."""
    whole, calls = output_folder.fcntl.flock, []

    def flock(number, how):
        if not calls:
            (tmp_path / LOCK).unlink()
        calls.append(number)
        whole(number, how)

    monkeypatch.setattr(output_folder.fcntl, "flock", flock)
    with locked(tmp_path):
        assert (tmp_path / LOCK).read_text().startswith(f"process {os.getpid()} ")
    assert len(calls) == 2


def test_disk_without_locks_is_a_warning(tmp_path, monkeypatch, capsys):
    def flock(*_):
        raise OSError(errno.EOPNOTSUPP, "Operation not supported")

    monkeypatch.setattr(output_folder.fcntl, "flock", flock)
    with locked(tmp_path):
        (err,) = capsys.readouterr().err.splitlines()
    assert err.startswith(f"bisplat: warning: {tmp_path}: this disk cannot lock files (Operation not supported)")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("make", [lambda path: path.symlink_to("elsewhere"), lambda path: os.mkdir(path)])
def test_something_else_of_that_name_is_an_error_that_names_it(tmp_path, make):
    make(tmp_path / LOCK)
    with pytest.raises(OSError) as error, locked(tmp_path):
        pass
    assert error.value.filename == str(tmp_path / LOCK)
    assert [path.name for path in tmp_path.iterdir()] == [LOCK]
