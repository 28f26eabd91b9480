"""Mesh files and scene files that are damaged or hostile get one sentence, at once and without their weight."""

import os
import re
import time

import numpy as np
import pytest

from scenes.files.errors import InputError
from scenes.importing.formats import gltf_arrays
from scenes.importing.imported_file import read_file
from scenes.importing.mesh_files import read_mesh_file
from scenes.importing.mesh_import import import_scene
from scenes.importing.mitsuba_xml import read_mitsuba
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.orientation import facing
from scenes.storage.scene_writing import write_scene
from scenes.storage.scene_yaml import read_scene
from tests import hostile_files as hostile

AT_ONCE = 5.0  # Seconds, on a machine that is busy


def refusal(read, *arguments) -> str:
    """The sentence, which must come soon and have one line."""
    began = time.perf_counter()
    with pytest.raises(InputError) as caught:
        read(*arguments)
    assert time.perf_counter() - began < AT_ONCE
    sentence = str(caught.value)
    assert sentence.isprintable() and len(sentence) < 600
    return sentence


@pytest.mark.parametrize("name", hostile.MESHES)
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_damaged_meshes(tmp_path, name):
    content, sentence = hostile.MESHES[name]
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / name).write_bytes(content)
    said = refusal(read_mesh_file, tmp_path / name)
    assert re.search(sentence, said) and name in said


@pytest.mark.parametrize("kind", hostile.SPECIAL)
@pytest.mark.parametrize(
    ("name", "sentence"), [("wall.ply", "a mesh"), ("wall.gltf", "a mesh"), ("a.xml", "a Mitsuba")]
)
def test_what_is_no_ordinary_file_is_not_opened(tmp_path, kind, name, sentence):
    hostile.SPECIAL[kind](tmp_path / name)
    assert f"expected {sentence}" in refusal(read_file, tmp_path / name)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.ply", hostile.ply()),
        ("a.ply", hostile.ply(binary=False)),
        ("a.stl", hostile.stl()),
        ("a.obj", hostile.obj()),
        ("a.off", hostile.off()),
        ("a.gltf", hostile.gltf_bytes()),
        ("a.glb", hostile.glb(hostile.gltf_bytes())),
    ],
)
def test_the_same_builders_make_files_that_are_read(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    (part,) = read_mesh_file(tmp_path / name).parts
    np.testing.assert_allclose(part.mesh.triangles, [hostile.CORNERS])


def test_buffers_beside_a_gltf_are_read_up_to_a_size(tmp_path, monkeypatch):
    data = np.asarray(hostile.CORNERS, "<f4").tobytes() + np.arange(3, dtype="<u4").tobytes()
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "my wall.bin").write_bytes(data)
    path = tmp_path / "wall.gltf"
    buffer = {"uri": "data/my%20wall.bin", "byteLength": 48}
    path.write_bytes(hostile.gltf_bytes(buffers=[buffer]))
    assert [part.name for part in read_mesh_file(path).parts] == ["wall"]
    (tmp_path / "data" / "my wall.bin").write_bytes(data + bytes(1000))
    monkeypatch.setattr(gltf_arrays, "LARGEST_FILE", 1500)
    views = [{"buffer": 0, "byteLength": 36}, {"buffer": 1, "byteOffset": 36, "byteLength": 12}]
    path.write_bytes(hostile.gltf_bytes(buffers=[buffer] * 2, bufferViews=views))  # each fits, both together do not
    assert "my wall.bin: expected a buffer of glTF of at most" in refusal(read_mesh_file, path)


@pytest.mark.parametrize("case", hostile.XML)
def test_damaged_scene_files(tmp_path, case):
    content, sentence = hostile.XML[case]
    os.mkfifo(tmp_path / "pipe.ply")
    (tmp_path / "zero.ply").symlink_to("/dev/zero")
    path = tmp_path / "outdoors.xml"
    path.write_text(content)
    said = refusal(read_mitsuba, path)
    assert re.search(sentence, said) and "outdoors.xml" in said


def test_many_defaults_are_replaced_soon(tmp_path):
    defaults = "".join(f'<default name="name{k}" value="1"/>' for k in range(3000))
    shapes = "".join(hostile.rectangle(to_scale) for to_scale in [hostile.to_world('<scale x="$name2999"/>')] * 100)
    (tmp_path / "outdoors.xml").write_text(hostile.xml(defaults, shapes))
    began = time.perf_counter()
    assert len(read_mitsuba(tmp_path / "outdoors.xml")) == 100
    assert time.perf_counter() - began < AT_ONCE


NAMES = ["", "a/b", "A/B", "a b", "line\nfeed", "é", "x" * 500, "..", "CON", "wall_2", "wall", "wall", "!!!"]


def test_names_of_other_programs_become_names_that_a_scene_may_have(tmp_path):
    names = [name.encode("ascii", "xmlcharrefreplace").decode() for name in NAMES]
    concrete = '<bsdf type="diffuse" id="mat-itu_concrete"/>'
    shapes = [f'<shape type="rectangle" id="{name}">{concrete}</shape>' for name in names]
    (tmp_path / "outdoors.xml").write_text(hostile.xml(*shapes).replace("\n", "&#10;"))
    names = [part.name for part in read_file(tmp_path / "outdoors.xml").parts]
    assert len(set(names)) == len(names)
    assert names[:2] == ["shape_1", "a/b"] and names[4] == "line_feed" and names[-3:] == ["wall", "wall_3", "!!!"]
    assert all(0 < len(name) <= 200 and name.isprintable() for name in names)
    antennas = {"gateway": Gateway((0, 0, 4), facing((0, 0, -1))), "transmitter": Transmitter((-1, -1, 1), (1, 1, 2))}
    scene, _ = import_scene(tmp_path / "outdoors.xml", frequency=3.5e9, **antennas)
    assert read_scene(write_scene(scene, tmp_path / "outdoors")) == scene  # what is written can be read
