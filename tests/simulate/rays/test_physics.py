"""Traced responses against closed forms: Friis, two rays over a slab, transmission through it, reciprocity."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.constants import c, epsilon_0
from scipy.spatial.transform import Rotation

from benchmarks.ledger.exact_fields import free_space_response
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import SceneObject
from scenes.scene.shapes import sheet
from simulate.fullwave.dipole import element_direction, transmitter_direction
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import ElementArray

FREQUENCY = 915e6
LAMBDA = c / FREQUENCY
K = 2 * np.pi / LAMBDA
LOS_ONLY = Propagation(max_depth=0)
ONE_BOUNCE = Propagation(max_depth=1, diffraction=False, rays=100_000)

STRAIGHT_UP_AND_DOWN = [
    Rotation.identity(),
    Rotation.from_euler("x", 180, degrees=True),
    Rotation.from_euler("z", 37, degrees=True),
    Rotation.from_euler("xz", [180, 101], degrees=True),
]
"""Boresights along ±z, where Sionna's angles have a gimbal lock."""
ORIENTATIONS = [*Rotation.random(20, random_state=20250101), *STRAIGHT_UP_AND_DOWN]


def free_space(r):
    """λ/(4πr) e^{-jkr}: Friis' law with the phase of the way."""
    return LAMBDA / (4 * np.pi * r) * np.exp(-1j * K * r)


def elements_looking_along_minus_x(centre) -> np.ndarray:
    """The 4 × 4 elements of a gateway with boresight -x and y axis up; then its x axis is along world -y."""
    row, column = np.divmod(np.arange(16), 4)
    offset = np.stack([0 * row, -(column - 1.5), row - 1.5], axis=1)
    return np.asarray(centre) + LAMBDA / 2 * offset


def slab(cosine, material, polarization):
    """Reflection and transmission of a slab in air by its transmission-line (ABCD) matrix, e^{+jωt}.

    The field component that is tangential to the slab is the voltage; wave admittances, relative to free space, are
    n cosθ (TE) and n / cosθ (TM); δ = k n d cosθ₁ inside, where n² = ε_r - jσ/(ωε₀) and n sinθ₁ = sinθ. So the TM
    reflection here is that of the tangential component, and the normal one's has the other sign.
    """
    n = np.sqrt(material.relative_permittivity - 1j * material.conductivity / (2 * np.pi * FREQUENCY * epsilon_0))
    inside = np.sqrt(1 - (1 - cosine**2) / n**2)
    air, plate = (cosine, n * inside) if polarization == "TE" else (1 / cosine, n / inside)
    delta = K * n * material.thickness * inside
    voltage = np.cos(delta) + 1j * np.sin(delta) / plate * air
    current = 1j * plate * np.sin(delta) + np.cos(delta) * air
    return (air * voltage - current) / (air * voltage + current), 2 * air / (air * voltage + current)


def decibels(found, expected):
    return np.abs(20 * np.log10(np.abs(found / expected)))


def degrees(found, expected):
    return np.abs(np.degrees(np.angle(found / expected)))


def the_axes(rotation: Rotation) -> np.ndarray:
    """The gateway's x, y and z axes in the world, as rows."""
    return rotation.apply(np.eye(3))


# --- the gateway's frame -----------------------------------------------------------------------------------


@pytest.mark.parametrize("number", range(len(ORIENTATIONS)))
def test_line_of_sight_appears_where_the_transmitter_is(number, make_scene, far_sheet):
    """The spectrum's greatest value is within 1° of R⁻¹(s - g) for a source s 100 m away, elevation 25° to 88°."""
    generator = np.random.default_rng(number)
    rotation = ORIENTATIONS[number]
    azimuth = generator.uniform(0, 2 * np.pi, 5)
    elevation = np.radians(generator.uniform(25, 88, 5))
    local = np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], 1)
    position = generator.uniform(-5, 5, 3)
    scene = make_scene(far_sheet, gateway=Gateway(tuple(position), tuple(rotation.as_quat())))
    responses = Tracer(scene, LOS_ONLY).responses(position + 100 * rotation.apply(local))
    seen = AngularGrid().dominant_direction(Beamformer().spectrum(responses))
    angle = np.degrees(np.arccos((seen * local).sum(axis=1).clip(-1, 1)))
    assert angle.max() < 1


