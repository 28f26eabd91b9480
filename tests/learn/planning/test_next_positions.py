"""Planned positions: free, in the region, better than uniform ones, beside what a run knows, in a CSV."""

from dataclasses import replace

import numpy as np
import pytest
import torch

import bisplat
from learn.planning import candidates, planned_fields
from learn.planning.candidates import candidates_among, free_candidates
from learn.planning.next_positions import plan
from learn.planning.planned_fields import Field, fields_of_model, fields_of_run
from learn.training.run_folder import Run
from scenes.checks.occupancy import inside_object
from scenes.files.errors import InputError
from scenes.places.built_in import closet
from scenes.scene.description import Scene, SceneObject
from scenes.scene.shapes import box
from scenes.storage.scene_writing import write_scene
from simulate.positions.placement import place
from simulate.positions.positions import read_points
from simulate.rays.core.propagation import Propagation
from tests.small_scene import small_scene

COARSE = Propagation(max_depth=1, rays=10_000, diffraction=False)
TWO = np.array([[[2.1, 0.0, 1.5]], [[2.4, 0.1, 1.4]]])
CRATE = SceneObject("crate", box((2.0, -0.5, 0.001), (2.5, 0.5, 1.3)), "metal")


@pytest.fixture(autouse=True)
def fewer(monkeypatch):
    """Fewer candidates and traced positions, which take less time."""
    monkeypatch.setattr(candidates, "CANDIDATES", 400)
    monkeypatch.setattr(planned_fields, "TRACED", 40)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return small_scene(CRATE)


@pytest.fixture(scope="module")
def traced_run(scene, tmp_path_factory) -> Run:
    folder = tmp_path_factory.mktemp("plan")
    dataset = bisplat.simulate(scene, folder / "data", n=16, propagation=COARSE)
    return bisplat.train(dataset, folder / "run")


def variance_left(field: Field, where: np.ndarray, measured: np.ndarray) -> float:
    return float(field.open_at(where, measured).covariance.diagonal().real.mean())


def assert_free_and_in_the_region(positions: np.ndarray, scene: Scene) -> None:
    low, high = scene.transmitter.region
    assert ((positions >= low) & (positions <= high)).all()
    assert not inside_object(scene, positions).any()
    assert len(np.unique(positions, axis=0)) == len(positions)


def test_positions_in_a_scene_are_free_and_most_useful_first(scene):
    planned = plan(scene, 12, propagation=COARSE)
    assert planned.positions.shape == (12, 3)
    assert_free_and_in_the_region(planned.positions, scene)
    assert planned.open_variance[0] == pytest.approx(1, abs=1e-3)
    gains = -np.diff(planned.open_variance)
    assert (gains > 0).all() and (np.diff(gains) < 0.01).all()


def test_all_gateways_of_a_scene_count(scene, monkeypatch):
    planned_for = []

    def field(of_one):
        planned_for.append(of_one)
        length = 0.1 * len(planned_for)
        return Field(lambda a, b: np.exp(-((np.linalg.norm(a[:, None] - b, axis=-1) / length) ** 2)), 0.01)

    monkeypatch.setattr(planned_fields, "_planned_with", field)
    monkeypatch.setattr(planned_fields.KrigedField, "fit", lambda *arguments: "")
    other = replace(scene.gateway, position=(0.0, 0.3, 1.5))
    both = plan(replace(scene, further_gateways={"other": other}), 3, propagation=COARSE)
    assert len(planned_for) == 2
    slowest = plan(scene, 3, propagation=COARSE)  # whose field is the third one and varies most slowly
    assert both.open_variance[0] == pytest.approx(1) and slowest.open_variance[0] == pytest.approx(1)
    assert both.open_variance[3] > slowest.open_variance[3] + 0.001


