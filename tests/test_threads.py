"""Torch's threads do not wait in long loops, which would slow training down beside other programs."""

import os
import subprocess
import sys

import pytest


@pytest.mark.parametrize(("given", "found"), [({}, "3000"), ({"GOMP_SPINCOUNT": "7"}, "7")], ids=["unset", "set"])
def test_the_setting_is_made_before_torch_is_imported(given, found):
    lines = (
        "import os, sys",
        "import learn",
        "assert 'torch' not in sys.modules",
        "import learn.models.base",
        "assert 'torch' in sys.modules",
        "print(os.environ['GOMP_SPINCOUNT'])",
    )
    environment = {name: value for name, value in os.environ.items() if name != "GOMP_SPINCOUNT"} | given
    ran = subprocess.run([sys.executable, "-c", "\n".join(lines)], env=environment, capture_output=True, text=True)
    assert ran.stdout.split() == [found], ran.stderr
