"""Options that change a scene for one command: ``--frequency`` and ``--array``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenes.files.errors import InputError, ParameterError, shown
from scenes.files.plain_text import say


def array_option(text: str) -> dict[str, Any]:
    """Read the option ``--array``."""
    from scenes.scene.antennas import as_positions, fault_of, read_array
    from simulate.positions.positions import read_points

    path = Path(text)
    if path.suffix.lower() != ".csv":
        if path.is_file():
            expected = "a file of element positions whose name ends in .csv, with the header x,y,z, in metres"
            raise ParameterError("array", f"expected {expected}, found {shown(text)}")
        try:
            rows, columns, spacing = read_array(text)
        except ParameterError as error:
            or_file = ", or a CSV file of element positions, found"
            raise ParameterError("array", error.message.replace(", found", or_file, 1)) from None
        return {"rows": rows, "columns": columns} | ({} if spacing is None else {"spacing": spacing})
    elements = as_positions("array", read_points(path))
    fault = fault_of(elements)
    if fault is not None:
        raise InputError(f"{path}: {fault}")
    return {"elements": elements}


if TYPE_CHECKING:  # its import takes long, and the help does not need it
    from scenes.scene.description import Scene


@dataclass(frozen=True)
class SceneChanges:
    """What is different from the scene as it is described.

    Attributes:
        frequency: carrier frequency instead of the scene's: hertz, or such as "2.4 GHz". Materials of ITU-R P.2040
            follow.
        array: array instead of that of every gateway: ROWSxCOLUMNS, or ROWSxCOLUMNS@SPACING in wavelengths, or a CSV
            file with columns x,y,z of element positions, metres, gateway frame.
    """

    frequency: str | None = None
    array: str | None = None


def changed_scene(place: Scene, changes: SceneChanges) -> Scene:
    """Apply the changes to a scene, and say what they are."""
    from scenes.checks.validation import doubts, validate

    if changes == SceneChanges():
        return place
    facts = []
    if changes.frequency is not None:
        before, place = place.frequency, place.at_frequency(changes.frequency)
        facts.append(f"{place.frequency / 1e6:g} MHz instead of {before / 1e6:g} MHz")
    if changes.array is not None:
        wanted = array_option(changes.array)
        place = place.with_elements(**wanted) if "elements" in wanted else place.with_array(**wanted)
        facts.append(place.gateway.array_in_words)
    validate(place, place.name)
    say(f"{place.name}: {', '.join(facts)}")
    for sentence in doubts(place):
        say(f"warning: {place.name}: {sentence}")
    return place
