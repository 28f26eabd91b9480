"""Torch's threads do not wait in long loops, nor for threads that a fork has not copied."""

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


FORK = """
import multiprocessing, sys
import torch
import learn

def work(_=0):
    return torch.ones(1000, 1000).exp().sum().item() > 0

torch.set_num_threads(2)
assert work()
with multiprocessing.get_context("fork").Pool(1) as pool:
    print(*pool.map_async(work, [0]).get(timeout=60))
"""


def test_a_forked_process_computes():
    ran = subprocess.run([sys.executable, "-c", FORK], capture_output=True, text=True)
    assert ran.stdout.split() == ["True"], ran.stderr
