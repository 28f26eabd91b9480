"""Diffuse reflection by patches: Sionna's power, one field per seed, no power lost or gained."""

from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest

from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_material
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet
from simulate.generation.reciprocity import element_offsets
from simulate.rays import diffuse_reflection
from simulate.rays.core.multipath import Interaction
from simulate.rays.core.propagation import Propagation
from simulate.rays.sionna_solver import path_responses
from simulate.rays.tracer import Tracer

POSITIONS = np.array([[-3.0, 0.3, 1.2], [-2.4, -0.5, 0.8], [-3.6, 0.8, 0.6]])
DIFFUSE = Propagation(
    max_depth=1, los=False, specular=False, refraction=False, diffuse=True, diffraction=False, rays=10_000
)


def rough_scene(scattering=0.6, turned=0.0, polarization="V") -> Scene:
    """A rough floor and a rough wall behind the gateway, with a smooth pane between gateway and transmitter."""
    objects = (
        SceneObject("floor", sheet((-6, -6, 0), (12, 0, 0), (0, 12, 0)), "concrete"),
        SceneObject("wall", sheet((3, -6, 0), (0, 12, 0), (0, 0, 3)), "brick"),
        SceneObject("pane", sheet((-1.5, -1, 0.3), (0, 2, 0), (0, 0, 1)), "glass"),
    )
    rough = {
        name: replace(p2040_material(name, 915e6, scattering_coefficient=scattering), xpd_coefficient=turned)
        for name in ("concrete", "brick")
    }
    gateway = Gateway((0, 0, 1.5), facing((-1, 0, 0)), rows=1, columns=2, pattern="iso", polarization=polarization)
    region = Transmitter((-4, -1, 0.5), (-2, 1, 2), polarization=polarization)
    return Scene("rough", 915e6, gateway, region, objects, rough | {"glass": p2040_material("glass", 915e6)})


def power_by_objects_passed(tracer: Tracer, position: np.ndarray) -> dict[int, float]:
    """Sum of the paths' powers, by the objects that they pass on the way to their patch, if they pass none after it."""
    powers: dict[int, float] = defaultdict(float)
    for batch in tracer.middle_multipath(position[None]):
        for kinds, response in zip(batch.kinds, batch.responses, strict=True):
            before, after = np.split(kinds, np.flatnonzero(kinds == Interaction.SCATTERING))
            if Interaction.TRANSMISSION not in after:
                powers[(before == Interaction.TRANSMISSION).sum()] += abs(response) ** 2
    return powers


@pytest.mark.slow
@pytest.mark.parametrize(("turned", "polarization"), [(0.0, "V"), (0.3, "H")])
def test_power_is_sionnas(turned, polarization):
    """Also of waves that pass through the pane before they are scattered. (Sionna has none that pass it afterwards.)"""
    propagation = replace(DIFFUSE, max_depth=2, refraction=True, patches=20_000)
    scene = rough_scene(turned=turned, polarization=polarization)
    ours, theirs = (
        Tracer(scene, replace(propagation, sionna=True, rays=50_000)) if sionna else Tracer(scene, propagation)
        for sionna in (False, True)
    )
    for position in POSITIONS[:1]:
        ((_, targets, buffer),) = theirs._solver._shot(theirs.middle, theirs._targets(position[None]))
        responses = path_responses(theirs.ray_scene, buffer, theirs.middle, targets).responses
        expected: dict[tuple, float] = defaultdict(float)
        for types, response in zip(buffer.interaction_types.numpy().tolist(), responses, strict=True):
            expected[tuple(types)] += abs(response) ** 2
        found = power_by_objects_passed(ours, position)
        decibels = 10 * np.log10([found[0] / expected[2, 0], found[1] / expected[4, 2]])
        assert np.abs(decibels).max() < 0.5


