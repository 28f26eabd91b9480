"""``bisplat scene``."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, arg

from bisplat.commands.import_options import print_list, read_own_material, read_rule, refuse_for_scenes
from bisplat.commands.output_file import Force, require_new
from scenes.files.errors import InputError, printable, reason
from scenes.files.extras import require_extra
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import say
from scenes.files.text_tables import print_rows, print_table

if TYPE_CHECKING:  # a slow import that the help of the command line does not need
    from scenes.scene.description import Scene

Triple = tuple[float, float, float]

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
    unit: Literal["m", "cm", "mm", "in", "ft"] | None = None,
    up: Literal["y", "z"] | None = None,
    shift: Triple | None = None,
    frequency: str | None = None,
    gateway: Triple | None = None,
    boresight: Triple | None = None,
    pattern: Literal["iso", "dipole", "hw_dipole", "tr38901"] | None = None,
    region_min: Triple | None = None,
    region_max: Triple | None = None,
    json: bool = False,
    view: bool = False,
    port: int = 8080,
    force: Force = False,
) -> None:
    """Draw and describe a scene, or import a mesh as a new scene.

    A mesh is a GLB, GLTF, OBJ, PLY, STL or OFF file, or an XML file of Mitsuba or Sionna RT.

    Args:
        scene: built-in name (such as lab), scene YAML, or a file to import; sionna:NAME imports a scene of Sionna RT.
        output: file of the drawing (default: NAME.png). For an import or --view: folder of the new scene.
        list_parts: import only: print the names in the file and the material that each would get, and write nothing.
        material: import only: rules NAME=MATERIAL. NAME is that of an object, node, material or mesh file in the file,
            and may hold * and ?. The first rule that matches an object counts.
        own_material: import only: NAME=PERMITTIVITY,CONDUCTIVITY,THICKNESS: a material for rules, or instead of one of
            this name. The permittivity is relative, the conductivity in S/m, the thickness in metres.
        default_material: import only: material of the other objects, if the file names none.
        unit: import only: unit of length of the mesh (default: m).
        up: import only: axis of the mesh that points up (default: y for glTF, z for others).
        shift: import only: what is added to x, y and z of the objects, the gateway and the region, metres. For meshes
            in map coordinates.
        frequency: import only: frequency in hertz, or such as "3.5 GHz" (default: 915e6, the RFID and LoRa band).
        gateway: import only: position of the gateway, metres.
        boresight: import only: direction in which the gateway looks.
        pattern: import only: antenna pattern of the gateway's elements. iso, the default, cannot tell front from back.
        region_min: import only: lowest corner of the transmitter region, metres.
        region_max: import only: highest corner of the transmitter region, metres.
        json: print the description as JSON.
        view: edit the gateway, the transmitter region and the materials in the browser.
        port: with --view: port of the page. If it is taken, the next free port.
    """
    if view:
        require_extra("viewer", "the viewer")
    from scenes.drawing.scene_drawing import describe_scene
    from scenes.importing.imported_file import is_importable
    from scenes.importing.mesh_import import DEFAULT_FREQUENCY, import_scene
    from scenes.importing.part_listing import list_parts as listed_parts
    from scenes.scene.description import Gateway, Transmitter, facing
    from scenes.scene.frequency import read_frequency
    from scenes.storage.scene_files import file_stem
    from scenes.storage.scene_yaml import load_scene, write_scene

    places = {"--gateway": gateway, "--boresight": boresight, "--region-min": region_min, "--region-max": region_max}
    if is_importable(scene):
        hertz = DEFAULT_FREQUENCY if frequency is None else read_frequency(frequency)
        rules = [read_rule(text) for text in material]
        own = {each.name: each for each in map(read_own_material, own_material)}
        if list_parts:
            refused = {"--output": output, "--pattern": pattern, "--view": view or None, **places}
            for option in [name for name, value in refused.items() if value is not None]:
                raise InputError(f"{option}: expected no such option with --list, which writes nothing, found it")
            shifted = shift or (0.0, 0.0, 0.0)
            listing = listed_parts(scene, rules, default_material, unit or "m", up, hertz, own, shifted)
            print(json_format.dumps(listing, indent=2)) if json else print_list(listing)
            return
        missing = [name for name, value in ({"--output": output} | places).items() if value is None]
        if output is None or gateway is None or boresight is None or region_min is None or region_max is None:
            raise InputError(
                f"{scene}: an import also needs {', '.join(missing)}; --list alone shows what the file contains"
            )
        with new_folder(output, force) as unfinished:
            place, report = import_scene(
                scene,
                rules,
                default_material,
                unit or "m",
                up,
                hertz,
                gateway=Gateway(gateway, facing(boresight), pattern=pattern or "iso"),
                transmitter=Transmitter(region_min, region_max),
                shift=shift or (0.0, 0.0, 0.0),
                own_materials=own,
            )
            write_scene(place, unfinished)
        for name, count in report.degenerate.items():
            say(f"{name}: dropped {count} triangles without area")
        for sentence in report.assumed:
            say(sentence)
        for sentence in report.warnings:
            say(f"warning: {sentence}")
        if frequency is None:
            say(
                f"{scene}: assumed {DEFAULT_FREQUENCY / 1e6:g} MHz, since the file has no frequency and --frequency is "
                "not given. For another frequency, import the file again into a new folder, for example with "
                "--frequency 3.5e9"
            )
        drawing = output / "scene.png"
        if not view and not _drawn(place, drawing):
            say(f"{output}: the scene itself is complete")
    else:
        given = {
            "--list": list_parts,
            "--material": material,
            "--own-material": own_material,
            "--default-material": default_material,
            "--unit": unit,
            "--up": up,
            "--shift": shift,
            "--frequency": frequency,
            "--pattern": pattern,
            **places,
        }
        refuse_for_scenes(scene, [name for name, value in given.items() if value])
        place = load_scene(scene)
        drawing = output or Path(f"{file_stem(place.name)}.png")
        if not view:
            require_new(drawing, force=force)
            _drawn(place, drawing)
    if view:
        from scenes.browser.scene_editor import Editor
        from scenes.browser.served_page import serve

        folder = Path(f"{file_stem(place.name)}-edited") if output is None or is_importable(scene) else output

        def open_tab(client) -> None:
            Editor(client, place, folder)

        serve(f"bisplat: {place.name}", port, open_tab)
        return
    description = describe_scene(place)
    if json:
        print(json_format.dumps(description, indent=2))
        return
    for what in ("objects", "materials"):
        rows = description.pop(what)
        print_rows(what, [{HEADINGS.get(key, key): value for key, value in row.items()} for row in rows])
    gateways: dict[str, dict] = description.pop("further_gateways")
    for label, further in gateways.items():
        description |= {f"{label} {name}": value for name, value in further.items()}
    for what in ("bounds", "gateway", "transmitter"):
        description |= {f"{what} {name}": value for name, value in description.pop(what).items()}
    region = description.pop("transmitter region")
    description |= {f"transmitter region {name}": value for name, value in region.items()}
    print_table("scene (metres, hertz)", {"": description})
    print(printable(f"drawing: {drawing}"))


def _drawn(place: Scene, drawing: Path) -> bool:
    """Draw a scene; if that fails, say why. A drawing never decides over what it shows."""
    from scenes.drawing.scene_drawing import draw_scene

    try:
        draw_scene(place, drawing)
    except Exception as error:  # noqa: BLE001 - whatever fails, the scene is not lost
        say(f"{drawing}: expected to draw the scene, found that it cannot be drawn ({reason(error)})")
        return False
    return True
