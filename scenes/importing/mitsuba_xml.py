"""Read the shapes and radio materials of Mitsuba 3 and Sionna RT scene files, without either program."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from string import Template
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from scenes.files.errors import InputError, cut, did_you_mean, named
from scenes.files.input_file import beside, parse_number
from scenes.files.json_yaml_xml import read_xml
from scenes.files.optional_packages import require_extra
from scenes.importing.formats.mesh_part import (
    ImportedPart,
    known_material,
    material_at,
    proposed_rule,
    require_ordinary,
    short_name,
)
from scenes.importing.mesh_files import read_mesh_file
from scenes.scene.materials import P2040, RadioMaterial
from scenes.scene.shapes import box, sheet, union

SIONNA = "sionna:"  # prefix of the names of scenes that come with Sionna RT
SHAPES = ("ply", "obj", "rectangle", "cube")
# Elements that contain no shape. Others, such as include and alias, may contain one. They are refused, since a missing
# wall is easily overlooked.
WITHOUT_SHAPES = ("default", "bsdf", "texture", "medium", "sensor", "emitter", "integrator")
# Missing values of a material are those of Sionna RT, so that both programs trace the same scene.
SIONNA_DEFAULTS = {
    "thickness": 0.1,  # m
    "relative_permittivity": 1.0,
    "conductivity": 0.0,  # S/m
    "scattering_coefficient": 0.0,
    "xpd_coefficient": 0.0,
}
LONGEST_TEXT = 10_000  # Most characters of an attribute with the names of <default>s, also after these are replaced
GREY = (0.6, 0.6, 0.6)  # for drawings; the colours of the file are ignored
COLORS = ("color", "reflectance", "base_color")


@dataclass(frozen=True)
class MitsubaShape(ImportedPart):
    """A shape of a scene file, named by its id without the prefix "mesh-" of Blender's exporter, as in Sionna RT."""

    bsdf: Element | None = None  # the XML element of the material, if the shape has one
    source: str = ""  # the start of every message about the shape
    left_out: tuple[str, ...] = ()  # a sentence for each thing in its mesh file that was not read

    @property
    def states_thickness(self) -> bool:
        return self.bsdf is not None and any(child.get("name") == "thickness" for child in self.bsdf)

    def radio_material(self, frequency: float, own: Mapping[str, RadioMaterial]) -> RadioMaterial | None:
        """The shape's radio material, named by the id of the bsdf without "mat-", "itu_" and Blender's number."""
        if self.bsdf is None:
            return None
        kind, mat = self.bsdf.get("type"), short_name(self.bsdf.get("id", "")).removeprefix("mat-")
        name = re.sub("^itu[_-]", "", mat, flags=re.IGNORECASE)
        known = known_material(name, own)
        if known is not None and known in own:
            return material_at(known, frequency, own)
        label = f"{self.source}: bsdf {named(self.bsdf.get('id', kind) or '')}"
        given = {child.get("name"): child for child in self.bsdf if child.tag in ("float", "integer", "string")}
        keys = ["thickness", "scattering_coefficient", "xpd_coefficient"]
        if kind == "radio-material":
            keys += ["relative_permittivity", "conductivity"]
        elif kind == "itu-radio-material" or name != mat or known is not None:
            wanted = given.pop("type").get("value", "") if "type" in given else name
            known = known_material(wanted, {})
            if known is None:
                suggestion = did_you_mean(wanted, P2040)
                raise InputError(
                    f"{label}: expected a material of ITU-R P.2040, found {named(wanted)}; {suggestion} (or assign "
                    f"one: --material {proposed_rule(self.material or self.node)})"
                )
        else:
            return None
        if kind in ("radio-material", "itu-radio-material"):  # others also have visual properties
            for key in given.keys() - {*keys, *COLORS}:
                raise InputError(f"{label}: unknown property {named(str(key))}; {did_you_mean(key, keys)}")
        values: dict[str, Any] = {key: SIONNA_DEFAULTS[key] for key in keys}
        values |= {key: _numbers(given[key], "value", (1,), label)[0] for key in keys if key in given}
        try:
            if known is None or kind == "radio-material":
                return RadioMaterial(name or self.node, color=GREY, **values)
            return replace(material_at(known, frequency, own), name=name or known, **values)
        except InputError as error:
            raise InputError(f"{self.source}: {error}") from None


def sionna_scene(name: str) -> Path:
    """Find the file of a scene that comes with Sionna RT, in the installed package."""
    require_extra("rays", f"the scene {cut(name)}")
    spec = find_spec("sionna")  # finds the folder without starting the ray tracer
    folders = [Path(folder) / "rt" / "scenes" for folder in (spec and spec.submodule_search_locations) or ()]
    files = {SIONNA + path.stem: path for folder in folders for path in folder.glob("*/*.xml")}
    if name not in files:
        raise InputError(f"unknown scene {named(name)} of Sionna RT; {did_you_mean(name, files)}")
    return files[name]