def test_paths_add_up_to_the_response():
    tracer = Tracer(rough_scene(), replace(DIFFUSE, max_depth=2, refraction=True, patches=300))
    for position, response in zip(POSITIONS, tracer.responses(POSITIONS), strict=True):
        paths = tracer.paths(position)
        assert len(paths) > 100 and {len(path.vertices) for path in paths} == {3, 4, 5, 6}
        assert abs(sum(path.response for path in paths) / response[0] - 1) < 1e-5


def test_field_is_a_function_of_the_position(monkeypatch):
    """The same whatever the batch, of one seed, and smooth; another seed draws another one."""
    tracer = Tracer(rough_scene(), DIFFUSE)
    found = tracer.responses(POSITIONS)
    near = tracer.responses(POSITIONS + np.array([0, 0, 1e-3]))
    assert 0 < np.abs(near / found - 1).max() < 0.2
    assert np.abs(Tracer(rough_scene(), DIFFUSE, seed=2).responses(POSITIONS) / found - 1).min() > 0.2
    monkeypatch.setattr(diffuse_reflection, "LANES", 1)
    assert (Tracer(rough_scene(), DIFFUSE).responses(POSITIONS[::-1])[::-1] == found).all()


def test_a_small_patch_is_a_source_of_spherical_waves():
    """From two places in one direction from it: the phase of each way from antenna to patch to antenna, −k (r + r')."""
    tile = SceneObject("tile", sheet((-3.01, -0.01, 0), (0.02, 0, 0), (0, 0.02, 0)), "concrete")
    scene = replace(rough_scene(), objects=(tile,))
    away = np.array([0.0, 0.3, 1.0]) / np.hypot(0.3, 1)
    distances = np.array([1.1, 1.37, 2.9])
    patch, k = np.array([-3.0, 0, 0]), 2 * np.pi / scene.wavelength
    elements = np.asarray(scene.gateway.position) + element_offsets(scene.gateway, scene.wavelength)
    tracer = Tracer(scene, replace(DIFFUSE, patches=20))
    found = tracer.responses(patch + distances[:, None] * away)
    way = distances[:, None] + np.linalg.norm(elements - patch, axis=1)
    expected = np.exp(-1j * k * way) / distances[:, None]
    np.testing.assert_allclose(found / found[0, 0], expected / expected[0, 0], rtol=0.03)


def test_smooth_surfaces_scatter_nothing():
    propagation = Propagation(max_depth=2, diffraction=False, rays=10_000)
    plain = Tracer(rough_scene(0.0), propagation).responses(POSITIONS)
    assert (Tracer(rough_scene(0.0), replace(propagation, diffuse=True)).responses(POSITIONS) == plain).all()


@pytest.mark.slow
def test_rough_surface_reflects_less_around_edges_too():
    """A reflection off the floor after an edge has √(1 − S²) of the amplitude that a smooth floor gives it."""

    def strongest(scattering: float) -> dict[tuple, complex]:
        scene = rough_scene(scattering)
        panel = SceneObject("panel", sheet((-1.2, -0.5, 1.0), (0, 1, 0), (0, 0, 1)), "metal")
        metal = {"metal": p2040_material("metal", 915e6)}
        scene = replace(scene, objects=(scene.objects[0], panel), materials=scene.materials | metal)
        tracer = Tracer(scene, Propagation(max_depth=2, diffraction=True, rays=10_000))
        paths = [path for path in tracer.paths(POSITIONS[0]) if len(path.vertices) == 4]
        return {
            tuple(path.vertices.round(3).ravel()): path.response
            for path in paths
            if (np.abs(path.vertices[1:3, 2]) < 1e-3).sum() == 1
        }

    smooth, rough = strongest(0.0), strongest(0.6)
    both = smooth.keys() & rough.keys()  # the weakest may be kept in one of the scenes only
    assert len(both) >= 2
    for course in both:
        assert rough[course] / smooth[course] == pytest.approx(0.8, rel=1e-4)
