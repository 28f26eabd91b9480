"""Runs of the elements, kept as they end, and datasets made of their field; the solver is replaced by a formula."""

import json
import time
from dataclasses import replace
from itertools import count
from threading import Event

import numpy as np
import pytest

from benchmarks.ledger.exact_fields import free_space_response
from scenes.checks.occupancy import element_positions
from scenes.files.errors import InputError, ParameterError
from scenes.scene.description import Scene
from simulate.engines.field_folder import FIELD
from simulate.fullwave import element_fields
from simulate.generation.simulation import simulate
from tests.simulate.fullwave.free_space_solver import FreeSpaceSolver, floor_and_two_elements, replace_solver


@pytest.fixture
def scene() -> Scene:
    return floor_and_two_elements()


@pytest.fixture
def solver(monkeypatch) -> FreeSpaceSolver:
    return replace_solver(monkeypatch)


def test_dataset_has_the_responses_of_the_field(scene, solver, tmp_path):
    dataset = simulate(scene, tmp_path / "small", n=12, engine="fullwave", cell=0.03, workers=1)
    assert len(solver.sources) == 2
    up = np.array([0.0, 0, 1])
    each = [free_space_response(element, up, dataset.positions, up, 915e6) for element in solver.sources]
    expected = np.stack(each, axis=1)
    # A field known at the middles of cells is taken for the mean of their edges, whose inverse raises it by about 2 %.
    assert np.abs(dataset.responses / expected - 1).max() < 0.08
    metadata = json.loads((tmp_path / "small" / "metadata.json").read_text())
    assert metadata["engine"] == "fullwave" and metadata["fullwave"]["cell"] == 0.03
    assert metadata["fullwave"]["solver"] == "bisplat" and "propagation" not in metadata


def test_elements_at_given_places_are_run_at_these_places(scene, solver, tmp_path):
    places = ((0.0, 0.0, 0.0), (0.05, 0.02, 0.03), (-0.04, 0.06, -0.02))
    given = replace(scene, gateway=replace(scene.gateway, rows=4, columns=4, elements=places))
    made = simulate(given, tmp_path / "small", n=12, engine="fullwave", cell=0.03, workers=1)
    expected = element_positions(given.gateway, given.wavelength)
    np.testing.assert_allclose(np.stack(solver.sources), expected, atol=1e-9)
    assert made.responses.shape == (12, 3) and made.array.positions_m == places and made.array.frequency == 915e6
    again = simulate(given, tmp_path / "more", n=20, engine="fullwave", field=tmp_path / "small")
    assert len(solver.sources) == 3 and again.array == made.array


def test_interrupt_ends_the_runs_beside(scene, solver, monkeypatch, tmp_path):
    beside, ended, calls = Event(), Event(), count()

    def solve(cells, grid, sources, frequencies, axes, box, steps, earliest, watched, report):
        if next(calls) == 0:
            beside.wait(10)
            raise KeyboardInterrupt
        beside.set()
        try:
            for _ in range(1000):
                report(1)
                time.sleep(0.01)
        except InterruptedError:
            ended.set()
            raise

    monkeypatch.setattr(element_fields, "solve", solve)
    with pytest.raises(KeyboardInterrupt):
        simulate(scene, tmp_path / "small", n=4, engine="fullwave", cell=0.03, workers=2)
    assert ended.is_set()


def test_settings_that_do_not_fit_are_refused_before_anything_is_written(scene, solver, tmp_path):
    with pytest.raises(ParameterError, match="cell: expected none, or the engine fullwave"):
        simulate(scene, tmp_path / "a", n=4, cell=0.03)
    with pytest.raises(ParameterError, match=r"cell: expected at most 0\.0357 m"):
        simulate(scene, tmp_path / "a", n=4, engine="fullwave", cell=0.1)
    with pytest.raises(InputError, match="expected the folder of a finished simulation with --engine fullwave"):
        simulate(scene, tmp_path / "a", n=4, engine="fullwave", field=tmp_path)
    assert not (tmp_path / "a").exists()


