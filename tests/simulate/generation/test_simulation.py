"""``simulate`` as a function: the same bytes as the command's, and what it refuses."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from bisplat.__main__ import main
from scenes.files.errors import InputError, ParameterError
from scenes.scene.materials import RadioMaterial
from scenes.storage.scene_writing import write_scene
from simulate.dataset.dataset_folder import inspect
from simulate.engines import rays_engine
from simulate.generation.simulation import simulate
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.sionna_scene import build_scene
from simulate.spectra.measurement import Measurement
from tests.folders import contents

DIRECT = Propagation(max_depth=0)


@pytest.fixture(scope="module")
def scene(make_scene, floor):
    """A floor and one gateway."""
    return make_scene(floor)


def test_function_and_command_write_the_same_bytes(scene, tmp_path, monkeypatch):
    found = simulate(scene, tmp_path / "function", n=3, seed=2, propagation=DIRECT)
    path = write_scene(scene, tmp_path / "scene")
    command = f"bisplat simulate {path} -o {tmp_path / 'command'} -n 3 --seed 2 --max-depth 0"
    monkeypatch.setattr(sys, "argv", command.split())
    main()
    assert contents(tmp_path / "function") == contents(tmp_path / "command")
    again = simulate(str(tmp_path / "function"), str(tmp_path / "again"))
    assert contents(tmp_path / "again") == contents(tmp_path / "function")
    assert (again.responses == found.responses).all()


def test_materials_for_another_frequency_are_said(scene, tmp_path, capsys):
    concrete = replace(scene.materials["concrete"], frequency=2.4e9)
    old = replace(scene, materials=scene.materials | {"concrete": concrete})
    simulate(old, tmp_path / "d", n=2, propagation=DIRECT)
    assert 'material "concrete": its values are for 2400 MHz' in capsys.readouterr().err


def test_a_position_may_occur_twice(scene, tmp_path):
    """What ``simulate`` writes, ``check`` accepts: noise differs from spectrum to spectrum."""
    positions, noisy = [[-3, 0, 1], [-3, 0, 1], [-4, 0.5, 1]], Measurement(snr_db=20)
    folder = simulate(scene, tmp_path / "d", positions=positions, measurement=noisy, propagation=DIRECT).folder
    found = inspect(folder)
    assert found.problems == [] and "2 of 3 pictures share their position" in " ".join(found.warnings)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"n": 1}, "n: expected a whole number of at least 2, found 1"),
        ({"positions": [[-3, 0, 1]] * 2}, "positions: expected at least two different positions, found 2 alike"),
        ({"placement": "line"}, "placement: .* found 'line'"),
        ({"power_db": "no"}, "power_db: .* found 'no'"),
        ({"measurement": 20}, "measurement: expected Measurement, found 20"),
        ({"engine": "ray"}, "engine: .* found 'ray'; did you mean \"rays\""),
        ({"positions": np.full((2, 3), np.nan)}, "positions: .* in row 0"),
    ],
)
def test_parameters_out_of_range_are_refused_before_anything_is_written(wrong, message, scene, tmp_path):
    with pytest.raises(ParameterError, match=message):
        simulate(scene, tmp_path / "d", propagation=DIRECT, **wrong)
    assert not (tmp_path / "d").exists()


def test_several_gateways_are_refused(scene, tmp_path):
    several = replace(scene, further_gateways={"west": replace(scene.gateway, position=(-7.0, 0.0, 1.5))})
    with pytest.raises(InputError, match="expected a scene of one gateway, found 2"):
        simulate(several, tmp_path / "d")


def test_memory_that_is_not_there_is_told_before(scene, tmp_path, monkeypatch):
    monkeypatch.setattr(rays_engine, "machine_memory", lambda: 6e8 + 2500)
    with pytest.raises(InputError, match=r"expected at most 1 triangles, since this machine has 0\.6 GB"):
        simulate(scene, tmp_path / "d", n=3)
    assert not (tmp_path / "d").exists()


def test_a_built_in_scene_and_a_folder_of_its_name_are_told_apart(scene, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    simulate(scene, "closet", n=3, seed=2, propagation=DIRECT)
    with pytest.raises(InputError, match=r"closet: .* found a built-in scene and a"):
        simulate("closet", "other", n=3)
    again = simulate("./closet", "again")
    assert contents(tmp_path / "again") == contents(tmp_path / "closet") and len(again) == 3


def test_a_dataset_of_a_scene_from_python_can_be_made_again(scene, tmp_path):
    """Whole numbers, a colour as an array, and a material that is not called as in the scene."""
    slab = RadioMaterial("tile", 6, 0, 1, color=np.array([0, 0, 1]))  # type: ignore[arg-type]
    item = replace(scene.objects[0], material="floor", thickness=2)
    gateway = replace(scene.gateway, spacing=1)
    given = replace(scene, objects=(item,), materials={"floor": slab}, gateway=gateway, frequency=915_000_000)
    made = simulate(given, tmp_path / "made", n=3, seed=2, propagation=DIRECT)
    assert (simulate(made.folder, tmp_path / "again").responses == made.responses).all()


def test_sionna_tells_materials_apart_whose_names_are_the_same(scene):
    dry = scene.materials["concrete"]
    items = tuple(replace(scene.objects[0], name=name, material=name) for name in ("dry", "wet"))
    wet = replace(dry, conductivity=1.0)
    sionna = build_scene(replace(scene, objects=items, materials={"dry": dry, "wet": wet}))
    assert len({float(item.radio_material.conductivity[0]) for item in sionna.objects.values()}) == 2
