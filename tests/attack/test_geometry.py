"""Meshes drawn at random are imported with the area that their files mean, or are refused."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import strategies as st

from scenes.files.lengths import METRES
from tests.attack import shapes
from tests.attack.shapes import Shape
from tests.attack.victims import PLACE, Victim

pytestmark = pytest.mark.attack

SAME = 1e-6  # Largest relative difference of areas

OPTIONS = st.tuples(
    st.sampled_from([("--unit", unit) for unit in METRES]),
    st.sampled_from([(), ("--up", "y"), ("--up", "z")]),
    st.sampled_from([(), ("--shift", "0", "0", "0"), ("--shift", "1e3", "-2", "0.5"), ("--shift", "1e9", "0", "nan")]),
    st.sampled_from(
        [(), *(("--frequency", text) for text in ("915e6", "3.5 GHz", "915", "2.4", "0", "nan", "GHz", "1 000 MHz"))]
    ),
)


def area_of(folder: Path) -> float:
    """The area of all meshes of a scene's folder, read without our own code."""
    return sum(trimesh.load(path, force="mesh", process=False).area for path in (folder / "meshes").iterdir())


def attack(shape: Shape, options: tuple[str, ...] = (), unit: str = "m") -> tuple:
    """The import of a shape, whose area is then compared."""
    command = " ".join(["scene", shape.name, "-o", "out", *map(repr, options), PLACE, "--walls", "as-drawn"])

    def compare(here: Path) -> None:
        if shape.area is not None:
            found, expected = area_of(here / "out"), shape.area * METRES[unit] ** 2
            assert np.isclose(found, expected, rtol=SAME, atol=1e-9), f"area {found}, expected {expected}: {command}"

    victim = Victim(shape.name, command, (), ())
    return victim, lambda here: (here / shape.name).write_bytes(shape.content), compare


SHAPES = {
    "polygons": shapes.polygons().map(attack),
    "glTF nodes": shapes.nodes().map(attack),
    "units and axes": st.tuples(shapes.polygons().filter(lambda shape: shape.area), OPTIONS).map(
        lambda drawn: attack(drawn[0], sum(drawn[1], ()), drawn[1][0][1])
    ),
}


@pytest.mark.parametrize("group", SHAPES)
def test_shapes(group, tally):
    tally.attacks(SHAPES[group])