def read_mitsuba(path: Path) -> list[MitsubaShape]:
    """Read the shapes of a Mitsuba 3 or Sionna RT scene file: ply, obj, rectangle and cube.

    ``to_world`` is applied, and ``$name`` is replaced by its <default>. Sensors, emitters and integrators are ignored.
    """
    root = read_xml(path)
    if root.tag != "scene":
        raise InputError(f"{path}: expected a Mitsuba <scene>, found {_shown(root)}")
    _replace_names(root, path)
    bsdfs = {bsdf.attrib["id"]: bsdf for bsdf in root.iter("bsdf") if "id" in bsdf.attrib}
    shapes: list[MitsubaShape] = []
    for element in root:
        if element.tag == "shape":
            shapes.append(_shape(element, len(shapes), path, bsdfs))
        elif element.tag not in WITHOUT_SHAPES:
            raise InputError(f"{path}: expected shapes and their materials, found {_shown(element)}")
    if not shapes:
        raise InputError(f"{path}: expected at least one shape, found none")
    return shapes


def _shown(element: Element) -> str:
    attributes = [f' {key}="{element.get(key)}"' for key in ("type", "id", "name") if key in element.attrib]
    return cut(f"<{element.tag}{''.join(attributes)}>")


def _replace_names(root: Element, path: Path) -> None:
    """Replace each $name in an attribute by the value of the <default> of this name, which must come before it."""
    defaults: dict[str, str] = {}
    for element in root.iter():
        for key, text in element.attrib.items():
            if "$" not in text:
                continue
            label = f"{path}: {_shown(element)}"
            try:
                replaced = Template(text).substitute(defaults) if len(text) <= LONGEST_TEXT else text
            except (KeyError, ValueError):
                raise InputError(f"{label}: expected a <default> before {named(text)}, found none") from None
            if len(replaced) > LONGEST_TEXT:  # each <default> may double the one before
                raise InputError(
                    f"{label}: expected at most {LONGEST_TEXT} characters after replacing $names, found more"
                )
            element.set(key, replaced)
        if element.tag == "default":
            defaults[element.get("name", "")] = element.get("value", "")


def _shape(element: Element, index: int, path: Path, bsdfs: dict[str, Element]) -> MitsubaShape:
    name = element.get("id", element.get("name", "")).removeprefix("mesh-") or f"shape_{index + 1}"
    label = f"{path}: shape {named(name)}"
    kind = element.get("type", "")
    mesh_file: str | None = None
    left_out: tuple[str, ...] = ()
    if kind == "rectangle":
        mesh = sheet((-1, -1, 0), (2, 0, 0), (0, 2, 0))
    elif kind == "cube":
        mesh = box((-1, -1, -1), (1, 1, 1))
    elif kind in SHAPES:
        filename = next((s.get("value", "") for s in element.findall("string") if s.get("name") == "filename"), "")
        if Path(filename).suffix.lower() != f".{kind}":
            raise InputError(f"{label}: expected the filename of a .{kind} mesh, found {named(filename)}")
        try:
            file = read_mesh_file(beside(path, filename))
        except InputError as error:
            raise InputError(f"{label}: mesh: {error}") from None
        mesh, mesh_file, left_out = union(*(part.mesh for part in file.parts)), Path(filename).stem, file.left_out
        left_out = tuple(f"shape {named(name)}: {sentence}" for sentence in left_out)
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
    with np.errstate(all="ignore"):  # numbers that are not finite are refused below
        mesh.apply_transform(_to_world(element, label))
    require_ordinary(mesh.vertices, label)
    bsdf = made_of[0] if made_of else None
    material = None if bsdf is None else bsdf.get("id")
    return MitsubaShape(name, mesh, name, material, mesh_file, bsdf, label, left_out)


def _numbers(element: Element, key: str, counts: tuple[int, ...], label: str) -> list[float]:
    """Return the numbers in an attribute, separated by spaces or commas."""
    text = element.get(key, "")
    try:
        values = [parse_number(word) for word in re.split(r"[\s,]+", text.strip())]
    except ValueError:
        values = []
    if len(values) not in counts or not all(map(math.isfinite, values)):
        count = " or ".join(map(str, counts))
        raise InputError(f"{label}: {_shown(element)}: expected {count} numbers as {key}, found {named(text)}")
    return values


def _vector(element: Element, missing: float, label: str) -> list[float]:
    """Read a vector: value="x y z", one value for all three axes, or the attributes x, y and z."""
    if "value" in element.attrib:
        values = _numbers(element, "value", (1, 3), label)
        return values if len(values) == 3 else values * 3
    return [_numbers(element, axis, (1,), label)[0] if axis in element.attrib else missing for axis in "xyz"]


def _to_world(shape: Element, label: str) -> Float[np.ndarray, "4 4"]:
    """Return the transform of a shape. Its steps are applied in the order of the file."""
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
                    raise InputError(f"{label}: <rotate>: expected an axis x, y, z, found {axis.tolist()}")
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
        raise InputError(f"{label}: expected an invertible affine transform, found {world.tolist()}")
    return world
