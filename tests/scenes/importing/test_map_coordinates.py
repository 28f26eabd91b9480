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
NEAR = {"gateway": GATEWAY, "transmitter": REGION}
IN_UTM = {
    "gateway": replace(GATEWAY, position=GATEWAY.position + UTM),
    "transmitter": Transmitter(REGION.region_min + UTM, REGION.region_max + UTM),
}


@pytest.fixture
def room(tmp_path):
    """Function: origin, units per metre -> OBJ of a room of 5 x 4 x 3 m whose lowest corner is there."""

    def write(origin, scale=1):
        mesh = box((0, 0, 0), (5, 4, 3))
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in (scale * (mesh.vertices + origin)).tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (mesh.faces + 1).tolist()]
        (tmp_path / "room.obj").write_text("\n".join(lines))
        return tmp_path / "room.obj"

    return write


def test_shift_moves_the_objects_and_the_antennas_alike(room):
    scene, report = import_scene(room(UTM), RULES, shift=-UTM, **IN_UTM)
    near, _ = import_scene(room(np.zeros(3)), RULES, **NEAR)
    assert scene == near  # to the last bit: these coordinates are exact in binary
    assert "shifted by -691234.25 -5334567.125 -515.5 m" in report.assumed[0] and report.warnings == ()
    scene, _ = import_scene(room(UTM, scale=1000), RULES, unit="mm", shift=-UTM, **IN_UTM)
    np.testing.assert_allclose(scene.bounds, [[0, 0, 0], [5, 4, 3]], atol=1e-8)


def test_the_shift_that_the_refusal_proposes_works(room):
    with pytest.raises(InputError, match=r"room.obj: expected coordinates within 100000 m of the origin") as refusal:
        import_scene(room(UTM), RULES, **IN_UTM)
    shift = [float(word) for word in re.search(r"--shift (\S+) (\S+) (\S+) moves", str(refusal.value)).groups()]
    scene, _ = import_scene(room(UTM), RULES, shift=shift, **IN_UTM)
    assert np.abs(scene.bounds).max() < 5
    np.testing.assert_allclose(scene.gateway.position - scene.bounds[0], GATEWAY.position, atol=1e-8)


def test_antennas_elsewhere_have_to_be_given_in_the_same_coordinates(room):
    with pytest.raises(InputError, match=r"room.obj: .* in the same coordinates; then --shift -691237"):
        import_scene(room(UTM), RULES, **NEAR)


def test_single_precision_far_from_the_origin_is_a_warning(tmp_path):
    mesh = box((0, 0, 0), (5, 4, 3))
    mesh.apply_translation(UTM)
    mesh.export(tmp_path / "room.stl")  # binary: 32-bit numbers
    _, report = import_scene(tmp_path / "room.stl", RULES, shift=-UTM, **IN_UTM)
    assert "5334571 m are rounded to 0.5 m" in report.warnings[0]


@pytest.mark.parametrize("shift", [(1, 2), (1e300, 0, 0), (1, 2, np.nan), "123", None, ("a", 0, 0)])
def test_wrong_shifts(room, shift):
    with pytest.raises(ParameterError, match=r"shift: expected"):
        import_scene(room(np.zeros(3)), RULES, shift=shift, **NEAR)
