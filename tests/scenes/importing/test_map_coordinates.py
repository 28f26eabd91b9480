"""Objects in map coordinates are moved to the origin by --shift, without loss, and the refusal says by how much."""

import re
from dataclasses import replace

import numpy as np
import pytest

from scenes.files.errors import InputError, ParameterError
from scenes.importing.mesh_import import import_scene
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.orientation import facing
from scenes.scene.shapes import box

UTM = np.array([691234.25, 5334567.125, 515.5])
GATEWAY = Gateway((1.0, 2.0, 1.5), facing((1, 0, 0)))
REGION = Transmitter((2.5, 1.0, 0.5), (4.5, 3.0, 1.5))
RULES = [("*", "concrete")]


def in_map_coordinates(antenna, by=UTM):
    if isinstance(antenna, Gateway):
        return replace(antenna, position=antenna.position + by)
    return replace(antenna, region_min=antenna.region_min + by, region_max=antenna.region_max + by)


@pytest.fixture
def room(tmp_path):
    """Function: origin -> OBJ of a room of 5 x 4 x 3 m whose lowest corner is there."""

    def write(origin):
        mesh = box((0, 0, 0), (5, 4, 3))
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in (mesh.vertices + origin).tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (mesh.faces + 1).tolist()]
        (tmp_path / "room.obj").write_text("\n".join(lines))
        return tmp_path / "room.obj"

    return write


def test_shift_moves_the_objects_and_the_antennas_alike(room):
    antennas = {"gateway": in_map_coordinates(GATEWAY), "transmitter": in_map_coordinates(REGION)}
    scene, report = import_scene(room(UTM), RULES, shift=-UTM, **antennas)
    near, _ = import_scene(room(np.zeros(3)), RULES, gateway=GATEWAY, transmitter=REGION)
    assert scene == near  # to the last bit: these coordinates are exact in binary
    assert "unit m, shifted by -691234.25 -5334567.125 -515.5 m" in report.assumed[0] and report.warnings == ()


def test_the_shift_that_the_refusal_proposes_works(room):
    antennas = {"gateway": in_map_coordinates(GATEWAY), "transmitter": in_map_coordinates(REGION)}
    with pytest.raises(InputError, match=r"room.obj: expected coordinates within 100000 m of the origin") as refusal:
        import_scene(room(UTM), RULES, **antennas)
    shift = [float(word) for word in re.search(r"--shift (\S+) (\S+) (\S+) moves", str(refusal.value)).groups()]
    scene, _ = import_scene(room(UTM), RULES, shift=shift, **antennas)
    assert np.abs(scene.bounds).max() < 5
    np.testing.assert_allclose(scene.gateway.position - scene.bounds[0], GATEWAY.position, atol=1e-8)


def test_antennas_elsewhere_have_to_be_given_in_the_same_coordinates(room):
    with pytest.raises(
        InputError, match=r"give the gateway and the region in the same coordinates; then --shift -691237"
    ):
        import_scene(room(UTM), RULES, gateway=GATEWAY, transmitter=REGION)


def test_near_scenes_need_no_shift(room):
    far = np.array([30_000.0, -40_000.0, 500.0])
    antennas = {"gateway": in_map_coordinates(GATEWAY, far), "transmitter": in_map_coordinates(REGION, far)}
    scene, report = import_scene(room(far), RULES, **antennas)
    assert report.warnings == () and scene.bounds[0].tolist() == far.tolist()


def test_single_precision_far_from_the_origin_is_a_warning(tmp_path):
    mesh = box((0, 0, 0), (5, 4, 3))
    mesh.apply_translation(UTM)
    mesh.export(tmp_path / "room.stl")  # binary: 32-bit numbers
    antennas = {"gateway": in_map_coordinates(GATEWAY), "transmitter": in_map_coordinates(REGION)}
    _, report = import_scene(tmp_path / "room.stl", RULES, shift=-UTM, **antennas)
    assert "coordinates of 5334571 m are rounded to 0.5 m" in report.warnings[0]


@pytest.mark.parametrize("shift", [(1, 2), (1e300, 0, 0), (1, 2, np.nan), (1, 2, np.inf), "123", None, 5, ("a", 0, 0)])
def test_wrong_shifts(room, shift):
    with pytest.raises(ParameterError, match=r"shift: expected (metres along x, y and z|at most|.*finite)"):
        import_scene(room(np.zeros(3)), RULES, shift=shift, gateway=GATEWAY, transmitter=REGION)


def test_utm_in_millimetres(room):
    antennas = {"gateway": in_map_coordinates(GATEWAY), "transmitter": in_map_coordinates(REGION)}
    path = room(UTM)
    lines = [line.split() for line in path.read_text().splitlines()]
    text = [f"v {' '.join(repr(1000 * float(each)) for each in rest)}" if word == "v" else " ".join([word, *rest])
            for word, *rest in lines]  # fmt: skip
    path.write_text("\n".join(text))
    scene, _ = import_scene(path, RULES, unit="mm", shift=-UTM, **antennas)
    np.testing.assert_allclose(scene.bounds, [[0, 0, 0], [5, 4, 3]], atol=1e-8)
