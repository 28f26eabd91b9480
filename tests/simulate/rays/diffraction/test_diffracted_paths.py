"""Diffracted chains: their vertices, what they contribute, and how near they come to true fields."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from learn.quantities.complex_scores import correlation
from scenes.places.built_in import closet
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import RadioMaterial
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, sheet
from simulate.fullwave.stored_field import read_stored_field
from simulate.rays.core import image_method
from simulate.rays.core.propagation import Propagation
from simulate.rays.diffraction import search
from simulate.rays.tracer import Tracer

pytestmark = pytest.mark.slow

METAL = RadioMaterial("metal", 1.0, 1e7, 0.002)
CLOSET = Path(__file__).parents[3] / "data" / "closet" / "field.npz"
FOLLOWED = Propagation(max_depth=2, diffraction=True, rays=100_000)


@pytest.fixture(scope="module")
def screen_scene() -> Scene:
    """A metal screen over a floor, beside a wall at its border, whose edges do not count."""
    return Scene(
        "screen",
        915e6,
        Gateway((4.0, 0.3, 1.4), facing((-1, 0, 0)), rows=2, columns=2, pattern="dipole"),
        Transmitter((0.2, -1.0, 0.3), (1.2, 1.0, 2.4), pattern="dipole"),
        (
            SceneObject("floor", sheet((-5, -5, 0), (12, 0, 0), (0, 7, 0)), "stone"),
            SceneObject("wall", sheet((-5, 2, 0), (12, 0, 0), (0, 0, 4)), "stone"),
            SceneObject("screen", sheet((2.2, -0.6, 0.3), (0, 1.0, 0), (0, 0, 1.2)), "metal"),
        ),
        {"metal": METAL, "stone": RadioMaterial("stone", 5.0, 0.05, 0.2)},
    )


@pytest.fixture(scope="module")
def tracer(screen_scene) -> Tracer:
    return Tracer(screen_scene, FOLLOWED)


@pytest.mark.parametrize(
    ("obstacle", "bound"),
    [
        (sheet((2.2, -1.6, 0.3), (0, 3.0, 0), (0, 0, 1.2)), 0.05),
        (sheet((2.2, -0.6, 0.3), (0, 1.0, 0), (0, 0, 1.2)), 0.05),
        (box((1.9, -0.5, 0.001), (2.5, 0.3, 1.5)), 0.1),
    ],
    ids=["wide screen", "narrow screen", "cabinet"],
)
def test_field_is_continuous_across_boundaries(screen_scene, obstacle, bound):
    """Behind metal on a floor no step of a millimetre changes the level by more dB than its neighbours.

    The path crosses the shadow boundaries of the direct, the reflected and the diffracted wave, some near a corner.
    Without diffraction the level jumps, and behind a cabinet it jumps with one diffraction only.
    """
    scene = replace(screen_scene, objects=(screen_scene.objects[0], SceneObject("obstacle", obstacle, "metal")))
    path = np.column_stack([np.full(1500, 0.3), np.linspace(-0.9, 0.6, 1500), np.linspace(0.5, 2.2, 1500)])

    def largest_jump(diffraction: bool) -> float:
        followed = replace(FOLLOWED, max_depth=3, diffraction=diffraction)
        step = np.diff(20 * np.log10(np.abs(Tracer(scene, followed).responses(path)[:, 0]) + 1e-12))
        return float(np.abs(step[1:-1] - (step[:-2] + step[2:]) / 2).max())

    assert largest_jump(False) > 2
    assert largest_jump(True) < bound


def test_vertices_obey_the_laws_of_reflection_and_diffraction(screen_scene, tracer):
    paths = [path for path in tracer.paths(np.array([0.6, 0.1, 0.9])) if len(path.vertices) > 2]
    diffracted = reflected = 0
    for path in paths:
        for before, vertex, after in zip(path.vertices[:-2], path.vertices[1:-1], path.vertices[2:], strict=True):
            way_in, way_out = vertex - before, after - vertex
            way_in, way_out = way_in / np.linalg.norm(way_in), way_out / np.linalg.norm(way_out)
            change = np.abs(way_out - way_in) > 1e-4
            edge = [abs(vertex[axis] - at) < 1e-5 for axis, at in ((1, -0.6), (1, 0.4), (2, 0.3), (2, 1.5))]
            if abs(vertex[0] - 2.2) < 1e-5 and sum(edge) == 1:  # the component along the edge stays
                assert not change[2 if edge[0] or edge[1] else 1]
                diffracted += 1
            elif not any(edge) and change.any():  # the component across a plane is turned round
                assert change.sum() == 1 and abs(way_in + way_out)[change] < 1e-3
                reflected += 1
    assert diffracted > 5 and reflected > 5


def test_antennas_may_change_places(screen_scene, monkeypatch):
    """The response between two dipoles is the same in both directions, with reflections on either side of an edge."""
    monkeypatch.setattr(search, "NEGLIGIBLE", 0.0)
    one, other = np.array([4.0, 0.3, 1.4]), np.array([0.6, 0.1, 0.9])

    def response(source: np.ndarray, target: np.ndarray) -> complex:
        gateway = replace(screen_scene.gateway, position=tuple(source), rows=1, columns=1)
        region = replace(screen_scene.transmitter, region_min=tuple(target - 0.1), region_max=tuple(target + 0.1))
        scene = replace(screen_scene, gateway=gateway, transmitter=region)
        tracer = Tracer(scene, replace(FOLLOWED, max_depth=3))
        return complex(tracer.responses(target[None])[0, 0])

    assert abs(response(one, other) - response(other, one)) < 1e-3 * abs(response(one, other))


def test_objects_in_the_way_weaken_or_block_a_diffracted_path(screen_scene):
    """A plate that a path meets head on multiplies its contribution by the slab's coefficient; metal ends it."""
    plate = sheet((1.0, -5, -0.5), (0, 12, 0), (0, 0, 6))  # between the region and the screen
    thin = RadioMaterial("thin", 3.0, 0.0, 0.01)

    def strongest(material: RadioMaterial | None) -> complex:
        objects, materials = screen_scene.objects, screen_scene.materials
        if material is not None:
            objects, materials = (*objects, SceneObject("plate", plate, "plate")), materials | {"plate": material}
        scene = replace(screen_scene, objects=objects, materials=materials)
        paths = Tracer(scene, FOLLOWED).paths(np.array([0.6, 0.1, 0.9]))
        turns = [vertices_of_turns(path.vertices) for path in paths]
        over = [len(turn) == 1 and abs(turn[0][2] - 1.5) < 1e-6 for turn in turns]
        return sum(path.response for path, chosen in zip(paths, over, strict=True) if chosen)

    def vertices_of_turns(vertices: np.ndarray) -> np.ndarray:
        """The vertices between the ends where the path does not go straight on."""
        steps = np.diff(vertices, axis=0)
        units = steps / np.linalg.norm(steps, axis=1, keepdims=True)
        return vertices[1:-1][(np.diff(units, axis=0) ** 2).sum(axis=1) > 1e-6]

    free, behind, blocked = strongest(None), strongest(replace(thin, name="plate")), strongest(METAL)
    k, index = 2 * np.pi / screen_scene.wavelength, np.sqrt(3.0)
    r = (1 - index) / (1 + index)
    slab = (1 - r**2) * np.exp(-1j * k * 0.01 * index) / (1 - r**2 * np.exp(-2j * k * 0.01 * index))
    assert free != 0 and blocked == 0
    slab *= np.exp(1j * k * 0.01)  # over the air that it takes the place of
    assert abs(behind / free - slab) < 0.05  # the paths are not quite perpendicular to the plate


