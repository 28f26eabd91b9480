"""A scene as one YAML file beside its meshes."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict
from pathlib import Path

from scenes.checks.validation import validate
from scenes.files.atomic import write_atomically
from scenes.files.claimed_folder import FilesInTheWay, claimed, digest, digest_of_file
from scenes.files.errors import SHOWN, InputError, did_you_mean, printable, shown
from scenes.files.input_file import beside
from scenes.files.yaml_file import read_yaml
from scenes.files.yaml_section import Section
from scenes.importing.mesh_files import default_up, read_meshes
from scenes.importing.mesh_import import Y_UP_TO_Z_UP, is_importable
from scenes.places.bedroom import bedroom
from scenes.places.closet import closet
from scenes.places.conference import conference
from scenes.places.lab import lab
from scenes.places.office import office
from scenes.places.workshop import workshop
from scenes.scene.description import Gateway, Scene, SceneObject, Transmitter
from scenes.scene.materials import RadioMaterial, material_names, p2040_material
from scenes.scene.shapes import union
from scenes.storage.scene_files import mesh_names, ply_of, yaml_of

BUILT_IN: dict[str, Callable[[], Scene]] = {
    "lab": lab,
    "conference": conference,
    "bedroom": bedroom,
    "office": office,
    "closet": closet,
    "workshop": workshop,
}
LONGEST_FREQUENCY = 50
"""Characters; the time of the regular expression grows with the square of a text's length."""
HERTZ = {"hz": 1.0, "khz": 1e3, "mhz": 1e6, "ghz": 1e9}


def load_scene(name_or_path: str | Path) -> Scene:
    """The built-in place of a name, or the scene that a .yaml file describes.

    Args:
        name_or_path: "lab", "conference", "bedroom", "office", "closet", "workshop", or the path of a scene YAML.

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


def _frequency(section: Section) -> float:
    """Hz, from a number or from a text such as "915 MHz"."""
    value = section.values["frequency"]
    text = str(value) if len(str(value)) <= LONGEST_FREQUENCY else ""
    match = re.fullmatch(r"\s*([-+.\deE]+?)\s*([kKmMgG]?[hH][zZ])?\s*", text)
    try:
        frequency = float(match[1]) * HERTZ[(match[2] or "Hz").lower()] if match else 0.0
    except ValueError:
        frequency = 0.0
    if frequency <= 0:
        raise section.error(f'frequency must be in hertz or such as "915 MHz", found {shown(value)}')
    return frequency


def _gateway(value: object, label: str) -> Gateway:
    optional = ("rows", "columns", "spacing", "pattern", "polarization")
    s = Section(value, label, ("position", "orientation"), optional)
    return Gateway(
        position=s.numbers("position", 3),
        orientation=s.numbers("orientation", 4),
        **s.optional(rows=s.count, columns=s.count, spacing=s.number, pattern=s.text, polarization=s.text),
    )


def _transmitter(value: object, source: str) -> Transmitter:
    s = Section(value, f"{source}: transmitter", ("region",), ("pattern", "polarization", "orientation"))
    region = Section(s.values["region"], f"{source}: transmitter.region", ("min", "max"))
    return Transmitter(
        region_min=region.numbers("min", 3),
        region_max=region.numbers("max", 3),
        **s.optional(pattern=s.text, polarization=s.text, orientation=lambda key: s.numbers(key, 4)),
    )


def _material(name: str, value: object, frequency: float, source: str) -> RadioMaterial:
    """From ε_r and σ, or from a row of P.2040; the rest is optional in both."""
    label = f"{source}: materials.{_in_label(name)}"
    optional = ("thickness", "scattering_coefficient", "xpd_coefficient", "color")
    if isinstance(value, dict) and "p2040" in value:
        s = Section(value, label, ("p2040",), optional)
    else:
        s = Section(value, label, ("relative_permittivity", "conductivity", "thickness"), optional[1:])
    given = s.optional(
        relative_permittivity=s.number,
        conductivity=s.number,
        thickness=s.number,
        scattering_coefficient=s.number,
        xpd_coefficient=s.number,
        color=lambda key: s.numbers(key, 3),
    )
    try:
        if "p2040" in s.values:
            given = asdict(p2040_material(s.text("p2040"), frequency)) | given
        return RadioMaterial(**(given | {"name": name}))
    except InputError as error:
        raise InputError(f"{label}: {error}") from None


def _p2040(name: str, own: Collection[str], frequency: float) -> RadioMaterial:
    if name not in material_names():
        raise InputError(f'unknown material "{name}"; {did_you_mean(name, [*own, *material_names()])}')
    return p2040_material(name, frequency)


def _in_label(name: object) -> str:
    """A name in the file, as it stands at the start of messages."""
    return printable(str(name)[:SHOWN])


def _object(value: object, index: int, file: Path, source: str) -> SceneObject:
    name = value.get("name") if isinstance(value, dict) else None
    label = f"{source}: objects[{index}]" + (f' ("{_in_label(name)}")' if name else "")
    s = Section(value, label, ("name", "mesh", "material"), ("thickness",))
    mesh_file = s.text("mesh")
    try:
        path = beside(file, mesh_file)
        meshes = [mesh for _, mesh in read_meshes(path)]
    except InputError as error:
        raise s.error(f"mesh {error}") from None
    mesh = union(*meshes)
    if default_up(path) == "y":
        mesh.apply_transform(Y_UP_TO_Z_UP)
    return SceneObject(s.text("name"), mesh, s.text("material"), **s.optional(thickness=s.number))


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
    values, source = read_yaml(path, "a scene"), str(path)
    s = Section(
        values, source, ("name", "frequency", "gateway", "transmitter", "objects"), ("materials", "further_gateways")
    )
    frequency = _frequency(s)
    own = s.values.get("materials") or {}
    if not isinstance(own, dict):
        raise s.error(f"materials must be a mapping from names to values, found {shown(own)}")
    listed = s.values["objects"]
    if not isinstance(listed, list):
        raise s.error(f"objects must be a list, found {shown(listed)}")
    objects = tuple(_object(value, i, path, source) for i, value in enumerate(listed))

    known = {str(name): _material(str(name), value, frequency, source) for name, value in own.items()}
    materials = {}
    for index, item in enumerate(objects):
        try:
            if item.material not in known:
                known[item.material] = _p2040(item.material, known, frequency)
            materials[item.material] = known[item.material]
        except InputError as error:
            raise InputError(f'{source}: objects[{index}] ("{item.name}"): {error}') from None

    gateway = _gateway(s.values["gateway"], f"{source}: gateway")
    further = s.values.get("further_gateways") or {}
    if not isinstance(further, dict):
        raise s.error(f"further_gateways must be a mapping from names to gateways, found {shown(further)}")
    gateways = {
        str(name): _gateway(value, f"{source}: further_gateways.{_in_label(name)}") for name, value in further.items()
    }
    transmitter = _transmitter(s.values["transmitter"], source)
    scene = Scene(s.text("name"), frequency, gateway, transmitter, objects, materials, gateways)
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
    with claimed(folder):
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
