"""A scene as one YAML file beside its meshes."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any, TypeVar

from msgspec import UNSET, Struct, UnsetType
from msgspec.structs import asdict

from scenes.checks.validation import validate
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, cut, did_you_mean, shown
from scenes.files.folder_lock import locked
from scenes.files.input_file import beside
from scenes.files.schema import conform
from scenes.files.yaml_file import read_yaml
from scenes.importing.mesh_files import default_up, read_meshes
from scenes.importing.mesh_import import Y_UP_TO_Z_UP, is_importable
from scenes.places.bedroom import bedroom
from scenes.places.closet import closet
from scenes.places.conference import conference
from scenes.places.lab import lab
from scenes.places.office import office
from scenes.places.workshop import workshop
from scenes.scene.description import Gateway, Quaternion, Scene, SceneObject, Transmitter, Vector3
from scenes.scene.materials import RGB, RadioMaterial, material_names, p2040_material
from scenes.scene.shapes import union
from scenes.storage.scene_files import FilesInTheWay, digest, digest_of_file, mesh_names, ply_of, yaml_of

T = TypeVar("T")

BUILT_IN: dict[str, Callable[[], Scene]] = {
    place.__name__: place for place in (lab, conference, bedroom, office, closet, workshop)
}
"""The table of built-in places: a new one is a file in scenes/places and its name here."""

LONGEST_FREQUENCY = 50
"""Characters; the time of the regular expression grows with the square of a text's length."""
HERTZ = {"hz": 1.0, "khz": 1e3, "mhz": 1e6, "ghz": 1e9}


