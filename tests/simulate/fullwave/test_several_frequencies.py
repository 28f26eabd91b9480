"""Several frequencies in full wave: which of them one run solves, and the datasets that are made of their fields."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.ledger.exact_fields import free_space_response
from scenes.checks.occupancy import element_positions
from scenes.files.errors import InputError
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import RadioMaterial, p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet
from simulate.dataset.dataset_folder import read_dataset
from simulate.fullwave.all_elements import stored_field
from simulate.fullwave.dipole import element_direction, transmitter_direction
from simulate.fullwave.frequency_groups import LARGEST_DIFFERENCE, LEAST_LEVEL, frequency_groups
from simulate.fullwave.pulse import Pulse
from simulate.fullwave.run_plan import BandPlan, Plan
from simulate.fullwave.stored_field import MARGIN
from simulate.fullwave.yee_grid import YeeGrid, numerical_frequency
from simulate.generation.simulation import simulate
from tests.simulate.fullwave.free_space_solver import FreeSpaceSolver, floor_and_two_elements, replace_solver

NEAR, FAR = (905e6, 915e6, 925e6), 1.8e9
SETTINGS = {"n": 6, "engine": "fullwave", "cell": 0.018, "workers": 1, "frequencies": (*NEAR, FAR)}
"""The cells of 915 MHz are twice as large as those of 1.8 GHz."""


@pytest.fixture
def scene() -> Scene:
    region = Transmitter((0.35, 0.4, 0.4), (0.5, 0.6, 0.5), pattern="dipole")
    return replace(floor_and_two_elements(), transmitter=region)


@pytest.fixture
def solver(monkeypatch) -> FreeSpaceSolver:
    return replace_solver(monkeypatch)


TOGETHER, ALONE = [900, 910, 920], [1790]


def test_near_frequencies_are_solved_together(scene):
    scenes = [scene.at_frequency(each) for each in (*NEAR, FAR)]
    far, near = frequency_groups(scenes, 0.01)
    assert near.frequencies == list(NEAR) and near.scene.frequency == 915e6 and near.cell == 0.019
    assert far.frequencies == [FAR] and far.cell == 0.01 and far.difference == 0
    assert 0.0005 < near.difference < 0.001 and "905, 915 and 925 MHz together" in near.in_words
    assert [each.frequencies for each in frequency_groups(scenes, 0.01, alone=True)] == [
        [each] for each in (FAR, *reversed(NEAR))
    ]


def test_materials_and_the_pulse_limit_what_one_run_solves(scene):
    many = np.linspace(0.91e9, 2e9, 24)
    groups = frequency_groups([scene.at_frequency(each) for each in many], 0.008)
    assert [each for group in groups[::-1] for each in group.frequencies] == many.tolist()
    assert 3 < len(groups) < 12 and all(group.difference <= LARGEST_DIFFERENCE for group in groups)
    steady = replace(scene, materials={"concrete": RadioMaterial("concrete", 1.05, 0.0, 0.1)})
    groups = frequency_groups([replace(steady, frequency=float(each)) for each in many], 0.008)
    assert len(groups) == 2
    levels = [Pulse(group.scene.frequency).level(each) for group in groups for each in group.frequencies]
    assert LEAST_LEVEL <= min(levels) < 0.2


def test_pulse_serves_frequencies_where_its_spectrum_is_weak(tmp_path):
    """The field of a dipole in free space, near the largest and the least frequency of a run."""
    carrier, cell = 915e6, 0.025
    wanted = np.array([0.75, 1.25]) * carrier
    gateway = Gateway((0.0, 0.0, 0.0), facing((-1, 0, 0)), rows=1, columns=1, pattern="dipole")
    region = Transmitter((-0.6, -0.05, -0.05), (-0.5, 0.05, 0.05), pattern="dipole")
    far = SceneObject("far", sheet((-50, 0, 0), (0, 1, 0), (0, 0, 1)), "metal")  # a scene needs an object
    scene = Scene("free", carrier, gateway, region, (far,), {"metal": RadioMaterial("metal", 1.0, 1e7, 0.002)})
    grid, box = YeeGrid((-0.9, -0.45, -0.45), cell, (48, 36, 36)), np.zeros((2, 3))
    box[0] = np.floor((scene.transmitter.region[0] - grid.origin) / cell) - MARGIN
    box[1] = np.ceil((scene.transmitter.region[1] - grid.origin) / cell) + MARGIN
    band = BandPlan(wanted, wanted, 0.0, 3)
    planned = Plan(grid, numerical_frequency(scene.wavelength, cell), 700, box.astype(int), 500, band)
    field = stored_field(scene, planned, tmp_path).by_frequency(carrier)
    positions = np.random.default_rng(0).uniform(*scene.transmitter.region, (50, 3))
    for frequency in (carrier, *wanted):
        ends = np.zeros(3), element_direction(scene), positions, transmitter_direction(scene)
        expected = free_space_response(*ends, frequency)
        found = field[frequency].responses(positions)[:, 0]
        assert np.linalg.norm(found - expected) < 0.08 * np.linalg.norm(expected), (
            frequency
        )  # waves along an axis are short
        assert field[frequency].interpolation_error_db < -30
    assert Pulse(carrier).level(wanted[0]) < 0.12


def test_one_run_gives_what_runs_at_each_frequency_give(tmp_path):
    """With a floor of concrete, whose conductivity differs between the frequencies."""
    floor = SceneObject("floor", sheet((0, 0, 0), (0.5, 0, 0), (0, 0.4, 0)), "concrete")
    gateway = Gateway((0.45, 0.2, 0.2), facing((-1, 0, 0)), rows=1, columns=1, pattern="dipole")
    region = Transmitter((0.1, 0.15, 0.15), (0.2, 0.25, 0.25), pattern="dipole")
    scene = Scene("small", 915e6, gateway, region, (floor,), p2040_materials(["concrete"], 915e6))
    settings = {"n": 12, "engine": "fullwave", "cell": 0.03}
    simulate(scene, tmp_path / "all", **settings, frequencies=(905e6, 915e6, 925e6))
    assert {path.name for path in (tmp_path / "all").glob("field*")} == {
        f"field-{each}MHz.npz" for each in (905, 915, 925)
    }
    one = simulate(scene, tmp_path / "one", **settings, frequencies=(925e6,))
    found, other = (read_dataset(tmp_path / "all", frequency) for frequency in (925e6, 905e6))
    np.testing.assert_array_equal(found.positions, one.positions)
    assert np.linalg.norm(found.responses - one.responses) < 10 ** (-50 / 20) * np.linalg.norm(one.responses)
    assert np.linalg.norm(other.responses - one.responses) > 0.05 * np.linalg.norm(one.responses)


def free_space(scene: Scene, positions: np.ndarray, frequency: float) -> np.ndarray:
    up = np.array([0.0, 0.0, 1.0])
    elements = element_positions(scene.gateway, scene.wavelength)  # the same places at each frequency
    return np.stack([free_space_response(each, up, positions, up, frequency) for each in elements], axis=1)


def test_dataset_has_every_frequency(scene, solver, tmp_path):
    first = simulate(scene, tmp_path / "data", **SETTINGS)
    assert solver.runs == [ALONE] * 2 + [TOGETHER] * 2
    assert first.metadata["fullwave"]["runs_hz"] == [[FAR], list(NEAR)]
    for frequency in (*NEAR, FAR):
        found = read_dataset(tmp_path / "data", frequency)
        expected = free_space(scene, found.positions, frequency)
        assert np.linalg.norm(found.responses - expected) < 0.08 * np.linalg.norm(expected), frequency
    assert not (tmp_path / "data" / "field").exists()
    simulate(tmp_path / "data", tmp_path / "again")
    assert solver.runs == ([ALONE] * 2 + [TOGETHER] * 2) * 2
    assert (tmp_path / "again/channels.npz").read_bytes() == (tmp_path / "data/channels.npz").read_bytes()


def test_finished_run_is_not_solved_again(scene, solver, tmp_path, capsys):
    solver.interrupted_at = 3
    with pytest.raises(KeyboardInterrupt):
        simulate(scene, tmp_path / "data", **SETTINGS)
    solver.interrupted_at = None
    simulate(scene, tmp_path / "data", **SETTINGS)
    assert solver.runs == [ALONE] * 2 + [TOGETHER] * 2
    assert (
        "4 frequencies in 2 runs for each element: 1800 MHz; 905, 915 and 925 MHz together" in capsys.readouterr().err
    )
    file = tmp_path / "data" / "field-905MHz.npz"
    whole = file.read_bytes()
    file.write_bytes(whole[:-100])
    simulate(scene, tmp_path / "data", **SETTINGS)
    assert solver.runs[4:] == [TOGETHER] * 2 and file.read_bytes() == whole
    assert f"{file}: expected the stored field of a full-wave run" in capsys.readouterr().err


def test_field_of_several_frequencies_serves_other_datasets(scene, solver, tmp_path):
    simulate(scene, tmp_path / "data", **SETTINGS)
    field = {"engine": "fullwave", "field": tmp_path / "data"}
    few = simulate(scene, tmp_path / "few", n=9, **field, frequencies=(FAR, 925e6))
    one = simulate(scene, tmp_path / "one", n=9, **field)  # at the scene's own frequency
    assert len(solver.runs) == 4 and one.frequency.hertz == 915e6
    for found in (few, read_dataset(tmp_path / "few", FAR), one):
        expected = free_space(scene, found.positions, found.frequency.hertz)
        assert np.linalg.norm(found.responses - expected) < 0.08 * np.linalg.norm(expected)
    with pytest.raises(
        InputError, match=r"data: expected a field at 950 MHz, found one at 905 MHz, 915 MHz, 925 MHz, 18"
    ):
        simulate(scene, tmp_path / "other", n=9, **field, frequencies=(950e6,))
    with pytest.raises(InputError, match=r"one: expected a field at 925 MHz, found one at 915 MHz"):
        simulate(scene, tmp_path / "other", n=9, engine="fullwave", field=tmp_path / "one", frequencies=(925e6,))