def test_what_differs_in_the_scene_of_a_field_is_named(scene, solver, tmp_path):
    simulate(scene, tmp_path / "small", n=4, engine="fullwave", cell=0.03)
    turned = replace(scene, gateway=replace(scene.gateway, rows=1, columns=2))
    nearer = replace(scene, transmitter=replace(scene.transmitter, region_max=(0.6, 0.7, 0.55)))
    for other, words in (
        (turned, "'rows': 2, 'columns': 1.* instead of .*'rows': 1, 'columns': 2"),
        (nearer, "differs in .* region"),
    ):
        with pytest.raises(InputError, match=f"'small', .*{words}"):
            simulate(other, tmp_path / "b", n=4, engine="fullwave", field=tmp_path / "small")


def test_field_that_does_not_fit_is_refused_and_not_copied(scene, solver, tmp_path):
    """Each file is valid alone. The same command works once the field is mended."""
    folder = simulate(scene, tmp_path / "small", n=4, engine="fullwave", cell=0.03).folder
    file, again = folder / FIELD, {"n": 5, "engine": "fullwave", "field": folder}
    whole, field = file.read_bytes(), dict(np.load(file))
    fewer = {"values": field["values"][:1], "unsettled": field["unsettled"][:1]}
    for change, words in (
        (fewer, "of 2 × 1 elements of small, found that of 1"),
        ({"origin": field["origin"] + 0.3}, r"in the whole region of the transmitters, from \[0\.35, 0\.3, 0\.3\]"),
    ):
        np.savez(file, **{**field, **change})
        with pytest.raises(InputError, match=rf"{file}: expected .*{words}"):
            simulate(scene, tmp_path / "more", **again)
        assert not (tmp_path / "more").exists()
    file.write_bytes(whole)
    with pytest.raises(InputError, match=rf"{file}: expected .* known in the whole region"):
        simulate(scene, tmp_path / "more", **again, positions=[[0.5, 0.5, 0.5], [5, 0.5, 0.5]])
    assert len(simulate(scene, tmp_path / "more", **again).names) == 5


def test_damaged_field_of_a_finished_dataset_is_solved_again(scene, solver, tmp_path, capsys):
    folder = simulate(scene, tmp_path / "small", n=4, engine="fullwave", cell=0.03).folder
    field, runs = (folder / FIELD).read_bytes(), len(solver.sources)
    (folder / FIELD).write_bytes(field[:-100])
    simulate(scene, folder, n=4, engine="fullwave", cell=0.03)
    assert (folder / FIELD).read_bytes() == field and len(solver.sources) == 2 * runs
    assert f"{folder / FIELD}: expected the stored field of a full-wave run" in capsys.readouterr().err
    (tmp_path / "more").mkdir()
    simulate(scene, tmp_path / "more", n=5, engine="fullwave", field=folder)
    assert len(solver.sources) == 2 * runs


@pytest.mark.parametrize("damaged", [False, True])
def test_interrupted_runs_are_continued_and_damaged_ones_repeated(damaged, scene, solver, tmp_path, capsys):
    settings = {"n": 12, "engine": "fullwave", "cell": 0.03, "workers": 1}
    solver.interrupted_at = 1
    with pytest.raises(KeyboardInterrupt):
        simulate(scene, tmp_path / "small", **settings)
    solver.interrupted_at, element = None, tmp_path / "small" / "field" / "element-000.npz"
    if damaged:
        element.write_bytes(b"")
    assert len(simulate(scene, tmp_path / "small", **settings).names) == 12
    assert len(solver.sources) == 2 + damaged
    assert (f"bisplat: {element}: expected the stored field" in capsys.readouterr().err) == damaged
    assert not (tmp_path / "small" / "field").exists()


def test_dataset_by_gprmax_is_made_once_more_by_gprmax(scene, solver, monkeypatch, tmp_path):
    folder = simulate(scene, tmp_path / "small", n=4, engine="fullwave", cell=0.03).folder
    path = folder / "metadata.json"
    path.write_text(path.read_text().replace('"solver": "bisplat"', '"solver": "gprMax 4.0.1"'))
    ran = []

    def run(working, geometry, grid, source, box, ends, gpu, report):
        ran.append(gpu)
        return np.random.default_rng(0).standard_normal((1, 3, *np.diff(box, axis=0)[0])) * np.ones((3, 1, 1, 1, 1))

    monkeypatch.setattr(element_fields, "run", run)
    again = simulate(folder, tmp_path / "again")
    assert ran == [False, False]
    assert json.loads((again.folder / "metadata.json").read_text())["fullwave"]["solver"] == "gprMax 4.0.1"
