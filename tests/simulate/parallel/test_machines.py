"""Ray workers make the same bytes as one process, also when one of them dies."""

import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace

import numpy as np
import psutil
import pytest

from scenes.scene.materials import p2040_materials
from simulate.engines.rays_engine import Rays
from simulate.generation import generate as module
from simulate.generation.generate import generate
from simulate.generation.request import Request
from simulate.parallel.machines import Machines, ray_cluster
from simulate.rays.core.propagation import Propagation
from tests.folders import contents

pytest.importorskip("ray", reason="Ray is an extra: make setup")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def request_of(room) -> Request:
    """Sixty positions in a room of two bounces, with a screen that diffracts."""
    screen = replace(room.objects[3], material="metal")
    room = replace(
        room, objects=(*room.objects[:3], screen), materials=room.materials | p2040_materials(["metal"], 915e6)
    )
    low, high = room.transmitter.region_min, room.transmitter.region_max
    positions = np.random.default_rng(9).uniform(low, high, (60, 3))
    return Request(
        room, positions, "uniform, seed 9", Rays(Propagation(max_depth=2, diffraction=True, rays=20_000)), seed=3
    )


def kill_a_worker(found: list[int]) -> None:
    """Wait until Ray's workers trace, then kill one of them, as a machine that goes down would."""
    for _ in range(600):
        busy = [p for p in psutil.process_iter(["name"]) if "part_by_worker" in (p.info["name"] or "")]
        busy = busy or [
            p for p in psutil.process_iter() if p.is_running() and "ray::part_by_worker" in " ".join(_line(p))
        ]
        if busy:
            time.sleep(1.0)
            os.kill(busy[0].pid, signal.SIGKILL)
            found.append(busy[0].pid)
            return
        time.sleep(0.1)


def _line(process: psutil.Process) -> list[str]:
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def test_two_workers_one_of_them_killed_make_the_same_bytes_as_one_process(request_of, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "PART", 6)
    generate(request_of, tmp_path / "alone")
    killed: list[int] = []
    killer = threading.Thread(target=kill_a_worker, args=(killed,))
    killer.start()
    generate(request_of, tmp_path / "together", Machines(workers=2))
    killer.join()
    assert killed
    assert contents(tmp_path / "together") == contents(tmp_path / "alone")


def test_workers_do_not_join_another_programs_cluster():
    from ray.cluster_utils import Cluster

    other = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        with ray_cluster(None) as ray:
            assert ray.get_runtime_context().gcs_address != other.address
    finally:
        other.shutdown()


def test_no_cluster_at_the_address_is_one_sentence(tmp_path):
    command = [sys.executable, "-m", "bisplat", "simulate", "lab", "-n", "2", "--max-depth", "0", "-o", tmp_path / "d"]
    done = subprocess.run([*command, "--ray", "127.0.0.1:1"], capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    assert done.stderr.startswith(
        "bisplat: --ray: expected the host:port of a running Ray cluster, found '127.0.0.1:1'"
    )
    assert not (tmp_path / "d").exists()
