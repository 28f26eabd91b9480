"""Scene files of Mitsuba 3 and Sionna RT: their shapes and radio materials, read without either program."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation
from trimesh import Trimesh

from scenes.files.errors import InputError, cut, did_you_mean, named
from scenes.files.extras import require_extra
from scenes.files.input_file import beside
from scenes.files.xml_file import read_xml
from scenes.importing.mesh_files import read_meshes, require_ordinary
from scenes.scene.materials import RadioMaterial, material_names, p2040_material
from scenes.scene.shapes import box, sheet, union

SIONNA = "sionna:"  # before the name of one of Sionna RT's own scenes
SHAPES = ("ply", "obj", "rectangle", "cube")
# Elements that hold no shape. Others may hold one (include, alias) and are refused, since a missing wall is easily
# overlooked.
WITHOUT_SHAPES = ("default", "bsdf", "texture", "medium", "sensor", "emitter", "integrator")
# A material's missing values are those of Sionna RT, so that both programs trace the same place.
SIONNA_DEFAULTS = {
    "thickness": 0.1,  # m
    "relative_permittivity": 1.0,
    "conductivity": 0.0,  # S/m
    "scattering_coefficient": 0.0,
    "xpd_coefficient": 0.0,
}
LONGEST_NAME, LONGEST_TEXT = 100, 10_000
"""Characters of the name of a <default>, and of an attribute in which such names are replaced."""
GREY = (0.6, 0.6, 0.6)  # colours are for drawings only, so those of the file are ignored
COLORS = ("color", "reflectance", "base_color")


@dataclass(frozen=True)
class MitsubaShape:
    """A shape of a scene file.

    Attributes:
        name: its id without the "mesh-" that Blender's exporter adds, as in Sionna RT.
        mesh: its triangles, transform applied, in the file's own unit and axes.
        bsdf: the XML element of its material; None if it has none.
        source: the start of every message about it.
    """

    name: str
    mesh: Trimesh
    bsdf: Element | None
    source: str

    def radio_material(self, frequency: float, default: str | None = None) -> RadioMaterial:
        """The material that the file gives the shape, named by its bsdf's id without "mat-" and "itu_".

        Args:
            frequency: hertz.
            default: P.2040 name for a shape that the file gives no radio material.

        Returns:
            The material.

        Raises:
            InputError: no radio material and no default, an unknown material or property, a value out of
                its range, or a P.2040 material that is not known at the frequency.
        """
        bsdf = Element("bsdf", type="none") if self.bsdf is None else self.bsdf
        kind, mat = bsdf.get("type"), bsdf.get("id", "").removeprefix("mat-")
        name = re.sub("^itu[_-]", "", mat)
        label = f"{self.source}: bsdf {named(bsdf.get('id', kind) or '')}"
        given = {child.get("name"): child for child in bsdf if child.tag in ("float", "integer", "string")}
        row = name.replace(" ", "_")
        known = ["thickness", "scattering_coefficient", "xpd_coefficient"]
        if kind == "radio-material":
            known += ["relative_permittivity", "conductivity"]
        elif kind == "itu-radio-material" or name != mat or row in material_names():
            row = given.pop("type").get("value", "") if "type" in given else row
            if row not in material_names():
                suggestion = did_you_mean(row, material_names())
                raise InputError(f"{label}: expected a material of ITU-R P.2040, found {named(row)}; {suggestion}")
        elif default is not None:
            return p2040_material(default, frequency)
        else:
            raise InputError(
                f'{self.source}: expected an itu-radio-material, a radio-material or an id such as "mat-itu_concrete", '
                f"found {'no bsdf' if self.bsdf is None else _shown(bsdf)}; or give it one by a material rule"
            )
        if kind in ("radio-material", "itu-radio-material"):  # all others describe looks too
            for key in given.keys() - {*known, *COLORS}:
                raise InputError(f"{label}: unknown property {named(str(key))}; {did_you_mean(key, known)}")
        values: dict[str, Any] = {key: SIONNA_DEFAULTS[key] for key in known}
        values |= {key: _numbers(given[key], "value", (1,), label)[0] for key in known if key in given}
        try:
            if kind == "radio-material":
                return RadioMaterial(name or self.name, color=GREY, **values)
            return replace(p2040_material(row, frequency), name=name or row, **values)
        except InputError as error:
            raise InputError(f"{self.source}: {error}") from None


def sionna_scene(name: str) -> Path:
    """The file of one of Sionna RT's own scenes, in the installed package.

    Args:
        name: "sionna:" and the scene's name, such as "sionna:etoile".

    Returns:
        Path of the scene XML.

    Raises:
        InputError: Sionna RT has no scene of that name.
        MissingExtraError: Sionna RT is not installed.
    """
    require_extra("rays", f"the scene {cut(name)}")
    spec = find_spec("sionna")  # finds the folder without starting the ray tracer
    folders = [Path(folder) / "rt" / "scenes" for folder in (spec and spec.submodule_search_locations) or ()]
    files = {SIONNA + path.stem: path for folder in folders for path in folder.glob("*/*.xml")}
    if name not in files:
        raise InputError(f"{name}: Sionna RT has no such scene; {did_you_mean(name, files)}")
    return files[name]


def read_mitsuba(path: Path) -> list[MitsubaShape]:
    """Read every shape of a Mitsuba 3 or Sionna RT scene file: ply, obj, rectangle and cube.

    ``to_world`` is applied and ``$name`` replaced by its <default>. Sensors, emitters and integrators are ignored.

    Args:
        path: the scene XML.

    Returns:
        The shapes, in the order of the file.

    Raises:
        InputError: no such file, malformed XML, an element, shape or transform of another kind, a ``$name``
            without a default, a mesh that cannot be read, or an unknown reference.
    """
    root = read_xml(path, "a Mitsuba scene")
    if root.tag != "scene":
        raise InputError(f"{path}: expected a Mitsuba <scene>, found {_shown(root)}")
    _replace_names(root, path)
    bsdfs = {bsdf.attrib["id"]: bsdf for bsdf in root.iter("bsdf") if "id" in bsdf.attrib}
    shapes: list[MitsubaShape] = []
    for element in root:
        if element.tag == "shape":
            shapes.append(_shape(element, len(shapes), path, bsdfs))
        elif element.tag not in WITHOUT_SHAPES:
            raise InputError(f"{path}: expected shapes and what they are made of, found {_shown(element)}")
    if not shapes:
        raise InputError(f"{path}: expected at least one shape, found none")
    return shapes


def _shown(element: Element) -> str:
    attributes = [f' {key}="{element.get(key)}"' for key in ("type", "id", "name") if key in element.attrib]
    return cut(f"<{element.tag}{''.join(attributes)}>")


def _replace_names(root: Element, path: Path) -> None:
    """Every $name in an attribute becomes the value of the <default> of that name, which comes before it."""
    defaults: dict[str, str] = {}
    for element in root.iter():
        for key, text in element.attrib.items():
            if "$" in text:
                element.set(key, _replace_in(text, defaults, f"{path}: {_shown(element)}"))
        if element.tag == "default":
            defaults[element.get("name", "")] = element.get("value", "")


def _replace_in(text: str, defaults: dict[str, str], label: str) -> str:
    """A text in which each $name has become its default's value; of several names that fit, the longest counts."""
    longest = min(max(map(len, defaults), default=0), LONGEST_NAME)
    first, *rest = text.split("$")
    result = first
    for part in rest:
        name = next((part[:end] for end in range(longest, 0, -1) if part[:end] in defaults), None)  # $width before $w
        if name is None:
            raise InputError(f"{label}: expected a <default> before {named('$' + part)}, found none")
        result += defaults[name] + part[len(name) :]
        if len(result) > LONGEST_TEXT:  # each <default> may double the one before
            raise InputError(f"{label}: expected at most {LONGEST_TEXT} characters after its names are replaced")
    return result


