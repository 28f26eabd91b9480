"""Do the commands and functions keep their promises for any file, option, argument and surroundings?

python -m benchmarks.product.attack --json

The program runs tests/attack with many more changed inputs than ``make test-all``. It also runs the tests that kill
commands or read hostile files. For each kind of input it counts how many inputs were tried, refused and accepted, and
how many broke a promise. The output of pytest goes to stderr. The exit status is that of pytest.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Annotated

import tyro

from benchmarks.ledger.printing import print_figures

ATTACK = "tests/attack"

OTHERS = (
    "tests/learn/test_killed.py",
    "tests/simulate/generation/test_generate.py",
    "tests/simulate/dataset/test_hostile_files.py",
    "tests/scenes/importing/test_hostile_meshes.py",
    "tests/scenes/files/test_json_and_yaml.py",
    "tests/bisplat/test_options.py",
    "tests/learn/training/test_damaged_runs.py",
    "tests/scenes/browser/test_served_page.py",
    "tests/learn/view/test_tabs.py",
)


def main(
    examples: int = 240,
    kills: int = 10,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Attack the commands."""
    tests = [f"{ATTACK}/test_option_values.py"] if smallest else [ATTACK, *OTHERS]
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "attack.json"
        numbers = {"BISPLAT_ATTACKS": str(2 if smallest else examples), "BISPLAT_KILLS": str(kills)}
        environment = os.environ | numbers | {"BISPLAT_ATTACK_TABLE": str(table)}
        environment |= {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
        command = [sys.executable, "-m", "pytest", "-n", "2", "--dist", "worksteal", *tests]
        status = subprocess.run(command, env=environment, stdout=sys.stderr).returncode
        if table.exists():
            print_figures(json.loads(table.read_text()), json_output, smallest)
    raise SystemExit(status)


if __name__ == "__main__":
    tyro.cli(main)
