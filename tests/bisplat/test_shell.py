"""Commands end well when the shell closes a stream, fills it, or gives it an encoding without Unicode."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

FULL = Path("/dev/full")


def shell(command: str, folder: Path, **variables: str) -> subprocess.CompletedProcess:
    """A command of bash, in which bisplat is $B."""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "B": f"{sys.executable} -m bisplat"} | variables
    for name in ("PYTHONUTF8", "PYTHONUNBUFFERED"):
        environment.pop(name, None)
    return subprocess.run(["bash", "-c", command], cwd=folder, env=environment, capture_output=True, timeout=100)


def test_no_file_gets_the_number_of_a_closed_stream(tmp_path):
    code = "from bisplat.shell import prepare_streams as p; p(); f = open('x', 'w'); assert f.fileno() > 2"
    assert shell(f'{sys.executable} -c "{code}" >&- 2>&- <&-', tmp_path).returncode == 0


def test_table_on_a_closed_stdout(tmp_path):
    ended = shell("$B scene closet >&-", tmp_path)
    assert (ended.returncode, ended.stdout) == (0, b"") and b"rror" not in ended.stderr
    assert (tmp_path / "closet.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full")
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_stdout_on_a_full_disk_is_one_sentence(tmp_path, unbuffered):
    ended = shell(f"PYTHONUNBUFFERED={unbuffered} $B > /dev/full", tmp_path)
    assert ended.returncode == 1
    assert ended.stderr == b"bisplat: standard output: No space left on device\n"


def test_a_reader_that_leaves_is_no_error(tmp_path):
    ended = shell("$B simulate --help | true; exit ${PIPESTATUS[0]}", tmp_path)
    assert ended.returncode in (0, 1) and ended.stderr == b""


def test_the_overview_in_ascii(tmp_path):
    ended = shell("$B", tmp_path, PYTHONIOENCODING="ascii:strict")
    assert (ended.returncode, ended.stderr) == (0, b"")
    assert ended.stdout.startswith(b"Ray-trace spatial spectra in NeRF\\xb2 format")


SAY = """
from bisplat.shell import prepare_streams
prepare_streams()
from scenes.files.progress import progress_bar
from scenes.files.plain_text import say
from scenes.files.plain_text import print_rows
with progress_bar() as progress:
    progress.advance(progress.add_task('λ', total=1))
print_rows('λ', [{'90°': '–'}])
say('90°')
"""


@pytest.mark.parametrize("encoding", ["ascii:strict", "latin-1", "utf-8"])
def test_what_an_encoding_lacks_is_escaped(tmp_path, encoding):
    (tmp_path / "say.py").write_text(SAY)
    ended = shell(f"{sys.executable} say.py", tmp_path, PYTHONIOENCODING=encoding)
    name = encoding.split(":")[0]
    heading, cell, bar = (text.encode(name, "backslashreplace") for text in ("90°", "–", "λ"))
    assert ended.returncode == 0
    assert heading in ended.stdout and cell in ended.stdout
    assert bar in ended.stderr and ended.stderr.endswith(b"bisplat: " + heading + b"\n")