def test_elements_at_given_places_receive_friis_law_at_these_places(make_scene, far_sheet):
    """A circle and a cloud: the phase e^{-jkr} from each element's own place; with a real mismatch."""
    circle = ElementArray.circle(8, 0.2).positions_m
    cloud = np.random.default_rng(0).uniform(-0.4, 0.4, (12, 3))
    for number, places in enumerate((circle, cloud)):
        rotation, position = ORIENTATIONS[number], np.array([1.0, -2.0, 0.5])
        gateway = Gateway(tuple(position), tuple(rotation.as_quat()), elements=places)
        scene = make_scene(far_sheet, gateway=gateway)
        sources = position + np.random.default_rng(1).uniform(2, 4, (5, 3))
        distance = np.linalg.norm(sources[:, None] - (position + rotation.apply(places)), axis=-1)
        ratio = Tracer(scene, LOS_ONLY).responses(sources) / free_space(distance)
        assert np.abs(ratio.imag).max() < 2e-3 * np.abs(ratio).max() and np.abs(ratio).max() < 1.001


@pytest.mark.parametrize("rotation", [*ORIENTATIONS[:3], *STRAIGHT_UP_AND_DOWN])
def test_vertical_polarisation_is_along_the_gateways_y_axis_and_horizontal_along_x(rotation, make_scene, far_sheet):
    """At boresight a wave polarised along x or y is received at Friis' level by that antenna, not by the other."""
    x, y, z = the_axes(rotation)
    for along, received_by in ((y, "V"), (x, "H")):
        # The transmitter's own z axis, its polarisation, along the wanted one; it stands on the boresight.
        turned = Rotation.from_matrix(np.stack([z, np.cross(along, z), along], axis=1))
        for polarization in "VH":
            scene = make_scene(
                far_sheet,
                gateway=Gateway((0, 0, 0), tuple(rotation.as_quat()), rows=1, columns=1, polarization=polarization),
                transmitter=Transmitter((-1, -1, -1), (1, 1, 1), orientation=tuple(turned.as_quat())),
            )
            level = abs(Tracer(scene, LOS_ONLY).responses(4 * z[None])[0, 0] / free_space(4.0))
            assert level == pytest.approx(1 if polarization == received_by else 0, abs=1e-3)


@pytest.mark.parametrize("rotation", [*ORIENTATIONS[:3], *STRAIGHT_UP_AND_DOWN])
def test_dipoles_of_the_gateway_are_deaf_along_their_own_axis(rotation, make_scene, far_sheet):
    """A short dipole's gain is 1.5 sin²: nothing along the gateway's y axis, 1.76 dBi along x and z."""
    scene = make_scene(
        far_sheet, gateway=Gateway((0, 0, 0), tuple(rotation.as_quat()), rows=1, columns=1, pattern="dipole")
    )
    axes = the_axes(rotation)

    def level(axis) -> float:
        polarised = replace(scene, transmitter=_polarised_along(axes[1], seen_from=axis))
        return abs(Tracer(polarised, LOS_ONLY).responses(3 * axis[None])[0, 0])

    along_x, along_y, along_z = map(level, axes)
    assert along_y < 1e-3 * along_z
    for loud in (along_x, along_z):
        assert (loud / abs(free_space(3.0))) ** 2 == pytest.approx(1.5, rel=1e-3)


def _polarised_along(axis, seen_from) -> Transmitter:
    """A transmitter whose polarisation is along an axis, as well as the direction it is seen from allows."""
    other = np.roll(axis, 1) if abs(axis @ seen_from) > 0.9 else seen_from
    x = np.cross(np.cross(axis, other), axis)
    x /= np.linalg.norm(x)
    turned = Rotation.from_matrix(np.stack([x, np.cross(axis, x), axis], axis=1))
    return Transmitter((-1, -1, -1), (1, 1, 1), orientation=tuple(turned.as_quat()))