def test_a_wave_diffracted_twice_takes_the_shortest_way(screen_scene):
    """Over a cabinet, along its top: both points of diffraction are where the way over its two edges is shortest."""
    obstacle = SceneObject("cabinet", box((1.9, -1.5, 0.001), (2.5, 1.5, 1.5)), "metal")
    scene = replace(screen_scene, objects=(obstacle,))
    source, target = np.array([4.0, 0.3, 1.0]), np.array([0.5, -0.3, 0.7])
    gateway = replace(scene.gateway, position=tuple(source), rows=1, columns=1)
    tracer = Tracer(replace(scene, gateway=gateway), FOLLOWED)
    ways = [path.vertices for path in tracer.paths(target)]
    over = [way for way in ways if len(way) == 4 and np.allclose(way[1:3, 2], 1.5, atol=2e-3)]
    assert len(over) == 1
    grid = np.linspace(-1, 1, 801)
    first = np.stack(np.broadcast_arrays(2.5, grid[:, None], 1.5), axis=-1)
    second = np.stack(np.broadcast_arrays(1.9, grid[None, :], 1.5), axis=-1)
    lengths = np.linalg.norm(first - source, axis=-1) + np.linalg.norm(second - target, axis=-1)
    lengths = lengths + np.hypot(0.6, grid[:, None] - grid[None, :])
    i, j = np.unravel_index(lengths.argmin(), lengths.shape)
    np.testing.assert_allclose(over[0][1:3, 1], [grid[i], grid[j]], atol=0.005)
    np.testing.assert_allclose(over[0][1:3, 0], [2.5, 1.9], atol=1e-6)


def test_responses_do_not_depend_on_the_batch(tracer, screen_scene, monkeypatch):
    positions = np.random.default_rng(0).uniform(*screen_scene.transmitter.region, (7, 3))
    whole = tracer.responses(positions)
    monkeypatch.setattr(image_method, "LANES", 7)
    monkeypatch.setattr(image_method, "AT_ONCE", 1)
    assert (tracer.responses(positions[::-1])[::-1] == whole).all()


def test_diffraction_brings_the_closet_near_the_full_wave_field():
    scene = closet()
    positions = np.random.default_rng(0).uniform(*scene.transmitter.region, (40, 3))
    true = read_stored_field(CLOSET).responses(positions)
    found = {}
    for diffraction in (False, True):
        tracer = Tracer(scene, replace(FOLLOWED, max_depth=3, diffraction=diffraction))
        found[diffraction] = float(np.median(correlation(tracer.responses(positions)[:, None], true[:, None])))
    assert found[False] < 0.93 and found[True] > 0.975
