"""The datasets whose fingerprints the documentation lists are the ones that their commands make."""

import re
import shlex
import subprocess
import sys

import pytest

import bisplat
from tests.docs.pages import PAGES, ROOT

LISTED = re.findall(
    r"^\| `bisplat (simulate .*)` \| `([0-9a-f]{64})` \|$",
    PAGES["docs/how-to/train-and-compare-models.md"].read_text(),
    re.M,
)


@pytest.mark.slow
@pytest.mark.parametrize(("command", "fingerprint"), LISTED)
def test_commands_make_what_is_listed(command, fingerprint, tmp_path):
    """On another kind of processor, or with other versions, some grey levels may be rounded differently."""
    words = [str(ROOT / word) if word.startswith("tests/") else word for word in shlex.split(command)]
    subprocess.run([sys.executable, "-m", "bisplat", *words, "-o", tmp_path / "made"], cwd=ROOT, check=True)
    assert bisplat.read_dataset(tmp_path / "made").fingerprint == fingerprint
