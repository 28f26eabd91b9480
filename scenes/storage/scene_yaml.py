"""Read a scene: a built-in one by its name, or a YAML file and its meshes."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from msgspec import Struct
from msgspec.structs import asdict

from scenes.checks.validation import doubts, validate
from scenes.files.errors import InputError, ParameterError, cut, did_you_mean, named, shown
from scenes.files.input_file import beside
from scenes.files.json_yaml_xml import read_yaml
from scenes.files.long_work import doing
from scenes.files.plain_text import say
from scenes.files.schema import conform
from scenes.importing.imported_file import is_importable
from scenes.importing.mesh_files import read_mesh_file
from scenes.importing.up_axis import Y_UP_TO_Z_UP
from scenes.places.built_in import BUILT_IN
from scenes.scene.antennas import BOTH_ARRAYS, Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.frequency import read_frequency
from scenes.scene.materials import P2040, RadioMaterial, p2040_material
from scenes.scene.orientation import Quaternion, Vector3
from scenes.scene.shapes import union

T = TypeVar("T")

SECONDS = 1e-3  # What it takes to read and check an object of a few triangles


def load_scene(name_or_path: str | Path) -> Scene:
    """Load a built-in scene, or a scene from a YAML file.

    The built-in scenes are "lab", "conference", "bedroom", "office", "closet" and "workshop", all at 915 MHz. The
    documentation, File formats, lists the keys of a scene YAML. Meshes of other programs have no gateway and no
    transmitter region: convert them with ``import_scene``.

    Args:
        name_or_path: name of a built-in scene, or path of a .yaml or .yml file.

    Returns:
        The scene, with its values checked.

    Raises:
        InputError: the name is unknown; the file or one of its meshes is missing or malformed; a key is unknown,
            missing or has a value of the wrong type or outside its range; a material is unknown; or an antenna is
            inside an object.

    Example:
        >>> import bisplat
        >>> lab = bisplat.load_scene("lab")
        >>> lab.gateway.position, len(lab.objects) > 20
        ((7.2, 3.0, 1.4), True)
    """
    text = str(name_or_path)
    if text in BUILT_IN:
        return BUILT_IN[text]()
    if text.endswith((".yaml", ".yml")):
        return read_scene(Path(text))
    if is_importable(text):
        raise InputError(
            f"{text}: expected a scene with a gateway and a transmitter region, found a file without them; import "
            f"it with bisplat scene {shlex.quote(text)} -o FOLDER --gateway X Y Z --boresight X Y Z --region-min X Y Z "
            "--region-max X Y Z --default-material MATERIAL"
        )
    if Path(text).suffix:
        known = ", ".join(BUILT_IN)
        kinds = "a .yaml file, a file to import (GLB, GLTF, OBJ, PLY, STL, OFF, XML)"
        raise InputError(f"{cut(text)}: expected {kinds} or one of {known}, found another kind of file")
    raise InputError(f"unknown scene {named(text)}; {did_you_mean(text, BUILT_IN)} (or give a .yaml file)")


class Region(Struct, forbid_unknown_fields=True):
    """The transmitter region in a file: lowest and highest corner, metres."""

    min: Vector3
    max: Vector3


class TransmitterEntry(Struct, forbid_unknown_fields=True):
    region: Region
    pattern: str = Transmitter.pattern
    polarization: str = Transmitter.polarization
    orientation: Quaternion = Transmitter.orientation


class ObjectEntry(Struct, forbid_unknown_fields=True):
    name: str
    mesh: str
    material: str
    thickness: float | None = None


class SceneFile(Struct, forbid_unknown_fields=True):
    """``Scene`` in a file. Objects, materials and gateways are checked one by one, so that messages can name them."""

    name: str
    frequency: float | str
    gateway: Gateway
    transmitter: TransmitterEntry
    objects: list[Any]
    materials: dict[Any, Any] | None = None
    further_gateways: dict[Any, Any] | None = None


def _conform(value: object, schema: type[T], place: str) -> T:
    return conform(value, schema, place, numbers_as_text=True)


def _material(name: str, value: object, frequency: float, source: str) -> RadioMaterial:
    """Read a material: ε_r and σ, or a name of P.2040. All other keys are optional."""
    place = f"{source}: materials.{cut(name)}"
    given = dict(_conform(value, dict[str, Any], place))
    of_table = "p2040" in given
    for key in ("name", "frequency", "relative_permittivity", "conductivity") if of_table else ("name",):
        if key in given:
            beside = " beside p2040" if of_table else ""
            raise InputError(f"{place}: expected no key {key}{beside}, found {shown(given[key])}")
    try:
        if "frequency" in given:
            given["frequency"] = read_frequency(given["frequency"])
        if of_table:
            given = vars(p2040_material(given.pop("p2040"), frequency)) | given
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
    return _conform(given | {"name": name}, RadioMaterial, place)


def _object(value: object, index: int, file: Path, source: str) -> SceneObject:
    name = value.get("name") if isinstance(value, dict) else None
    place = f"{source}: objects[{index}]" + (f" ({named(name)})" if name else "")
    entry = _conform(value, ObjectEntry, place)
    try:
        path = beside(file, entry.mesh)
        content = read_mesh_file(path)
    except InputError as error:
        raise InputError(f"{place}: mesh: {error}") from None
    for sentence in content.left_out:
        say(f"warning: {place}: mesh: {sentence}")
    mesh = union(*(part.mesh for part in content.parts))
    if content.up == "y":
        mesh.apply_transform(Y_UP_TO_Z_UP)
    return SceneObject(entry.name, mesh, entry.material, entry.thickness)


def _refuse_two_arrays(gateway: Mapping[str, Any], place: str) -> None:
    """Refuse a gateway in a file that has the positions of its elements and a key of a planar array, too."""
    planar = [key for key in ("rows", "columns", "spacing") if key in gateway]
    if gateway.get("elements") is not None and planar:
        raise InputError(f"{place}.elements: {BOTH_ARRAYS[:-4]}elements and {planar[0]}")


def read_scene(path: str | Path) -> Scene:
    """Read a scene YAML. The documentation, File formats, lists its keys.

    Mesh paths are relative to the file. Meshes are in metres, in the world frame, with z up. The exception is glTF,
    which has y up according to its specification. An object's material is a key of ``materials`` or a name of ITU-R
    P.2040.
    """
    path = Path(path)
    source = str(path)
    content = read_yaml(path, "a scene")
    file = _conform(content, SceneFile, source)
    _refuse_two_arrays(content["gateway"], f"{source}: gateway")
    try:
        frequency = read_frequency(file.frequency)
    except ParameterError as error:
        raise InputError(f"{source}: {error}") from None
    doing(f"{source}: reading {len(file.objects):,} objects", len(file.objects) * SECONDS)
    objects = tuple(_object(value, i, path, source) for i, value in enumerate(file.objects))

    known = {
        str(name): _material(str(name), value, frequency, source) for name, value in (file.materials or {}).items()
    }
    for index, item in enumerate(objects):
        try:
            if item.material not in (*known, *P2040):
                raise InputError(
                    f"unknown material {named(item.material)}; {did_you_mean(item.material, [*known, *P2040])}"
                )
            if item.material not in known:
                known[item.material] = p2040_material(item.material, frequency)
        except InputError as error:
            raise InputError(f"{source}: objects[{index}] ({named(item.name)}): {error}") from None
    used = {item.material for item in objects}
    # In the order of the file, so that a scene that is read and written again has the same bytes.
    materials = {name: material for name, material in known.items() if name in used}

    gateways = {}
    for name, value in (file.further_gateways or {}).items():
        place = f"{source}: further_gateways.{cut(str(name))}"
        gateways[str(name)] = _conform(value, Gateway, place)
        _refuse_two_arrays(value, place)
    moving = asdict(file.transmitter)
    region = moving.pop("region")
    transmitter = Transmitter(region.min, region.max, **moving)
    scene = Scene(file.name, frequency, file.gateway, transmitter, objects, materials, gateways)
    doing(f"{source}: checking {scene.triangles:,} triangles", len(objects) * SECONDS + scene.triangles * 3e-6)
    validate(scene, source)
    doing("")
    for sentence in doubts(scene):
        say(f"warning: {source}: {sentence}")
    return scene
