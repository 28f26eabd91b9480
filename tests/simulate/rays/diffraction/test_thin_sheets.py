"""The edges of plates, against Born's integral over a weak plate, and where geometric optics jumps."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import RadioMaterial
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet
from simulate.rays.core import ray_scene
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.slabs import FaceSlabs
from simulate.rays.tracer import Tracer

WEAK = RadioMaterial("weak", 1.1, 0.0, 0.01)
WOOD = RadioMaterial("wood", 1.99, 0.005, 0.03)
FAR = SceneObject("far", sheet((-60, -60, -60), (0.1, 0, 0), (0, 0.1, 0)), "plate")
"""Beyond the plate, so that the plate is no outer wall; and on the other side another one."""
ALONG_Z, ALONG_X = (0.0, 0.0, 0.0, 1.0), tuple(Rotation.from_euler("y", 90, degrees=True).as_quat())


def with_board(material: RadioMaterial, plate, source: np.ndarray, dipole=ALONG_Z) -> Scene:
    """A plate in free space, and dipoles along z, or the transmitter's along another axis."""
    other = replace(FAR, name="farther", mesh=sheet((60, 60, 60), (0.1, 0, 0), (0, 0.1, 0)))
    return Scene(
        "plate",
        915e6,
        Gateway(tuple(source), facing((-1, 0, 0)), rows=1, columns=1, pattern="dipole"),
        Transmitter((-3, -3, -3), (3, 3, 3), pattern="dipole", orientation=dipole),
        (SceneObject("plate", plate, "plate"), FAR, other),
        {"plate": replace(material, name="plate")},
    )


def born(scene: Scene, positions: np.ndarray, step: float = 0.02) -> np.ndarray:
    """What a weak plate z = 0 scatters between dipoles along z and along x or z: the sum over its pieces.

    Each piece is a dipole with the moment ε₀(ε − 1) E dV along the plate, and 1/ε of that across it.
    """
    k = 2 * np.pi / scene.wavelength
    low, high = scene.objects[0].mesh.bounds
    x, y = (np.arange(low[axis] + step / 2, high[axis], step) for axis in (0, 1))
    pieces = np.stack([*(grid.ravel() for grid in np.meshgrid(x, y)), np.zeros(len(x) * len(y))], axis=1)
    permittivity = scene.materials["plate"].relative_permittivity

    def field(start: np.ndarray, moment: np.ndarray) -> np.ndarray:
        """Far field of a dipole at the pieces, over ωμ₀Iℓ/4π … : −(moment − r̂ (r̂·moment)) e^{−jkr}/r."""
        way = pieces - start
        r = np.linalg.norm(way, axis=1, keepdims=True)
        across = moment - way / r * (way @ moment)[:, None] / r
        return across * np.exp(-1j * k * r) / r

    weights = np.array([1, 1, 1 / permittivity])
    along = Rotation.from_quat(scene.transmitter.orientation).apply([0, 0, 1])
    sent = field(np.array(scene.gateway.position), np.array([0.0, 0, 1]))
    # 1.5 is a dipole's gain; λ/4π and k²/4π are of the two ways.
    scale = 1.5 * scene.wavelength / (4 * np.pi) * k**2 / (4 * np.pi)
    scale = scale * (permittivity - 1) * scene.materials["plate"].thickness * step**2
    return np.array([scale * (sent * weights * field(place, along)).sum() for place in positions])


@pytest.mark.parametrize(("dipole", "side"), [(ALONG_Z, 1), (ALONG_Z, -1), (ALONG_X, -1)])
def test_edge_of_a_weak_board_scatters_as_borns_integral_says(dipole, side):
    """Of a horizontal half-plane, across the reflection boundary (side 1) or the shadow boundary behind it.

    Rays leave out what the waves' curvature over the plate does, about a tenth here.
    """
    source, y = np.array([1.7, 0.2, 0.9]), np.array([0.6, 1.0, 1.2, 1.4, 1.7, 2.0])
    places = np.column_stack([np.full(6, -0.9), y, np.full(6, 1.1 * side)])
    scene = with_board(WEAK, sheet((-8, -8, 0), (16, 0, 0), (0, 8.7, 0)), source, dipole)
    with_edges = Propagation(max_depth=1, diffraction=True, rays=20_000)
    nothing = with_board(WEAK, FAR.mesh, source, dipole)
    direct = Tracer(nothing, replace(with_edges, max_depth=0)).responses(places)[:, 0]
    expected, error = born(scene, places), {}
    for diffraction in (False, True):
        found = Tracer(scene, replace(with_edges, diffraction=diffraction)).responses(places)[:, 0] - direct
        error[diffraction] = np.linalg.norm(found - expected) / np.linalg.norm(expected)
    assert error[True] < 0.25 and error[False] > 2 * error[True]


@pytest.mark.parametrize("dipole", [ALONG_Z, ALONG_X])
def test_field_is_continuous_around_a_board(dipole):
    """Around an edge along y, across both boundaries, no step of 0.1° changes the field by more than its neighbours."""
    plate = sheet((0, -30, 0), (30, 0, 0), (0, 60, 0))
    scene = with_board(WOOD, plate, np.array([1.5, 0.3, 1.2]), dipole)
    angle = np.radians(np.arange(3.05, 357, 0.1))
    places = 1.3 * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)

    def largest_jump(diffraction: bool) -> float:
        followed = Propagation(max_depth=1, diffraction=diffraction, rays=20_000)
        found = Tracer(scene, followed).responses(places)[:, 0]
        step = np.diff(found) / np.abs(found).max()
        return float(np.abs(step[1:-1] - (step[:-2] + step[2:]) / 2).max())

    assert largest_jump(False) > 0.04
    assert largest_jump(True) < 0.002


def test_slab_beside_its_triangle_is_that_of_a_triangle_in_its_middle(monkeypatch):
    """As at the walls of closed boxes: the edges' waves come from the slab, wherever the triangle is."""
    beside = 0.05
    drawn, moved = (sheet((-0.5, -0.4, z), (1, 0, 0), (0, 0.8, 0)) for z in (0.0, beside))
    source, positions = np.array([0.2, 0.3, -1.5]), np.array([[0.9, 0.2, 1.5], [-0.8, 0.7, 1.2], [1.5, -0.3, -1.0]])
    expected = Tracer(with_board(WOOD, moved, source), Propagation(max_depth=1)).responses(positions)
    as_drawn = ray_scene.face_slabs

    def beside_the_plate(scene: Scene) -> FaceSlabs:
        slabs = as_drawn(scene)
        shift = np.where(np.arange(len(slabs.fronts)) < 2, beside, 0.0)  # the plate's two triangles
        return replace(slabs, fronts=slabs.fronts + shift[:, None] * [1, -1])

    scene = with_board(WOOD, drawn, source)
    without = Tracer(scene, Propagation(max_depth=1)).responses(positions)
    monkeypatch.setattr(ray_scene, "face_slabs", beside_the_plate)
    found = Tracer(scene, Propagation(max_depth=1)).responses(positions)
    difference, change = np.abs(found - expected), np.abs(without - expected)
    assert difference.max() < 0.02 * np.abs(expected).max() and difference.max() < 0.2 * change.max()
