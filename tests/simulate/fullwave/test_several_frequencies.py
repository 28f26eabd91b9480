"""Bands and several frequencies in full wave: what one run solves, and the datasets that are made of its fields."""

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
from simulate.fullwave.pulse import Pulse, spectrum
from simulate.fullwave.run_plan import BandPlan
from simulate.fullwave.stored_field import read_stored_field
from simulate.fullwave.yee_grid import YeeGrid
from simulate.generation.simulation import simulate
from simulate.spectra.band import Band
from tests.simulate.fullwave.free_space_solver import (
    FreeSpaceSolver,
    floor_and_two_elements,
    free_scene,
    planned_run,
    replace_solver,
)

NEAR, FAR = (905e6, 915e6, 925e6), 1.8e9
SETTINGS = {"n": 6, "engine": "fullwave", "cell": 0.018, "workers": 1, "frequencies": (*NEAR, FAR)}
"""The cells of 915 MHz are twice as large as those of 1.8 GHz."""


@pytest.fixture
def scene() -> Scene:
    region = Transmitter((0.35, 0.4, 0.4), (0.5, 0.6, 0.5), pattern="dipole")
    return replace(floor_and_two_elements(), transmitter=region)


BAND, CARRIER = Band(40e6, 4), 915e6


@pytest.fixture(scope="module")
def free() -> Scene:
    return free_scene(2, (-0.65, -0.05, -0.05), (-0.55, 0.05, 0.05))


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
    carrier, wanted = 915e6, np.array([0.75, 1.25]) * 915e6
    scene = free_scene(1, (-0.6, -0.05, -0.05), (-0.5, 0.05, 0.05))
    band = BandPlan(wanted, wanted, 0.0, 3)
    planned = planned_run(scene, YeeGrid((-0.9, -0.45, -0.45), 0.025, (48, 36, 36)), 700, 500, band)
    field = stored_field(planned, tmp_path).by_frequency(carrier)
    positions = np.random.default_rng(0).uniform(*scene.transmitter.region, (50, 3))
    for frequency in (carrier, *wanted):
        ends = np.zeros(3), element_direction(scene), positions, transmitter_direction(scene)
        expected = free_space_response(*ends, frequency)
        found = field[frequency].responses(positions)[:, 0]
        assert np.linalg.norm(found - expected) < 0.08 * np.linalg.norm(expected)  # waves along an axis are short
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
    assert "1800 MHz; 905, 915 and 925 MHz together" in capsys.readouterr().err


def test_field_of_several_frequencies_serves_other_datasets(scene, solver, tmp_path):
    simulate(scene, tmp_path / "data", **SETTINGS)
    field = {"engine": "fullwave", "field": tmp_path / "data"}
    few = simulate(scene, tmp_path / "few", n=9, **field, frequencies=(FAR, 925e6))
    one = simulate(scene, tmp_path / "one", n=9, **field)  # at the scene's own frequency
    assert len(solver.runs) == 4 and one.frequency.hertz == 915e6
    for found in (few, read_dataset(tmp_path / "few", FAR), one):
        expected = free_space(scene, found.positions, found.frequency.hertz)
        assert np.linalg.norm(found.responses - expected) < 0.08 * np.linalg.norm(expected)
    with pytest.raises(InputError, match=r"data: expected a field at 950 MHz, found one at 905 MHz"):
        simulate(scene, tmp_path / "other", n=9, **field, frequencies=(950e6,))
    with pytest.raises(InputError, match=r"one: expected a field at 925 MHz, found one at 915 MHz"):
        simulate(scene, tmp_path / "other", n=9, engine="fullwave", field=tmp_path / "one", frequencies=(925e6,))


@pytest.fixture(scope="module")
def field(free, tmp_path_factory):
    """The field of a small domain without objects."""
    band = BandPlan(BAND.frequencies(CARRIER), BAND.frequencies(CARRIER), 5e-9)
    planned = planned_run(free, YeeGrid((-1.05, -0.54, -0.54), 0.03, (48, 36, 36)), 700, 500, band)
    return stored_field(planned, tmp_path_factory.mktemp("field"))


def test_every_subcarrier_is_the_field_of_a_dipole(free, field):
    positions = np.random.default_rng(0).uniform(*free.transmitter.region, (50, 3))
    found = field.band_responses(positions, BAND)
    elements = element_positions(free.gateway, free.wavelength)
    directions = element_direction(free), transmitter_direction(free)
    for number, frequency in enumerate(BAND.frequencies(CARRIER)):
        for element, place in enumerate(elements):
            expected = free_space_response(place, directions[0], positions, directions[1], frequency)
            error = np.linalg.norm(found[:, element, number] - expected) / np.linalg.norm(expected)
            assert error < 0.06, (number, element)  # waves along an axis of the cells are too short
    np.testing.assert_allclose(found[..., BAND.carrier], field.responses(positions), rtol=1e-4)


def test_band_is_written_and_read(field, tmp_path):
    field.write(tmp_path / "field.npz")
    again = read_stored_field(tmp_path / "field.npz")
    assert again.band is not None
    np.testing.assert_array_equal(again.band.values, field.band.values)
    np.testing.assert_array_equal(again.band.frequencies, field.band.frequencies)
    replace(field, band=replace(field.band, solved=field.band.solved[:-1])).write(tmp_path / "field.npz")
    with pytest.raises(InputError, match="expected the field at each frequency of its band"):
        read_stored_field(tmp_path / "field.npz")


def test_pulse_has_no_direct_current_and_hardly_any_beyond_its_reach():
    pulse, step = Pulse(1e9), 2e-11
    current = pulse.current(step * (np.arange(int(pulse.duration / step)) + 0.5))
    at = np.abs(spectrum(current, np.array([0.0, 0.9e9, 1e9, 1.1e9, 1.7e9]), step))
    assert at[0] < 1e-4 * at[2] and at[4] < 1e-4 * at[2]
    assert 0.7 * at[2] < at[1] < at[2] and 0.7 * at[2] < at[3] < at[2]
