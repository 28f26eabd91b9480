"""Options of ``bisplat scene`` that only an import has: their texts, and the table of --list."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scenes.files.errors import InputError, shown
from scenes.files.input_file import parse_number
from scenes.files.plain_text import print_rows, say
from scenes.importing.lengths import plain

if TYPE_CHECKING:  # slow imports that the help of the command line does not need
    from scenes.scene.materials import RadioMaterial


def read_rule(text: str) -> tuple[str, str]:
    """Read NAME=MATERIAL. The name may contain "=".

    Raises:
        InputError: there is no "=".
    """
    pattern, separator, material = text.rpartition("=")
    if not separator:
        raise InputError(f"--material: expected NAME=MATERIAL, found {shown(text)}")
    return pattern, material


def read_own_material(text: str) -> RadioMaterial:
    """Read NAME=PERMITTIVITY,CONDUCTIVITY,THICKNESS.

    Raises:
        InputError: the text has another form, or a value is out of its range.
    """
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
    """Print what ``parts_of`` returns.

    Args:
        listing: the parts of a file, and what speaks for its axis and unit.
    """
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
