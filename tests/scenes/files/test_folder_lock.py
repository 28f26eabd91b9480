"""One process at a time writes to a folder; a killed one leaves no lock, and the second one is told who has it."""

import errno
import os
import signal
import subprocess
import sys

import pytest

from scenes.files import output_folder as folder_lock
from scenes.files.errors import InputError
from scenes.files.output_folder import LOCK, locked

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
    whole, calls = folder_lock.fcntl.flock, []

    def flock(number, how):
        if not calls:
            (tmp_path / LOCK).unlink()
        calls.append(number)
        whole(number, how)

    monkeypatch.setattr(folder_lock.fcntl, "flock", flock)
    with locked(tmp_path):
        assert (tmp_path / LOCK).read_text().startswith(f"process {os.getpid()} ")
    assert len(calls) == 2


def test_disk_without_locks_is_a_warning(tmp_path, monkeypatch, capsys):
    def flock(*_):
        raise OSError(errno.EOPNOTSUPP, "Operation not supported")

    monkeypatch.setattr(folder_lock.fcntl, "flock", flock)
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
