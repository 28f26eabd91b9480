"""The conventions of the dataclasses and everything `validate` refuses."""

from dataclasses import replace

import numpy as np
import pytest
from trimesh import Trimesh

from scenes.checks.validation import validate
from scenes.files.errors import InputError
from scenes.scene.description import Gateway, SceneObject
from scenes.scene.shapes import box


def test_wavelength_and_bounds(scene):
    assert scene.wavelength == pytest.approx(0.32764, abs=1e-5)
    np.testing.assert_allclose(scene.bounds, [[-5, -5, 0], [5, 5, 1 / 3]])


def test_region_corners(scene):
    corners = scene.transmitter.corners()
    assert len(np.unique(corners, axis=0)) == 8
    np.testing.assert_allclose([corners.min(axis=0), corners.max(axis=0)], [[-1, -1, 0.5], [1, 1, 1.5]])


def test_published_quaternion_is_normalised():
    gateway = Gateway((0, 0, 0), (0.513, -0.487, -0.487, 0.513))
    assert np.linalg.norm(gateway.orientation) == pytest.approx(1, abs=1e-12)


def test_objects_compare_by_value():
    def crate(height: float = 1.0) -> SceneObject:
        return SceneObject("crate", box((0, 0, 0), (1, 1, height)), "wood")

    assert crate() == crate() and hash(crate()) == hash(crate())
    assert crate() != crate(2.0)


def test_a_good_scene_passes(scene):
    validate(scene, "yard.yaml")


def gateway(**changes):
    return lambda s: replace(s, gateway=replace(s.gateway, **changes))


def transmitter(**changes):
    return lambda s: replace(s, transmitter=replace(s.transmitter, **changes))


def second_object(item):
    return lambda s: replace(s, objects=(s.objects[0], item))


BOX = box((0, 0, 0), (1, 1, 1))
MANY = Trimesh(BOX.vertices, np.tile(BOX.faces[:1], (1_000_000, 1)), process=False)
NAN = Trimesh([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]], [[0, 1, 2]], process=False)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda s: replace(s, frequency=-1.0), "frequency must be in hertz, from 1e\\+06 to 1e\\+12, found -1.0"),
        (gateway(position=(0.0, np.inf, 0.0)), "gateway.position must be finite"),
        (gateway(orientation=(1.0, 1.0, 0.0, 0.0)), "gateway.orientation must be a unit quaternion .* 1.414"),
        (gateway(orientation=(0.0, 0.0, 0.0, np.nan)), "gateway.orientation must be finite"),
        (gateway(pattern="isso"), 'unknown gateway.pattern "isso"; did you mean "iso"'),
        (gateway(polarization="VH"), 'gateway.polarization must be "V" or "H", found "VH"'),
        (gateway(rows=0), "gateway.rows and columns must be at least 1 and at most 64, found 0 x 4"),
        (gateway(spacing=0.0), "gateway.spacing must be a positive number"),
        (gateway(position=(0.5, 0.5, 0.2)), r'gateway.position \[0.5, 0.5, 0.2\] lies inside object "crate"'),
        (transmitter(orientation=(0.0, 0.0, 0.0, 2.0)), "transmitter.orientation must be a unit quaternion"),
        (transmitter(region_max=(1.0, -1.0, 1.5)), "region must have min below max, found y from -1 to -1 m"),
        (transmitter(region_min=(9.0, -1.0, 0.5)), "region must have min below max, found x from 9 to 1 m"),
        (transmitter(region_min=(np.nan, -1.0, 0.5)), "transmitter.region.min must be finite"),
        (transmitter(pattern="dipol"), 'unknown transmitter.pattern "dipol"; did you mean "dipole"'),
        (lambda s: replace(s, objects=()), "needs at least one object"),
        (
            second_object(SceneObject("floor", BOX, "wood")),
            r'objects\[1\] \("floor"\): every object needs a name',
        ),
        (
            second_object(SceneObject("c", BOX, "wod")),
            r'objects\[1\] \("c"\): unknown material "wod"; did you mean "wood"',
        ),
        (
            lambda s: replace(s, objects=tuple(SceneObject(f"c{k}", MANY, "wood") for k in range(3))),
            "a scene may have at most 2000000 triangles, found 3000000",
        ),
        (
            second_object(SceneObject("", BOX, "wood")),
            r"objects\[1\].name must have 1 to 200 characters that can be printed, found ''",
        ),
        (
            second_object(SceneObject("c", Trimesh(BOX.vertices * 1e6, BOX.faces, process=False), "wood")),
            r'objects\[1\] \("c"\): the mesh must be within 100000 m of the origin',
        ),
        (
            second_object(SceneObject("c", Trimesh(), "wood")),
            r'objects\[1\] \("c"\): the mesh has no triangles',
        ),
        (second_object(SceneObject("c", NAN, "wood")), r'objects\[1\] \("c"\): .* not finite'),
        (
            second_object(SceneObject("c", BOX, "wood", -0.1)),
            r'objects\[1\] \("c"\): thickness must be a positive',
        ),
    ],
)
def test_refuses(scene, change, sentence):
    with pytest.raises(InputError, match=f"^yard.yaml: .*{sentence}"):
        validate(change(scene), "yard.yaml")
