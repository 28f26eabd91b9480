"""Ctrl-C ends a command with one sentence and status 130, also where KeyboardInterrupt would be lost."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from bisplat.shell import SENTENCE

ROOT = Path(__file__).parents[2]

PRESS = """
import os, signal
os.kill(os.getpid(), signal.SIGINT)
"""

HEED = """
import os, signal
from bisplat.shell import heed_interrupts
heed_interrupts()
press = lambda *_: os.kill(os.getpid(), signal.SIGINT)
class A: pass
"""

SWALLOW = {
    "an import": "try:\n    import pressing\nexcept BaseException:\n    pass",
    "a callback": "import weakref\na = A()\nreference = weakref.ref(a, press)\ndel a",
    "a destructor": "A.__del__ = press\nA()",
    "a clause, twice": "for _ in range(2):\n    try:\n        press()\n    except BaseException:\n        pass",
}
"""What loses the exception, and a program in which it does."""


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess:
    """Python in a folder in which the module ``pressing`` presses Ctrl-C when it is imported."""
    (folder / "pressing.py").write_text(PRESS)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}
    assert signal.getsignal(signal.SIGINT) != signal.SIG_IGN  # processes would inherit it
    return subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=environment, capture_output=True, text=True, timeout=60
    )


@pytest.mark.parametrize("program", SWALLOW.values(), ids=SWALLOW)
def test_an_exception_that_would_be_lost_ends_the_process(program, tmp_path):
    ended = run(tmp_path, "-c", f"{HEED}{program}\nprint('went on')")
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, "", f"{SENTENCE}\n")


def test_elsewhere_it_is_raised_so_that_files_are_tidied_up(tmp_path):
    ended = run(tmp_path, "-c", f"{HEED}\ntry:\n    press()\nexcept KeyboardInterrupt:\n    print('tidied up')")
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "tidied up\n", "")


def test_a_command_that_still_imports(tmp_path):
    (tmp_path / "tyro.py").write_text(PRESS)
    ended = run(tmp_path, "-m", "bisplat", "scene", "closet")
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, "", f"{SENTENCE}\n")


def test_a_signal_that_the_shell_lets_be_ignored_stays_ignored(tmp_path):
    program = f"import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n{HEED}\npress()\nprint('went on')"
    assert run(tmp_path, "-c", program).stdout == "went on\n"