def test_a_spectrum_does_not_change_when_everything_is_turned_and_moved_together(
    room, room_responses, room_positions, two_bounces
):
    """Gateway, scene and transmitter (its antenna too) under one rigid motion: the same responses."""
    some = [0, 4, 7]
    rotation, shift = Rotation.random(random_state=3), np.array([3.0, -2.0, 5.0])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation.as_matrix(), shift
    positions = rotation.apply(room_positions[some]) + shift
    scene = replace(
        room,
        gateway=replace(
            room.gateway,
            position=tuple(rotation.apply(room.gateway.position) + shift),
            orientation=tuple((rotation * Rotation.from_quat(room.gateway.orientation)).as_quat()),
        ),
        transmitter=replace(
            room.transmitter,
            region_min=tuple(positions.min(axis=0) - 0.2),
            region_max=tuple(positions.max(axis=0) + 0.2),
            orientation=tuple(rotation.as_quat()),
        ),
        objects=tuple(
            SceneObject(item.name, item.mesh.copy().apply_transform(matrix), item.material) for item in room.objects
        ),
    )
    found = Tracer(scene, two_bounces).responses(positions)
    expected = room_responses[some]
    assert np.abs(found - expected).max() < 2e-3 * np.abs(expected).max()


# --- closed forms ------------------------------------------------------------------------------------------


def test_free_space_response_is_friis_with_the_phase_of_each_elements_own_distance(make_scene, far_sheet):
    """y_m = λ/(4πr_m) e^{-jkr_m}, r_m from the transmitter to element m: spherical waves, near field included."""
    directions = Rotation.random(6, random_state=8).apply([1, 0, 0])
    positions = np.array([0, 0, 1.5]) + np.array([0.5, 1, 2, 7, 30, 100])[:, None] * directions
    found = Tracer(make_scene(far_sheet), LOS_ONLY).responses(positions)
    r = np.linalg.norm(positions[:, None] - elements_looking_along_minus_x((0, 0, 1.5)), axis=2)
    assert decibels(found, free_space(r)).max() < 0.01
    assert degrees(found, free_space(r)).max() < 0.1


@pytest.mark.parametrize("received", "VH")
@pytest.mark.parametrize("sent", "VH")
def test_dipoles_point_where_those_of_the_full_wave_engine_do(received, sent, make_scene, far_sheet):
    """Amplitude and sign of the exact response of two short dipoles, far enough apart for rays."""
    scene = make_scene(far_sheet)
    tilted = tuple(Rotation.from_euler("xyz", [0.3, -0.4, 0.5]).as_quat())
    scene = replace(
        scene,
        gateway=replace(scene.gateway, pattern="dipole", polarization=received),
        transmitter=replace(scene.transmitter, pattern="dipole", polarization=sent, orientation=tilted),
    )
    positions = np.array([0, 0, 1.5]) + 60 * Rotation.random(8, random_state=3).apply([1, 0, 0])
    found = Tracer(scene, LOS_ONLY).responses(positions)
    ends = element_direction(scene), transmitter_direction(scene)
    elements = elements_looking_along_minus_x((0, 0, 1.5))
    exact = [free_space_response(each, ends[0], positions, ends[1], scene.frequency) for each in elements]
    assert np.abs(found - np.stack(exact, axis=1)).max() < 0.01 * np.abs(exact).max()


FLOOR_POSITIONS = np.array([[-2.0, 0.0, 0.4], [-3.0, 1.0, 1.0], [-4.5, -0.8, 2.3], [-2.2, 0.3, 1.5], [-5.0, 0.9, 0.6]])


@pytest.mark.parametrize("material", ["concrete", "brick", "lossless"])
@pytest.mark.parametrize("polarization", ["V", "H"])
def test_two_rays_over_a_floor(polarization, material, make_scene, floor):
    """y_m = ±λ/4π [e^{-jk r₁}/r₁ + Γ e^{-jk r₂}/r₂], r₂ from the image below the floor, both ends V or both H.

    V fields are along θ̂, which at the two ends of a ray is the same vector; θ̂'s vertical part is -sin θ before and
    after the bounce, so Γ is that of the vertical, normal component: minus the tangential one's (+1 for a metal).
    H fields are along φ̂ of the ray's own azimuth, always TE; arriving the azimuth is the opposite, hence ± = -.
    """
    name, mesh, _ = floor
    scene = make_scene((name, mesh, material))
    scene = replace(
        scene,
        gateway=replace(scene.gateway, polarization=polarization),
        transmitter=replace(scene.transmitter, polarization=polarization),
    )
    found = Tracer(scene, ONE_BOUNCE).responses(FLOOR_POSITIONS)

    elements = elements_looking_along_minus_x(scene.gateway.position)
    image = FLOOR_POSITIONS * [1, 1, -1]
    r1 = np.linalg.norm(FLOOR_POSITIONS[:, None] - elements, axis=2)
    r2 = np.linalg.norm(image[:, None] - elements, axis=2)
    cosine = (FLOOR_POSITIONS[:, None, 2] + elements[:, 2]) / r2
    if polarization == "V":
        expected = free_space(r1) - slab(cosine, scene.materials[material], "TM")[0] * free_space(r2)
    else:
        expected = -(free_space(r1) + slab(cosine, scene.materials[material], "TE")[0] * free_space(r2))
    assert decibels(found, expected).max() < 0.01
    assert degrees(found, expected).max() < 0.1


