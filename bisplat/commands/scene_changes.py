"""Options that change a scene for one command: ``--frequency`` and ``--array``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bisplat.commands.array_option import array_option
from scenes.files.plain_text import say

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
    """Apply the changes to a scene, and say what they are.

    Args:
        place: the scene as it is described.
        changes: what the user wants to be different.

    Returns:
        The changed copy, checked; the scene itself if nothing changes.

    Raises:
        InputError: a change is malformed, or gives a scene that is not valid.
    """
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
        found = place.gateway
        planar = f"{found.rows} × {found.columns} elements at {found.spacing:g} wavelengths"
        facts.append(planar if found.elements is None else found.array_in_words)
    validate(place, place.name)
    say(f"{place.name}: {', '.join(facts)}")
    for sentence in doubts(place):
        say(f"warning: {place.name}: {sentence}")
    return place