def load_scene(name_or_path: str | Path) -> Scene:
    """The built-in place of a name, or the scene that a .yaml file describes.

    Args:
        name_or_path: a built-in place's name, such as "lab", or the path of a scene YAML.

    Returns:
        The scene.

    Raises:
        InputError: neither of the two, or a file that ``read_scene`` refuses.

    >>> lab = load_scene("lab")
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
            f"{text}: has no gateway and no transmitter region; import it first, with bisplat scene {text} "
            "-o FOLDER --gateway X Y Z --boresight X Y Z --region-min X Y Z --region-max X Y Z"
        )
    if Path(text).suffix:
        known = ", ".join(BUILT_IN)
        raise InputError(f"{text}: not a scene description; expected a .yaml file or one of {known}")
    raise InputError(f'unknown scene "{text}"; {did_you_mean(text, BUILT_IN)} (or give a .yaml file)')


# --- reading -----------------------------------------------------------------------------------------------


class Region(Struct, forbid_unknown_fields=True):
    """The box that a transmitter moves in: lowest and highest corner, metres."""

    min: Vector3
    max: Vector3


class TransmitterEntry(Struct, forbid_unknown_fields=True):
    """``Transmitter`` in a file."""

    region: Region
    pattern: str = Transmitter.pattern
    polarization: str = Transmitter.polarization
    orientation: Quaternion = Transmitter.orientation


class MaterialOptions(Struct, forbid_unknown_fields=True, kw_only=True):
    """What any material may have in a file."""

    scattering_coefficient: float | UnsetType = UNSET
    xpd_coefficient: float | UnsetType = UNSET
    color: RGB | UnsetType = UNSET


class OwnMaterial(MaterialOptions, kw_only=True):
    """``RadioMaterial`` in a file."""

    relative_permittivity: float
    conductivity: float
    thickness: float


class P2040Material(MaterialOptions, kw_only=True):
    """A material of ITU-R P.2040 in a file."""

    p2040: str
    thickness: float | UnsetType = UNSET


class ObjectEntry(Struct, forbid_unknown_fields=True):
    """``SceneObject`` in a file."""

    name: str
    mesh: str
    material: str
    thickness: float | None = None


class SceneFile(Struct, forbid_unknown_fields=True):
    """``Scene`` in a file. What it has many of is checked one by one, so that messages have their names."""

    name: str
    frequency: float | str
    gateway: Gateway
    transmitter: TransmitterEntry
    objects: list[Any]
    materials: dict[Any, Any] | None = None
    further_gateways: dict[Any, Any] | None = None


def _conform(value: object, schema: type[T], place: str) -> T:
    return conform(value, schema, place, numbers_as_text=True)


def _frequency(value: float | str, source: str) -> float:
    """Hz, from a number or from a text such as "915 MHz"."""
    text = str(value) if len(str(value)) <= LONGEST_FREQUENCY else ""
    match = re.fullmatch(r"\s*([-+.\deE]+?)\s*([kKmMgG]?[hH][zZ])?\s*", text)
    try:
        frequency = float(match[1]) * HERTZ[(match[2] or "Hz").lower()] if match else 0.0
    except ValueError:
        frequency = 0.0
    if frequency <= 0:
        raise InputError(f'{source}: frequency must be in hertz or such as "915 MHz", found {shown(value)}')
    return frequency


def _material(name: str, value: object, frequency: float, source: str) -> RadioMaterial:
    """From ε_r and σ, or from a row of P.2040; the rest is optional in both."""
    place = f"{source}: materials.{cut(str(name))}"
    of_table = isinstance(value, dict) and "p2040" in value
    entry = _conform(value, P2040Material if of_table else OwnMaterial, place)
    given = {key: each for key, each in asdict(entry).items() if each is not UNSET}
    try:
        if isinstance(entry, P2040Material):
            given = vars(p2040_material(given.pop("p2040"), frequency)) | given
        return RadioMaterial(**(given | {"name": name}))
    except InputError as error:
        raise InputError(f"{place}: {error}") from None


def _p2040(name: str, own: Collection[str], frequency: float) -> RadioMaterial:
    if name not in material_names():
        raise InputError(f'unknown material "{name}"; {did_you_mean(name, [*own, *material_names()])}')
    return p2040_material(name, frequency)


def _object(value: object, index: int, file: Path, source: str) -> SceneObject:
    name = value.get("name") if isinstance(value, dict) else None
    place = f"{source}: objects[{index}]" + (f' ("{cut(str(name))}")' if name else "")
    entry = _conform(value, ObjectEntry, place)
    try:
        path = beside(file, entry.mesh)
        meshes = [mesh for _, mesh in read_meshes(path)]
    except InputError as error:
        raise InputError(f"{place}: mesh {error}") from None
    mesh = union(*meshes)
    if default_up(path) == "y":
        mesh.apply_transform(Y_UP_TO_Z_UP)
    return SceneObject(entry.name, mesh, entry.material, entry.thickness)


def read_scene(path: str | Path) -> Scene:
    """Read a scene YAML; docs/format.md lists its keys.

    Mesh paths are relative to the file. Meshes are in world metres and z up (glTF: metres and y up, as its
    specification says). An object's material is a key of ``materials`` or a name of ITU-R P.2040.

    Args:
        path: the YAML file.

    Returns:
        The scene.

    Raises:
        InputError: no such file, malformed YAML, a key that is unknown, missing or of the wrong type, an
            unknown material, a mesh that cannot be read, or a scene that ``validate`` refuses.
    """
    path = Path(path)
    source = str(path)
    file = _conform(read_yaml(path, "a scene"), SceneFile, source)
    frequency = _frequency(file.frequency, source)
    objects = tuple(_object(value, i, path, source) for i, value in enumerate(file.objects))

    known = {
        str(name): _material(str(name), value, frequency, source) for name, value in (file.materials or {}).items()
    }
    materials = {}
    for index, item in enumerate(objects):
        try:
            if item.material not in known:
                known[item.material] = _p2040(item.material, known, frequency)
            materials[item.material] = known[item.material]
        except InputError as error:
            raise InputError(f'{source}: objects[{index}] ("{item.name}"): {error}') from None

    gateways = {
        str(name): _conform(value, Gateway, f"{source}: further_gateways.{cut(str(name))}")
        for name, value in (file.further_gateways or {}).items()
    }
    moving = asdict(file.transmitter)
    region = moving.pop("region")
    transmitter = Transmitter(region.min, region.max, **moving)
    scene = Scene(file.name, frequency, file.gateway, transmitter, objects, materials, gateways)
    validate(scene, source)
    return scene


# --- writing -----------------------------------------------------------------------------------------------


def write_scene(scene: Scene, folder: str | Path, replaceable: Mapping[Path, str] | None = None) -> Path:
    """Write folder/scene.yaml and folder/meshes/<object>.ply; read back, the scene is equal.

    The same scene gives the same bytes. The YAML is written last and atomically, so a folder that has one is whole.
    Meshes that are there already with the same bytes are left as they are.

    Args:
        scene: the scene.
        folder: a folder without a scene.yaml, and without other meshes of the same names.
        replaceable: files that may be replaced all the same, as long as they have these digests (SHA-256).

    Returns:
        Path of the YAML.

    Raises:
        FilesInTheWay: an InputError that lists the files that would be replaced; nothing is written.
        InputError: ``validate`` refuses the scene, or another program is writing to the folder.

    >>> write_scene(load_scene("closet"), "closet").as_posix()
    'closet/scene.yaml'
    """
    folder = Path(folder)
    path = folder / "scene.yaml"
    validate(scene, str(path))
    meshes = {folder / name: item.mesh for name, item in zip(mesh_names(scene), scene.objects, strict=True)}
    with locked(folder):
        found = {file: sha256 for file in (path, *meshes) if (sha256 := digest_of_file(file)) is not None}
        kept = {file for file in found if file in meshes and found[file] == digest(ply_of(meshes[file]))}
        allowed = replaceable or {}
        in_the_way = {file: found[file] for file in found if file not in kept and found[file] != allowed.get(file)}
        if in_the_way:
            raise FilesInTheWay(in_the_way)
        for file, mesh in meshes.items():
            if file not in kept:
                write_atomically(file, ply_of(mesh))
        write_atomically(path, yaml_of(scene))
    return path
