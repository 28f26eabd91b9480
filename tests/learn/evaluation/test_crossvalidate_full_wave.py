"""Rays against a full-wave dataset, and cross-validation by its stored field; the solver is replaced by a formula."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from benchmarks.ledger.exact_fields import free_space_response
from benchmarks.ledger.rays_against_full_wave import compare_engines, compare_on_plane, compare_responses, draw_plane
from learn.evaluation.crossvalidate import crossvalidate
from learn.fitted.runs import train
from scenes.checks.occupancy import element_positions
from scenes.files.errors import InputError
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet
from simulate.dataset.dataset import Dataset
from simulate.fullwave import all_elements, run_plan
from simulate.fullwave.stored_field import StoredField
from simulate.generation.simulation import simulate
from simulate.rays.core.propagation import Propagation

LINE_OF_SIGHT, ONCE = Propagation(max_depth=0, rays=1000), Propagation(max_depth=1, diffraction=False, rays=20_000)


@pytest.fixture(scope="module", autouse=True)
def in_free_space():
    """The solver's field is that in free space."""

    def field(planned, folder, at_once, solver, gpu, ray, report):
        scene = planned.scene
        low, high = scene.transmitter.region + np.array([[-0.2], [0.2]])
        size = np.ceil((high - low) / 0.02).astype(int) + 1
        index = np.stack(np.meshgrid(*(np.arange(count) for count in size), indexing="ij"), axis=-1)
        points, up = low + 0.02 * index.reshape(-1, 3), np.array([0.0, 0.0, 1.0])
        values = [
            free_space_response(each, up, points, up, scene.frequency)
            for each in element_positions(scene.gateway, scene.wavelength)
        ]
        folder.mkdir()
        return StoredField(low, 0.02, np.stack(values).reshape(-1, *size), np.zeros(16), 900)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(all_elements, "stored_field", field)
        yield


@pytest.fixture(scope="module")
def floor_scene() -> Scene:
    """A floor, and patch-like elements, which full wave makes short dipoles."""
    floor = SceneObject("floor", sheet((-5, -5, 0), (10, 0, 0), (0, 10, 0)), "concrete")
    gateway = Gateway((0, 0, 1.5), facing((-1, 0, 0)), pattern="tr38901")
    region = Transmitter((-2.5, -0.5, 0.8), (-1.5, 0.5, 1.4))
    return Scene("floor", 915e6, gateway, region, (floor,), p2040_materials(["concrete"], 915e6))


@pytest.fixture(scope="module")
def full_wave(floor_scene, tmp_path_factory) -> Dataset:
    """To be read from only."""
    folder = tmp_path_factory.mktemp("engines") / "floor"
    return simulate(floor_scene, folder, n=24, engine="fullwave", cell=0.03)


def test_benchmark_finds_the_field_in_free_space_and_a_reflection_that_it_lacks(full_wave):
    sight, reflected = (compare_engines(full_wave.folder, each, 20).metrics() for each in (LINE_OF_SIGHT, ONCE))
    assert sight["correlation_rays"] > 0.999 and sight["correlation_rays_together"] > 0.999
    assert sight["ssim_rays"] > 0.97 and abs(sight["level_bias_db"]) < 0.2
    assert 1 - reflected["correlation_rays_together"] > 3 * (1 - sight["correlation_rays_together"])
    stronger = compare_responses(full_wave, np.arange(5), 2 * full_wave.responses[:5])
    assert stronger.metrics()["level_bias_db"] == pytest.approx(20 * np.log10(2))


def test_plane_of_the_benchmark_shows_each_depths_error_and_counts_paths(full_wave, tmp_path):
    plane = compare_on_plane(full_wave.folder, ONCE)
    assert plane.errors_db[0].max() < -25  # the field is that in free space, near field included
    assert plane.errors_db[1].mean() > plane.errors_db[0].max() + 4  # and lacks the reflection
    assert (plane.paths == 2).all()
    draw_plane(replace(plane, paths=plane.paths + (plane.x > -2)), tmp_path)
    with Image.open(tmp_path / "engines_plane.png") as image:
        assert "the full wave of floor at z = " in image.text["Description"]


@pytest.mark.slow
def test_run_on_full_wave_is_validated_by_the_stored_field(floor_scene, full_wave, tmp_path):
    run = train(full_wave, tmp_path / "run")
    fresh = crossvalidate(run, floor_scene, positions=8)
    assert fresh.truth_by == "full wave"
    assert np.median(fresh.correlation) > 0.99


@pytest.mark.slow
def test_run_on_rays_is_validated_by_full_wave_if_asked(floor_scene, full_wave, tmp_path, monkeypatch):
    dipoles = replace(
        floor_scene,
        gateway=replace(floor_scene.gateway, pattern="dipole"),
        transmitter=replace(floor_scene.transmitter, pattern="dipole"),
    )
    rays = simulate(dipoles, tmp_path / "rays", n=24, propagation=LINE_OF_SIGHT)
    run = train(rays, tmp_path / "run")
    fresh = crossvalidate(run, floor_scene, positions=8, field=full_wave.folder)
    assert fresh.truth_by == "full wave" and np.median(fresh.correlation) > 0.99
    thicker = replace(floor_scene, objects=(replace(floor_scene.objects[0], thickness=0.3),))
    with pytest.raises(InputError, match="expected the field of the same scene, found that of 'floor', which differs"):
        crossvalidate(run, thicker, positions=8, field=full_wave.folder)
    monkeypatch.setattr(run_plan, "default_cell", lambda scene: 0.03)  # which the formula ignores
    solved = crossvalidate(run, dipoles, positions=8, engine="fullwave")
    assert solved.truth_by == "full wave" and (tmp_path / "run" / "fullwave" / "field.npz").is_file()
    np.testing.assert_allclose(solved.correlation, fresh.correlation)
    assert crossvalidate(run, dipoles, positions=8, engine="rays").truth_by == "fresh ray tracing"
