"""``bisplat scene``."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, arg

from bisplat.commands.common_options import Force, require_new
from bisplat.commands.idle_options import given_options, refuse_idle
from bisplat.commands.scene_changes import SceneChanges, array_option, changed_scene
from scenes.files.errors import InputError, printable, shown
from scenes.files.input_file import parse_number
from scenes.files.lengths import plain
from scenes.files.optional_packages import require_extra
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import print_rows, print_table, say

if TYPE_CHECKING:  # a slow import that the help of the command line does not need
    from scenes.scene.description import Scene
    from scenes.scene.materials import RadioMaterial

Triple = tuple[float, float, float]

PLACES = ("gateway", "boresight", "region_min", "region_max")
IDLE_IN_A_LIST = ("walls", "flatten", "no_flatten", "pattern", *PLACES)
OF_AN_IMPORT = ("material", "own_material", "default_material", "unit", "up", "shift", *IDLE_IN_A_LIST)
"""Options that a scene has no use for."""

HEADINGS = {
    "size": "size (m)",
    "relative_permittivity": "relative permittivity (–)",
    "conductivity": "conductivity (S/m)",
    "thickness": "thickness (m)",
}
"""Headings of the printed tables, by the keys of the description."""


def scene(
    scene: Positional[str],
    output: Annotated[Path | None, arg(aliases=["-o"])] = None,
    list_parts: Annotated[bool, arg(name="list")] = False,
    material: tuple[str, ...] = (),
    own_material: tuple[str, ...] = (),
    default_material: str | None = None,
    unit: Literal["m", "cm", "mm", "in", "ft"] = "m",
    up: Literal["y", "z"] | None = None,
    shift: Triple = (0.0, 0.0, 0.0),
    walls: Literal["as-sheets", "as-drawn"] = "as-sheets",
    flatten: float | None = None,
    no_flatten: bool = False,
    frequency: str | None = None,
    array: str | None = None,
    gateway: Triple | None = None,
    boresight: Triple | None = None,
    pattern: Literal["iso", "dipole", "hw_dipole", "tr38901"] = "iso",
    region_min: Triple | None = None,
    region_max: Triple | None = None,
    json: bool = False,
    accuracy: bool = False,
    force: Force = False,
) -> None:
    """Draw and describe a scene, or import a mesh as a new scene.

    A mesh is a GLB, GLTF, OBJ, PLY, STL or OFF file, or an XML file of Mitsuba or Sionna RT.

    Args:
        scene: built-in name (such as lab), scene YAML, or a file to import; sionna:NAME imports a scene of Sionna RT.
        output: file of the drawing (default: NAME.png). For an import: folder of the new scene.
        list_parts: import only: print the names in the file and the material that each would get, and write nothing.
        material: import only: rules NAME=MATERIAL. NAME is that of an object, node, material or mesh file in the file,
            and may hold * and ?. The first rule that matches an object counts.
        own_material: import only: NAME=PERMITTIVITY,CONDUCTIVITY,THICKNESS: a material for rules, or instead of one of
            this name. The permittivity is relative, the conductivity in S/m, the thickness in metres.
        default_material: import only: material of the other objects, if the file names none.
        unit: import only: unit of length of the mesh.
        up: import only: axis of the mesh that points up (default: y for glTF, z for others).
        shift: import only: what is added to x, y and z of the objects, the gateway and the region, metres. For meshes
            in map coordinates.
        walls: import only: whether walls and boards that are drawn with both faces become one sheet each, or keep both,
            of which each is a slab.
        flatten: import only: metres within which scanned and finely meshed surfaces are flat, and become planes
            (default: a sixteenth of the wavelength, at most 0.05).
        no_flatten: import only: keep such surfaces as they are.
        frequency: carrier frequency: hertz, or such as "3.5 GHz" (default: the scene's; for an import 915e6, the RFID
            and LoRa band). Materials of ITU-R P.2040 follow.
        array: array of every gateway: ROWSxCOLUMNS, or ROWSxCOLUMNS@SPACING in wavelengths (default: the scene's; for
            an import 4x4@0.5).
        gateway: import only: position of the gateway, metres.
        boresight: import only: direction in which the gateway looks.
        pattern: import only: antenna pattern of the gateway's elements. iso cannot tell front from back.
        region_min: import only: lowest corner of the transmitter region, metres.
        region_max: import only: highest corner of the transmitter region, metres.
        json: print the description as JSON.
        accuracy: also trace the scene, and say how near rays are expected to come to full wave: about a minute.
    """
    given = given_options(globals()["scene"], locals())  # here, scene is the argument
    if accuracy:
        require_extra("rays", "ray tracing")
    from scenes.drawing.scene_drawing import draw_scene
    from scenes.importing.imported_file import is_importable
    from scenes.importing.imported_objects import parts_of
    from scenes.importing.mesh_import import DEFAULT_FREQUENCY, import_scene
    from scenes.scene.antennas import Gateway, Transmitter
    from scenes.scene.frequency import read_frequency
    from scenes.scene.orientation import facing
    from scenes.storage.scene_writing import file_stem, write_scene
    from scenes.storage.scene_yaml import load_scene

    importable = is_importable(scene)
    if importable:
        options: dict[str, Any] = {
            "materials": [read_rule(text) for text in material],
            "default_material": default_material,
            "own_materials": {each.name: each for each in map(read_own_material, own_material)},
            "unit": unit,
            "up": up,
            "frequency": DEFAULT_FREQUENCY if frequency is None else read_frequency(frequency),
            "shift": shift,
        }
        if list_parts:
            idle = ["output", "array", "accuracy", "force", *IDLE_IN_A_LIST]
            refuse_idle(given, idle, "beside --list")
            listing = parts_of(scene, **options)
            print(json_format.dumps(listing, indent=2)) if json else print_list(listing)
            return
        if output is None or gateway is None or boresight is None or region_min is None or region_max is None:
            missing = [f"--{name.replace('_', '-')}" for name in ("output", *PLACES) if name not in given]
            raise InputError(
                f"{scene}: an import also needs {', '.join(missing)}; --list alone shows what the file contains"
            )
        if no_flatten and flatten is not None:
            raise InputError("--no-flatten: expected it without --flatten, found both")
        own_array = array_option(array or "4x4")
        with new_folder(output, force) as unfinished:
            place, report = import_scene(
                scene,
                **options,
                walls=walls,
                flatten=0 if no_flatten else flatten,
                gateway=Gateway(gateway, facing(boresight), pattern=pattern, **own_array),
                transmitter=Transmitter(region_min, region_max),
            )
            write_scene(place, unfinished)
            record = {name: options[name] for name in ("unit", "frequency", "shift")}
            record = {"file": scene, "up": report.up, **record, "walls": walls, "flatten": 0 if no_flatten else flatten}
            (unfinished / "import.json").write_text(json_format.dumps(record, indent=2) + "\n")
        for name, count in report.degenerate.items():
            say(f"{name}: dropped {count} triangles without area")
        for sentence in report.assumed:
            say(sentence)
        for sentence in report.warnings:
            say(f"warning: {sentence}")
        if frequency is None:
            say(
                f"{scene}: assumed {DEFAULT_FREQUENCY / 1e6:g} MHz, since the file has no frequency and --frequency is "
                f"not given. For another one, change it in {output / 'scene.yaml'}; the materials follow"
            )
        if report.flattened is not None:
            _failure_to_draw(report.flattened, output / "flattened.png")
        drawing = output / "scene.png"
        failure = _failure_to_draw(place, drawing)
        if failure:
            say(f"warning: {failure}; the scene itself is complete")
    else:
        loaded = load_scene(scene)  # first, since it names the kinds of files that can be imported
        where = f"for the scene {scene}, which is no file to import"
        refuse_idle(["list"] if list_parts else given, ["list", *OF_AN_IMPORT], where)
        place = changed_scene(loaded, SceneChanges(frequency, array))
        drawing = output or Path(f"{file_stem(place.name)}.png")
        require_new(drawing, force=force)
        draw_scene(place, drawing)
        failure = None
    _describe(place, json, None if failure else drawing)
    if accuracy:
        from simulate.rays.expected_correlation import expectation

        for seen in place.by_gateway().values():
            say(f"{seen.name}: {expectation(seen)}")


def _failure_to_draw(place: Scene, drawing: Path) -> str | None:
    """Draw an imported scene, and return why it cannot be drawn. The scene is kept all the same."""
    from scenes.drawing.scene_drawing import draw_scene

    try:
        draw_scene(place, drawing)
    except InputError as error:
        return str(error)
    except OSError as error:
        return f"{drawing}: {error.strerror}"
    return None


def _describe(place: Scene, json: bool, drawing: Path | None) -> None:
    from scenes.drawing.scene_drawing import describe_scene

    description = describe_scene(place)
    if json:
        print(json_format.dumps(description, indent=2))
        return
    for what in ("objects", "materials"):
        rows = description.pop(what)
        print_rows(what, [{HEADINGS.get(key, key): value for key, value in row.items()} for row in rows])
    nested: dict[str, dict] = {what: description.pop(what) for what in ("bounds", "gateway", "transmitter")}
    nested |= {**description.pop("further_gateways"), "transmitter region": nested["transmitter"].pop("region")}
    description |= {f"{what} {name}": value for what, each in nested.items() for name, value in each.items()}
    print_table("scene (metres, hertz)", {"": description})
    if drawing is not None:
        print(printable(f"drawing: {drawing}"))


def read_rule(text: str) -> tuple[str, str]:
    """Read NAME=MATERIAL. The name may contain "="."""
    pattern, separator, material = text.rpartition("=")
    if not separator:
        raise InputError(f"--material: expected NAME=MATERIAL, found {shown(text)}")
    return pattern, material


def read_own_material(text: str) -> RadioMaterial:
    """Read NAME=PERMITTIVITY,CONDUCTIVITY,THICKNESS."""
    from scenes.scene.materials import RadioMaterial

    name, _, values = text.rpartition("=")
    try:
        permittivity, conductivity, thickness = map(parse_number, values.split(","))
    except ValueError:
        name = ""
    if not name or "=" in name:
        raise InputError(
            "--own-material: expected NAME=PERMITTIVITY,CONDUCTIVITY,THICKNESS, such as wet=15,2.2,0.5 for a relative "
            f"permittivity of 15, 2.2 S/m and 0.5 m, found {shown(text)}"
        )
    try:
        return RadioMaterial(name, permittivity, conductivity, thickness)
    except InputError as error:
        raise InputError(f"--own-material: {error}") from None


def print_list(listing: dict[str, Any]) -> None:
    rows = [
        {
            "object": part["name"],
            "node": part["node"],
            "material in the file": part["material in the file"],
            "mesh file": part["mesh file"],
            "size (m)": " ".join(map(plain, part["size"])),
            "area (m²)": part["area"],
            "triangles": part["triangles"],
            "becomes": part["material"] or "–",
            "by": part["by"] or "nothing: add --material NAME=MATERIAL or --default-material MATERIAL",
        }
        for part in listing["parts"]
    ]
    for optional in ("node", "material in the file", "mesh file"):
        if all(row[optional] in ("", row["object"]) for row in rows):
            rows = [{key: value for key, value in row.items() if key != optional} for row in rows]
    print_rows("objects", rows)
    rows = [
        {"unit of the file": unit} | {name: " ".join(map(plain, corner)) for name, corner in bounds.items()}
        for unit, bounds in listing["bounds"].items()
    ]
    print_rows("size, lowest and highest corner (m)", rows)
    say(f"{listing['file']}: up axis {listing['up']}, unit {listing['unit']}, {listing['frequency'] / 1e6:g} MHz")
    if listing["evidence"]:
        reasons = "; ".join(listing["evidence"]["reasons"])
        say(f"{listing['file']}: evidence of {listing['evidence']['axis']} up: {reasons}")
    for sentence in listing["warnings"]:
        say(f"warning: {listing['file']}: {sentence}")
