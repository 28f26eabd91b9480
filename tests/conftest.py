"""What all tests share: one thread, Triton's interpreter where there is no GPU, and the fixtures of the files below."""

import os
import signal
from pathlib import Path

import numba
import pytest
import torch

pytest_plugins = ("tests.browser", "tests.memory", "tests.small_runs", "tests.tabs")

signal.signal(signal.SIGINT, signal.default_int_handler)  # for tests of Ctrl-C, which a shell's background jobs ignore

if not torch.cuda.is_available():  # before anything imports Triton
    os.environ["TRITON_INTERPRET"] = "1"


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    """Small models are fastest on one thread: torch's and numba's threads wait for work by spinning, for each other
    and for every other program on the machine."""
    threads = torch.get_num_threads(), numba.get_num_threads()
    torch.set_num_threads(1)
    numba.set_num_threads(1)
    yield
    torch.set_num_threads(threads[0])
    numba.set_num_threads(threads[1])


@pytest.fixture(scope="session")
def workplace(tmp_path_factory) -> Path:
    """A folder with the dataset data/lab and the run runs/lab, which examples in docstrings use."""
    import bisplat

    folder = tmp_path_factory.mktemp("workplace")
    coarse = bisplat.Propagation(max_depth=1, diffraction=False, rays=20_000)
    dataset = bisplat.simulate("lab", folder / "data" / "lab", n=40, propagation=coarse)
    bisplat.train(dataset, folder / "runs" / "lab")
    return folder