@pytest.mark.parametrize("material", ["brick", "lossless"])
@pytest.mark.parametrize("incidence", [0, 35, 65])
@pytest.mark.parametrize("polarization", ["V", "H"])
def test_a_wall_in_between_lowers_line_of_sight_by_the_slabs_transmission(
    polarization, incidence, material, make_scene
):
    """y = T e^{jkd cosθ} λ/(4πr) e^{-jkr}: T holds the way d cosθ through the slab, which r counts, too.

    T is that of the wall's slab at that incidence; in a horizontal plane V is TE, H is TM.
    """
    scene = make_scene(("wall", sheet((-1, -20, -20), (0, 40, 0), (0, 0, 40)), material))
    scene = replace(
        scene,
        gateway=replace(scene.gateway, rows=1, columns=1, polarization=polarization),
        transmitter=replace(scene.transmitter, polarization=polarization),
    )
    angle = np.radians(incidence)
    position = np.array([[0, 0, 1.5]]) + 3 * np.array([[-np.cos(angle), np.sin(angle), 0]])
    found = Tracer(scene, ONE_BOUNCE).responses(position)[0, 0]
    wall = scene.materials[material]
    through = slab(np.cos(angle), wall, "TE" if polarization == "V" else "TM")[1]
    expected = (1 if polarization == "V" else -1) * through * free_space(3.0)
    assert decibels(found, expected) < 0.01
    assert degrees(found, expected * np.exp(1j * K * wall.thickness * np.cos(angle))) < 0.1

    as_sionna = Tracer(scene, replace(ONE_BOUNCE, slab_phase=False)).responses(position)[0, 0]
    assert degrees(as_sionna, expected) < 0.1


def test_a_board_reflects_at_its_front_half_its_thickness_before_the_sheet(make_scene):
    """A far sheet lies on the other side of the plate, so that it is no outer wall."""
    plate = ("plate", sheet((-5, -20, -20), (0, 40, 0), (0, 0, 40)), "lossless")
    scene = make_scene(plate, ("far", sheet((-9, 0, 5000), (1, 0, 0), (0, 1, 0)), "brick"))
    scene = replace(scene, gateway=replace(scene.gateway, rows=1, columns=1))
    tracer = Tracer(scene, replace(ONE_BOUNCE, los=False))
    position = np.array([[-1.0, 2.0, 1.5]])
    r, cosine = np.hypot(9.0, 2.0), 9 / np.hypot(9.0, 2.0)
    material = scene.materials["lossless"]
    front = np.exp(1j * K * material.thickness * cosine)  # 2 · t/2
    expected = slab(cosine, material, "TE")[0] * free_space(r) * front
    found = tracer.responses(position)[0, 0]
    assert decibels(found, expected) < 0.01 and degrees(found, expected) < 0.1


