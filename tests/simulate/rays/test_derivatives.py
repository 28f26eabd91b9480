"""Derivatives of responses against finite differences, where no path appears or ends: a floor, a wall and a screen."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scenes.scene.description import Scene, SceneObject
from scenes.scene.shapes import sheet
from simulate.rays.core.propagation import Propagation
from simulate.rays.derivatives import derivatives
from simulate.rays.tracer import Tracer
from tests.small_scene import small_scene

PROPAGATION = Propagation(max_depth=2, rays=20_000)
STEP = 1e-3  # Metres and radians: paths change by less than a hundredth of a wavelength

AMPLITUDES = 0.06
"""What the change of amplitudes, which the derivatives leave out, adds to those of the phases over 2 m."""


@pytest.fixture(scope="module")
def scene() -> Scene:
    return small_scene(
        SceneObject("wall", sheet((-9, 2, -5), (18, 0, 0), (0, 0, 15)), "concrete"),
        SceneObject("screen", sheet((1.4, -3, 0.5), (0, 1.5, 0), (0, 0, 1.5)), "metal"),
    )


@pytest.fixture(scope="module")
def tracer(scene) -> Tracer:
    return Tracer(scene, PROPAGATION)


@pytest.fixture(scope="module")
def positions(scene) -> np.ndarray:
    return np.random.default_rng(0).uniform(*scene.transmitter.region, (6, 3))


@pytest.fixture(scope="module")
def exact(tracer, positions):
    return derivatives(tracer, positions, [1, 2])


@pytest.fixture(scope="module")
def differences(scene, tracer, positions):
    """Function: a scene for each step -> the central difference of the responses."""

    def of(scene_after):
        after, before = (
            Tracer(scene_after(step), PROPAGATION, found=tracer.found).responses(positions).astype(complex)
            for step in (STEP, -STEP)
        )
        return (after - before) / (2 * STEP)

    return of


def near(found, expected, size) -> None:
    """Relative to the size of the responses times the wavenumber."""
    assert np.linalg.norm(found - expected) < AMPLITUDES * 2 * np.pi / 0.3276 * size
    assert np.linalg.norm(found) > 5 * np.linalg.norm(found - expected)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_position_of_the_gateway(axis, scene, exact, differences):
    def moved(step):
        position = np.asarray(scene.gateway.position) + step * np.eye(3)[axis]
        return replace(scene, gateway=replace(scene.gateway, position=tuple(position)))

    near(exact.position[..., axis], differences(moved), np.linalg.norm(exact.responses))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_turn_of_the_gateway(axis, scene, exact, differences):
    def turned(step):
        rotation = Rotation.from_rotvec(step * np.eye(3)[axis]) * Rotation.from_quat(scene.gateway.orientation)
        return replace(scene, gateway=replace(scene.gateway, orientation=tuple(rotation.as_quat())))

    near(exact.rotation[..., axis], differences(turned), 0.3 * np.linalg.norm(exact.responses))


def test_turn_of_an_array_that_is_not_centred_on_the_gateway(scene, positions):
    row = [(0.0, 0.0, 0.0), (0.2, 0.0, 0.0), (0.4, 0.1, 0.0)]
    scene = replace(scene, gateway=replace(scene.gateway, elements=row))
    tracer = Tracer(scene, PROPAGATION)

    def turned(step):
        rotation = Rotation.from_rotvec([0, 0, step]) * Rotation.from_quat(scene.gateway.orientation)
        after = replace(scene, gateway=replace(scene.gateway, orientation=tuple(rotation.as_quat())))
        return Tracer(after, PROPAGATION, found=tracer.found).responses(positions).astype(complex)

    exact = derivatives(tracer, positions, [1, 2])
    near(exact.rotation[..., 2], (turned(STEP) - turned(-STEP)) / (2 * STEP), 0.4 * np.linalg.norm(exact.responses))


def test_frequency(scene, exact, differences):
    def scaled(step):
        gateway = replace(scene.gateway, spacing=scene.gateway.spacing * (1 + step))
        return replace(scene, frequency=scene.frequency * (1 + step), gateway=gateway)

    near(exact.frequency, differences(scaled), 3 * np.linalg.norm(exact.responses))


@pytest.mark.parametrize(("number", "axis"), [(1, 1), (2, 0), (2, 1)])
def test_position_of_an_object(number, axis, scene, exact, differences):
    def moved(step):
        mesh = scene.objects[number].mesh.copy()
        mesh.apply_translation(step * np.eye(3)[axis])
        objects = list(scene.objects)
        objects[number] = replace(objects[number], mesh=mesh)
        return replace(scene, objects=tuple(objects))

    found = exact.objects[:, :, number - 1, axis]
    near(found, differences(moved), np.linalg.norm(exact.responses))


def test_a_wall_that_moves_along_itself_changes_nothing(exact):
    assert np.abs(exact.objects[:, :, 0, 0]).max() < 1e-2 * np.abs(exact.objects[:, :, 0, 1]).max()
