"""Public files, of Debian's assimp-testmodels and Sionna RT, have the area, volume and bounds that assimp or VTK found.

benchmarks/product/public_files.py writes public_files.json. What is not installed, or of another version, is skipped.
"""

import hashlib
import json
from collections import Counter
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from scenes.importing.mesh_files import read_mesh_file
from scenes.importing.mitsuba_xml import SIONNA, sionna_scene

TABLE = json.loads(Path(__file__).with_name("public_files.json").read_text())
SINGLE = 2e-5  # Relative difference that the single precision of the other reader may make


def place(name: str) -> Path:
    source, _, rest = name.partition("/")
    if source == "assimp":
        return Path("/usr/share/assimp/models") / rest
    if find_spec("sionna") is None:
        pytest.skip("Sionna RT is not installed")
    return sionna_scene(f"{SIONNA}box").parents[1] / rest


@pytest.mark.parametrize("name", TABLE)
def test_area_volume_and_bounds(name):
    expected, path = TABLE[name], place(name)
    if not path.is_file():
        pytest.skip(f"{path} is not installed (apt-get install assimp-testmodels)")
    if hashlib.sha256(path.read_bytes()).hexdigest() != expected["sha256"]:
        pytest.skip(f"{path} is of another version")
    triangles = np.concatenate([part.mesh.triangles for part in read_mesh_file(path).parts])
    first, second, third = np.moveaxis(triangles, 1, 0)
    far = np.abs(triangles).max()
    np.testing.assert_allclose(triangles.min(axis=(0, 1)), expected["low"], atol=SINGLE * far)
    np.testing.assert_allclose(triangles.max(axis=(0, 1)), expected["high"], atol=SINGLE * far)
    area = np.linalg.norm(np.cross(second - first, third - first), axis=1).sum() / 2
    assert area == pytest.approx(expected["area"], rel=SINGLE)
    volume = np.einsum("ti,ti->", first, np.cross(second, third)) / 6
    assert volume == pytest.approx(expected["volume"], abs=SINGLE * area * far)


def test_the_table_has_thirty_files_of_all_formats():
    assert len(TABLE) >= 60 and sum(row["closed"] for row in TABLE.values()) >= 30
    suffixes = Counter(Path(name).suffix.lower() for name in TABLE)
    assert suffixes.keys() == {".glb", ".gltf", ".obj", ".off", ".ply", ".stl"}