def _shape(element: Element, index: int, path: Path, bsdfs: dict[str, Element]) -> MitsubaShape:
    name = element.get("id", element.get("name", "")).removeprefix("mesh-") or f"shape_{index + 1}"
    label = f"{path}: shape {named(name)}"
    kind = element.get("type", "")
    if kind == "rectangle":
        mesh = sheet((-1, -1, 0), (2, 0, 0), (0, 2, 0))
    elif kind == "cube":
        mesh = box((-1, -1, -1), (1, 1, 1))
    elif kind in SHAPES:
        filename = next((s.get("value", "") for s in element.findall("string") if s.get("name") == "filename"), "")
        if Path(filename).suffix.lower() != f".{kind}":
            raise InputError(f"{label}: expected the filename of a .{kind} mesh, found {named(filename)}")
        try:
            mesh = union(*(part for _, part in read_meshes(beside(path, filename))))
        except InputError as error:
            raise InputError(f"{label}: expected a mesh, found {error}") from None
    else:
        raise InputError(f"{label}: expected one of {', '.join(SHAPES)}, found type {named(kind)}")

    made_of = element.findall("bsdf")
    for ref in element.findall("ref"):
        wanted = ref.get("id", "")
        if wanted not in bsdfs:
            suggestion = did_you_mean(wanted, bsdfs or ("none",))
            raise InputError(f"{label}: expected the id of a bsdf, found {named(wanted)}; {suggestion}")
        made_of.append(bsdfs[wanted])
    if len(made_of) > 1:
        raise InputError(f"{label}: expected one bsdf, found {len(made_of)}")
    with np.errstate(all="ignore"):  # what is not finite is refused below
        mesh.apply_transform(_to_world(element, label))
    require_ordinary(mesh, label)
    return MitsubaShape(name, mesh, made_of[0] if made_of else None, label)