@pytest.mark.parametrize("beside", [3e-6, 1e-4, 1e-2])
def test_a_corner_returns_a_wave_whose_reflections_are_micrometres_apart(beside, make_scene):
    """Two walls give three images: y = g(r₀) + Γ₁ g(r₁) + Γ₂ g(r₂) + Γ₁′ Γ₂′ g(r₁₂), all TE."""
    corner = np.array([3.7, 2.9, 0.0])  # at the origin, single precision resolves micrometres
    walls = sheet(corner, (0, 4, 0), (0, 0, 3)), sheet(corner, (4, 0, 0), (0, 0, 3))
    y_axis_up = tuple(Rotation.from_euler("x", 90, degrees=True).as_quat())
    scene = make_scene(
        *((f"wall {n}", wall, "concrete") for n, wall in enumerate(walls)),
        gateway=Gateway((5.7, 3.9, 1.5), y_axis_up, rows=1, columns=1),
        transmitter=Transmitter((4.2, 3.2, 1.4), (5.2, 3.7, 1.6)),
    )
    position = np.array([1.0, 0.5 + beside, 1.5])
    found = Tracer(scene, replace(ONE_BOUNCE, max_depth=2)).responses(corner + position[None])[0, 0]

    ways = position[:2] * [[1, 1], [-1, 1], [1, -1], [-1, -1]] - [2, 1]
    lengths = np.linalg.norm(ways, axis=1)
    reflected = slab(np.abs(ways) / lengths[:, None], scene.materials["concrete"], "TE")[0]
    factors = [1, reflected[1, 0], reflected[2, 1], reflected[3].prod()]
    expected = (factors * free_space(lengths)).sum()
    assert abs(found - expected) < 1e-4 * abs(expected)


def test_a_wave_passes_through_any_number_of_boards_and_comes_back(make_scene):
    """Four boards, a wall behind them, depth 1: one reflection, and every board lowers its wave twice."""
    boards = [(f"board {n}", sheet((-1 - 0.2 * n, -20, -20), (0, 40, 0), (0, 0, 40)), "lossless") for n in range(4)]
    wall = "wall", sheet((-4, -20, -20), (0, 40, 0), (0, 0, 40)), "brick"
    position, only = np.array([[-0.2, 0.0, 1.5]]), replace(ONE_BOUNCE, los=False)

    def from_the_wall(*objects):
        tracer = Tracer(make_scene(*objects), only, np.array([[-0.5, -1, 1], [-0.1, 1, 2]]))
        paths = tracer.paths(position[0])
        return next(path for path in paths if np.isclose(path.vertices[:, 0], -4).any())

    one, four, none = from_the_wall(boards[0], wall), from_the_wall(*boards, wall), from_the_wall(wall)
    assert abs(four.response / none.response) == pytest.approx(abs(one.response / none.response) ** 4, rel=1e-3)
    assert len(four.vertices) == 2 + 1 + 8 and len(none.vertices) == 3


@pytest.mark.parametrize("place", [0, 3])
def test_the_gateway_receives_what_it_would_send(place, room, room_positions, room_responses, public_solver):
    """Reciprocity: Sionna's own solver, from the transmitter to a receiver with the gateway's array, agrees."""
    expected = public_solver(room, room_positions[place], rays=200_000, depth=2, gateway_sends=False)
    assert np.abs(room_responses[place] - expected).max() < 1e-3 * np.abs(expected).max()


# --- switches ----------------------------------------------------------------------------------------------


def test_each_mechanism_can_be_left_out(make_scene, floor):
    def over_a_floor(**switches) -> np.ndarray:
        return Tracer(make_scene(floor), replace(ONE_BOUNCE, **switches)).responses(FLOOR_POSITIONS)

    r = np.linalg.norm(FLOOR_POSITIONS[:, None] - elements_looking_along_minus_x((0, 0, 1.5)), axis=2)
    sight, reflected = over_a_floor(specular=False), over_a_floor(los=False)
    assert sight == pytest.approx(free_space(r), rel=1e-3) and sight == pytest.approx(over_a_floor(max_depth=0))
    assert (np.abs(reflected) > 0).all() and reflected == pytest.approx(over_a_floor() - sight, abs=1e-6)
    assert (over_a_floor(los=False, specular=False) == 0).all()


def test_without_refraction_a_wall_lets_nothing_through(make_scene):
    scene = make_scene(("wall", sheet((-1, -20, -20), (0, 40, 0), (0, 0, 40)), "brick"))
    behind, before = np.array([[-3.0, 0.0, 1.5]]), np.array([[-0.8, 0.3, 1.5]])
    opaque = Tracer(scene, replace(ONE_BOUNCE, refraction=False), np.array([[-3, -1, 1], [-0.5, 1, 2]]))
    assert (opaque.responses(behind) == 0).all()
    assert (np.abs(opaque.responses(before)) > 0).all()
    assert (np.abs(Tracer(scene, LOS_ONLY).responses(behind)) > 0).all()
