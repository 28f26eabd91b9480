"""On several machines the results are the same bytes as in one process, also when a worker dies."""

import os
import signal
import threading
import time
from dataclasses import replace

import numpy as np
import psutil
import pytest

from scenes.files.errors import InputError
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet
from simulate.engines.rays_engine import Rays
from simulate.fullwave.all_elements import stored_field
from simulate.fullwave.run_plan import plan
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
    rays = Rays(Propagation(max_depth=2, diffraction=True, rays=20_000))
    return Request(room, positions, "uniform, seed 9", rays, seed=3)


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


@pytest.fixture(scope="module")
def address():
    """Address of a cluster of one machine."""
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 2})
    yield cluster.address
    cluster.shutdown()


@pytest.fixture
def scene() -> Scene:
    floor = SceneObject("floor", sheet((0, 0, 0), (0.5, 0, 0), (0, 0.4, 0)), "concrete")
    gateway = Gateway((0.45, 0.2, 0.2), facing((-1, 0, 0)), rows=1, columns=2, pattern="dipole")
    region = Transmitter((0.1, 0.15, 0.15), (0.2, 0.25, 0.25), pattern="dipole")
    return Scene("small", 915e6, gateway, region, (floor,), p2040_materials(["concrete"], 915e6))


@pytest.mark.parametrize("further", [(), (925e6,)])
def test_cluster_and_threads_leave_the_same_field(scene, address, tmp_path, further):
    others = [scene.at_frequency(each) for each in further]
    planned = plan(scene, scene.transmitter.region, 0.03, further=others)
    here = stored_field(planned, tmp_path / "here", at_once=1)
    beside = stored_field(planned, tmp_path / "beside", at_once=2)
    reported: list[tuple[int, int]] = []
    there = stored_field(planned, tmp_path / "there", ray=address, report=lambda *each: reported.append(each))
    assert np.array_equal(here.values, there.values) and np.array_equal(here.values, beside.values)
    assert sorted(number for number, _ in reported) == [0, 1]
    assert (here.band is None) == (not further)
    if here.band is not None and there.band is not None:
        assert np.array_equal(here.band.values, there.band.values)


def test_failure_in_the_cluster_is_one_sentence(scene, address, tmp_path):
    planned = plan(scene, scene.transmitter.region, 0.03)
    outside = replace(planned, box=planned.box + 1000)
    with pytest.raises(InputError, match=r"model\.in: expected gprMax to run to its end, found that it stopped with"):
        stored_field(outside, tmp_path, solver="gprMax 4.0.1", ray=address)


def test_machines_too_small_are_told_instead_of_waited_for(scene, address, tmp_path):
    planned = plan(scene, scene.transmitter.region, 0.03)
    with pytest.raises(InputError, match=r"expected a machine with a core, .* GB of memory and a GPU in the Ray"):
        stored_field(planned, tmp_path, solver="gprMax", ray=address, gpu=True)