def _numbers(element: Element, key: str, counts: tuple[int, ...], label: str) -> list[float]:
    """An attribute's numbers, separated by blanks or commas."""
    text = element.get(key, "")
    try:
        values = [float(word) for word in re.split(r"[\s,]+", text.strip())]
    except ValueError:
        values = []
    if len(values) not in counts or not all(map(math.isfinite, values)):
        count = " or ".join(map(str, counts))
        raise InputError(f"{label}: {_shown(element)}: expected {count} numbers as {key}, found {named(text)}")
    return values


def _vector(element: Element, missing: float, label: str) -> list[float]:
    """value="x y z", one value for all three, or the attributes x, y and z."""
    if "value" in element.attrib:
        values = _numbers(element, "value", (1, 3), label)
        return values if len(values) == 3 else values * 3
    return [_numbers(element, axis, (1,), label)[0] if axis in element.attrib else missing for axis in "xyz"]


def _to_world(shape: Element, label: str) -> Float[np.ndarray, "4 4"]:
    """The shape's transform; of several steps the first in the file is the first applied."""
    world = np.eye(4)
    for transform in shape.findall("transform"):
        if transform.get("name") != "to_world":
            raise InputError(f"{label}: expected a transform to_world, found {_shown(transform)}")
        for step in transform:
            matrix = np.eye(4)
            if step.tag == "translate":
                matrix[:3, 3] = _vector(step, 0.0, label)
            elif step.tag == "scale":
                matrix[:3, :3] = np.diag(_vector(step, 1.0, label))
            elif step.tag == "rotate":
                axis, (angle,) = np.array(_vector(step, 0.0, label)), _numbers(step, "angle", (1,), label)
                length = float(np.linalg.norm(axis))
                if not 0 < length < math.inf:
                    raise InputError(f"{label}: <rotate>: expected an axis as x, y and z, found none")
                turn = Rotation.from_rotvec(angle * axis / length, degrees=True)
                matrix[:3, :3] = turn.as_matrix()
            elif step.tag == "matrix":
                values = _numbers(step, "value", (9, 16), label)
                size = math.isqrt(len(values))
                matrix[:size, :size] = np.reshape(values, (size, size))
            else:
                raise InputError(f"{label}: expected translate, rotate, scale or matrix, found {_shown(step)}")
            world = matrix @ world
    ordinary = np.isfinite(world).all() and np.array_equal(world[3], [0, 0, 0, 1])
    if not ordinary or np.linalg.matrix_rank(world[:3, :3]) < 3:
        raise InputError(f"{label}: expected a transform that keeps three dimensions, found {world.tolist()}")
    return world
