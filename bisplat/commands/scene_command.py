"""``bisplat scene``."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from bisplat.commands.given_options import refuse_given
from bisplat.commands.output_file import Force, require_new
from scenes.files.errors import InputError, printable, shown
from scenes.files.extras import require_extra
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import say
from scenes.files.text_tables import print_rows, print_table

Triple = tuple[float, float, float]

OF_AN_IMPORT = (
    *("--material", "--default-material", "--unit", "--up", "--frequency"),
    *("--gateway", "--boresight", "--pattern", "--region-min", "--region-max"),
)

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
    material: tuple[str, ...] = (),
    default_material: str | None = None,
    unit: Literal["m", "cm", "mm", "in", "ft"] = "m",
    up: Literal["y", "z"] | None = None,
    frequency: float | None = None,
    gateway: Triple | None = None,
    boresight: Triple | None = None,
    pattern: Literal["iso", "dipole", "hw_dipole", "tr38901"] = "iso",
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
        material: import only: rules NODE=MATERIAL. NODE may hold * and ?. The first rule that matches a node counts.
        default_material: import only: material of the other nodes, if the file names none.
        unit: import only: unit of length of the mesh.
        up: import only: axis of the mesh that points up (default: y for glTF, z for others).
        frequency: import only: frequency in hertz (default: 915e6, the RFID and LoRa band).
        gateway: import only: position of the gateway, metres.
        boresight: import only: direction in which the gateway looks.
        pattern: import only: antenna pattern of the gateway's elements. iso cannot tell front from back.
        region_min: import only: lowest corner of the transmitter region, metres.
        region_max: import only: highest corner of the transmitter region, metres.
        json: print the description as JSON.
        view: edit the gateway, the transmitter region and the materials in the browser.
        port: with --view: port of the page. If it is taken, the next free port.
    """
    if view:
        refuse_given(["--json"], "none beside --view, which prints no description")
        require_extra("viewer", "the viewer")
    else:
        refuse_given(["--port"], "--view beside it, found none")
    from scenes.drawing.scene_drawing import describe_scene, draw_scene
    from scenes.importing.mesh_import import DEFAULT_FREQUENCY, import_scene, is_importable
    from scenes.scene.description import Gateway, Transmitter, facing
    from scenes.storage.scene_files import file_stem
    from scenes.storage.scene_yaml import load_scene, write_scene

    if is_importable(scene):
        needed = {
            "--output": output,
            "--gateway": gateway,
            "--boresight": boresight,
            "--region-min": region_min,
            "--region-max": region_max,
        }
        missing = [name for name, value in needed.items() if value is None]
        if output is None or gateway is None or boresight is None or region_min is None or region_max is None:
            raise InputError(f"{scene}: an import also needs {', '.join(missing)}")
        with new_folder(output, force) as unfinished:
            place, report = import_scene(
                scene,
                [_rule(text) for text in material],
                default_material,
                unit,
                up,
                DEFAULT_FREQUENCY if frequency is None else frequency,
                gateway=Gateway(gateway, facing(boresight), pattern=pattern),
                transmitter=Transmitter(region_min, region_max),
            )
            write_scene(place, unfinished)
            if not view:
                draw_scene(place, unfinished / "scene.png")
        for name, count in report.degenerate.items():
            say(f"{name}: dropped {count} triangles without area")
        for sentence in report.warnings:
            say(f"warning: {sentence}")
        if frequency is None:
            say(
                f"{scene}: assumed {DEFAULT_FREQUENCY / 1e6:g} MHz, since the file has no frequency and --frequency is "
                "not given. For another frequency, import the file again into a new folder, for example with "
                "--frequency 3.5e9"
            )
        drawing = output / "scene.png"
    else:
        refuse_given(OF_AN_IMPORT, f"a file to import, found the scene {scene}")
        if view:
            refuse_given(["--force"], "none beside --view, which asks before it replaces a scene")
        place = load_scene(scene)
        drawing = output or Path(f"{file_stem(place.name)}.png")
        if not view:
            require_new(drawing, force=force)
            draw_scene(place, drawing)
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


def _rule(text: str) -> tuple[str, str]:
    pattern, separator, material = text.rpartition("=")
    if not separator:
        raise InputError(f"--material: expected NODE=MATERIAL, found {shown(text)}")
    return pattern, material