def test_planned_positions_leave_less_open_than_uniform_ones(scene, traced_run):
    dataset = traced_run.dataset()
    known = dataset.positions[traced_run.split(dataset).known]
    planned = plan(traced_run, 10).positions
    assert_free_and_in_the_region(planned, scene)
    field = fields_of_run(traced_run, dataset, lambda *_: None)[0]
    where = place(scene, "uniform", 300, 9)
    left = variance_left(field, where, np.vstack([known, planned]))
    np.testing.assert_array_equal(planned, plan(traced_run.folder, 10).positions)
    for seed in range(3):
        assert left < variance_left(field, where, np.vstack([known, place(scene, "uniform", 10, seed)]))
    assert left < variance_left(field, where, known)


def test_open_variance_is_that_of_the_model(scene, traced_run):
    """There are so few known positions that the model predicts from all of them."""
    kriged = traced_run.model.fields["responses"]
    (field,) = (each for each in fields_of_model(traced_run.model) if np.iscomplexobj(each.covariance(*TWO)))
    where = place(scene, "uniform", 50, 9)
    found = replace(field, nugget=float(kriged.nugget), weight=1.0).open_at(where, kriged.places.double().numpy())
    expected = kriged.uncertainty(torch.from_numpy(where).float()).numpy()
    np.testing.assert_allclose(found.covariance.diagonal().real, expected, atol=2e-3)


@pytest.mark.slow
@pytest.mark.usefixtures("small_models")
def test_run_of_another_model_on_measured_spectra_has_candidates_among_its_positions(finished_run, tiny):
    planned = plan(finished_run, 5)
    known = read_points(tiny / "tx_pos.csv")
    assert (planned.positions >= known.min(axis=0) - 1e-6).all()
    assert (planned.positions <= known.max(axis=0) + 1e-6).all()
    assert planned.positions[:, 2] == pytest.approx(1)  # all are at this height
    assert planned.open_variance[-1] < planned.open_variance[0] < 0.9


def test_candidates_are_in_the_hull_of_measured_positions():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    found = candidates_among(corners, 0, "run")
    assert len(found) == 400 and (found >= -1e-9).all() and (found.sum(axis=1) <= 1 + 1e-9).all()
    turned = candidates_among(np.array([[0.0, 0, 0], [1, 1, 1], [3, 3, 3]]), 0, "run")
    assert np.ptp(turned, axis=1).max() < 1e-9 and turned.min() >= -1e-9 and turned.max() <= 3 + 1e-9
    with pytest.raises(InputError, match="run: expected at least two different positions, found one"):
        candidates_among(np.ones((4, 3)), 0, "run")


def test_command_writes_a_csv_that_simulate_reads(scene, traced_run, bisplat_command, tmp_path):
    csv, file = tmp_path / "positions.csv", write_scene(scene, tmp_path / "scene")
    status, out, _ = bisplat_command("plan", traced_run.folder, "-n", 6, "-o", csv)
    assert status == 0 and "6 positions: " in out and "open variance" in out
    assert csv.read_text().startswith("x,y,z\n")
    simulated = ("simulate", file, "-o", tmp_path / "data", "--positions", csv, "--max-depth", 0)
    assert bisplat_command(*simulated)[0] == 0
    np.testing.assert_array_equal(bisplat.read_dataset(tmp_path / "data").positions, read_points(csv))

    status, _, err = bisplat_command("plan", traced_run.folder, "-n", 2, "-o", csv)
    assert status == 1 and "--force" in err and len(read_points(csv)) == 6
    assert bisplat_command("plan", traced_run.folder, "-n", 2, "-o", csv, "--force")[0] == 0
    assert len(read_points(csv)) == 2


def test_what_is_neither_a_run_nor_a_scene_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    for subject, found in (("no\nwhere", r'"no\\nwhere": expected a run folder'), ("folder", "no config.json in it")):
        with pytest.raises(InputError, match=found):
            plan(subject)


def test_candidates_are_not_the_positions_of_a_dataset_with_the_same_seed():
    scene = closet()
    dataset = place(scene, "uniform", 500, 0)
    candidates = free_candidates(scene, 0)
    assert np.linalg.norm(candidates[:, None] - dataset, axis=-1).min() > 1e-6
