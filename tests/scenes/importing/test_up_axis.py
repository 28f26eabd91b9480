"""A file that lies on its side is refused or doubted, with the evidence and the option."""

from pathlib import Path

import numpy as np
import pytest
from trimesh import Trimesh

from scenes.files.errors import InputError
from scenes.importing.formats.mesh_part import ImportedFile, ImportedPart
from scenes.importing.mesh_import import import_scene
from scenes.importing.up_axis import Y_UP_TO_Z_UP, up_doubt, up_evidence
from scenes.places.built_in import BUILT_IN
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, sheet

SIZE = np.array([6.0, 5.0, 2.8])
ANTENNAS = np.array([[1, 1, 1.5], [2, 2, 0.8], [4, 4, 1.6]])


def room(names, y_up=False, size=SIZE):
    """Floor, ceiling and four walls by these names, in a file with z up, or with y up."""
    x, y, z = np.diag(size)
    level = [sheet(0 * x, x, y), sheet(z, x, y)]
    sheets = [*level, sheet(0 * x, x, z), sheet(y, x, z), sheet(0 * x, y, z), sheet(x, y, z)]
    if y_up:
        sheets = [mesh.apply_transform(np.linalg.inv(Y_UP_TO_Z_UP)) for mesh in sheets]
    return [ImportedPart(name, mesh, name) for name, mesh in zip(names, sheets, strict=True)]


NAMED = ["Floor", "Ceiling.001", "wall S", "wall N", "wall W", "wall E"]
UNNAMED = [f"Cube.{number:03}" for number in range(6)]


def doubt(parts, up=None, blender=False, suffix=".obj", antennas=ANTENNAS):
    return up_doubt(ImportedFile(Path(f"room{suffix}"), parts, "z", blender=blender), up, antennas, 1.0)


def test_floors_that_stand_upright_are_decisive_unless_the_user_states_the_axis():
    found, stated = (doubt(room(NAMED, y_up=True), up=up) for up in (None, "z"))
    assert found.decisive and "Floor, Ceiling.001" in found.sentence and "--up y" in found.sentence
    assert not stated.decisive and "--up y" in stated.sentence
    assert doubt(room(NAMED, y_up=True), up="y") is None
    assert not doubt(room(NAMED), up="y").decisive


def test_upright_rooms_are_not_doubted():
    assert doubt(room(NAMED)) is None and doubt(room(NAMED), up="z") is None
    assert doubt(room(NAMED), blender=True) is None  # its OBJ files may have z up as well
    assert doubt(room(UNNAMED)) is None


def test_blenders_header_and_level_areas_together_are_decisive():
    antennas = np.array([[-1.5, 1.2, 1.5], [0, 0.5, 0.8]])  # of no help: within the room by both axes
    parts = room(UNNAMED, y_up=True, size=np.array([6, 5, 2.8]))
    shifted = [ImportedPart(part.name, part.mesh.apply_translation([-3, 0, 2.5]), part.node) for part in parts]
    assert doubt(shifted, blender=True, antennas=antennas).decisive
    assert not doubt(shifted, antennas=antennas).decisive  # the areas alone


def test_antennas_outweigh_areas():
    corridor = room(UNNAMED, size=np.array([20, 1.6, 2.8]))
    inside = np.array([[1, 0.8, 1.5], [5, 0.5, 1], [15, 1.2, 2]])
    assert up_evidence(ImportedFile(Path("a.stl"), corridor, "z"), None, 1.0).axis == "y"
    assert doubt(corridor, antennas=inside) is None


@pytest.mark.parametrize("name", ["floor lamp", "Ground floor wall", "floor_2_window", "Flooring", "groundwater"])
def test_words_that_are_part_of_other_names(name):
    upright = ImportedPart(name, sheet((0, 0, 0), (3, 0, 0), (0, 0, 3)), name)
    assert doubt([upright, *room(UNNAMED)]) is None


def test_a_roof_may_slope_and_a_slab_may_be_thick():
    roof = Trimesh(*(lambda m: (m.vertices, m.faces))(sheet((0, 0, 0), (6, 0, 0), (0, 3, -2))))
    slab = box((0, -0.3, -5), (6, 0, 0))
    for name, mesh, axis in (("Roof", roof, "z"), ("ground", slab, "y")):
        assert up_evidence(ImportedFile(Path("a.stl"), [ImportedPart(name, mesh, name)], "z"), None, 1.0).axis == axis


def test_materials_in_the_file_are_names_too():
    part = ImportedPart("elm__1", sheet((0, 0, 0), (40, 0, 0), (0, 0, 40)), "elm__1", "mat-itu_very_dry_ground")
    assert doubt([part], suffix=".xml").decisive


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_places_are_not_doubted(name):
    place = BUILT_IN[name]()
    parts = [ImportedPart(item.name, item.mesh, item.name, item.material) for item in place.objects]
    antennas = np.vstack([place.gateway.position, place.transmitter.corners()])
    assert doubt(parts, antennas=antennas) is None
    turned = [ImportedPart(p.name, p.mesh.copy().apply_transform(Y_UP_TO_Z_UP.T), p.node, p.material) for p in parts]
    assert doubt(turned, antennas=antennas).decisive


def test_import_refuses_a_room_on_its_side_and_takes_the_stated_axis(tmp_path):
    faces = {"Floor": "1 2 6 5", "Ceiling": "4 3 7 8", "Wall": "1 2 3 4", "Wall_N": "5 6 7 8"}
    corners = "v 0 0 0\nv 6 0 0\nv 6 2.8 0\nv 0 2.8 0\nv 0 0 -5\nv 6 0 -5\nv 6 2.8 -5\nv 0 2.8 -5\n"
    (tmp_path / "room.obj").write_text(corners + "".join(f"o {name}\nf {face}\n" for name, face in faces.items()))
    gateway, region = Gateway((1, 1, 1.5), facing((1, 0, 0))), Transmitter((3, 1, 0.8), (5, 4, 1.6))
    given = {"materials": [("*", "brick")], "gateway": gateway, "transmitter": region}
    with pytest.raises(InputError, match=r"room.obj: expected z to point up, .* found that Ceiling, Floor"):
        import_scene(tmp_path / "room.obj", **given)
    scene, report = import_scene(tmp_path / "room.obj", up="y", **given)
    np.testing.assert_allclose(scene.bounds, [[0, 0, 0], [6, 5, 2.8]], atol=1e-12)
    assert report.warnings == () and "up axis y" in report.assumed[0]
    _, report = import_scene(tmp_path / "room.obj", up="z", **given)
    assert "the up axis is z, but Ceiling, Floor" in report.warnings[0]
