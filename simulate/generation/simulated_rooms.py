"""Datasets of spectra in many random rooms, to train in some of them and to test in others."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args

from scenes.drawing.scene_drawing import draw_plans
from scenes.files.atomic import write_atomically
from scenes.files.errors import (
    ParameterError,
    require_flag,
    require_instance,
    require_path,
    require_seed,
    require_whole,
    require_word,
    shown,
)
from scenes.files.json_yaml_xml import plain_values
from scenes.files.output_folder import own_folder
from scenes.files.plain_text import say
from scenes.places.random_room import MOST_PIECES, random_room
from scenes.scene.description import Scene
from simulate.dataset.dataset_kinds import ROOMS, Outline, Setting
from simulate.dataset.rooms_folder import Rooms, read_room_facts, read_rooms
from simulate.generation.simulation import simulate

MOST_ROOMS = 10_000  # Largest number of rooms in a folder

GALLERY = "rooms.png"  # The picture of all floor plans


def simulate_rooms(
    output: Path | str,
    n: int = 10,
    setting: Setting = "layout",
    *,
    seed: int = 0,
    spectra: int = 200,
    pieces: Sequence[int] = (1, 12),
    shape: Outline = "rectangle",
    large: bool = False,
    **options: Any,
) -> Rooms:
    """Simulate a dataset of spectra in each of several random rooms.

    A room has a gateway with a 4 × 4 array at 915 MHz, and short dipoles (``scenes.places.random_room``). The three
    settings are those in which GRaF [yang2026] tests what it learned in other rooms. The same call again finishes an
    interrupted one. The folder has a dataset folder for each room (``room-000``, …, with the room in ``scene/``),
    rooms.json, and rooms.png with all floor plans.

    Args:
        output: folder of the rooms: a new one, an empty one, or one that the same call began.
        n: number of rooms.
        setting: what differs from room to room. "same": only the transmitter's positions. "furniture": also which
            pieces of furniture there are, and where. "layout": everything.
        seed: room i has the seed ``seed + i``, in the settings "same" and "furniture" its positions or its furniture.
        spectra: number of spectra in each room.
        pieces: least and largest number of pieces of furniture, 0 to 12.
        shape: "rectangle", "l" (L-shaped) or "both".
        large: whether rooms have four to eight metres instead of two to four.
        **options: those of ``simulate``, such as ``propagation`` and ``workers``.

    Returns:
        The rooms.

    Raises:
        InputError: the folder holds something else, or rooms of another call.
        ParameterError: a parameter is outside its range.

    Example:
        >>> import bisplat
        >>> coarse = bisplat.Propagation(max_depth=0, diffraction=False)
        >>> rooms = bisplat.simulate_rooms("data/rooms", 2, "furniture", spectra=5, propagation=coarse)
        >>> len(rooms), rooms.names, [len(dataset) for dataset in rooms]
        (2, ('room-000', 'room-001'), [5, 5])
    """
    require_path(output=output)
    require_whole(1, MOST_ROOMS, n=n)
    require_word(get_args(Setting), setting=setting)
    require_seed(seed=seed)
    require_whole(1, 10**6, spectra=spectra)
    require_word(get_args(Outline), shape=shape)
    require_flag(large=large)
    require_instance(list, tuple, pieces=pieces)
    if len(pieces) != 2:
        raise ParameterError("pieces", f"expected the least and the largest number, found {shown(pieces)}")
    for number in pieces:
        require_whole(0, MOST_PIECES, pieces=number)
    least, largest = pieces
    if least > largest:
        raise ParameterError("pieces", f"expected the least number first, found {least} and {largest}")
    folder = Path(output)
    names = [f"room-{number:03d}" for number in range(n)]
    facts = {
        "setting": setting,
        "seed": seed,
        "spectra": spectra,
        "pieces": [least, largest],
        "shape": shape,
        "large": large,
        "rooms": names,
    }
    with own_folder(folder, "folder of rooms", ROOMS, facts, read_room_facts):
        write_atomically(folder / ROOMS, (json.dumps(plain_values(facts), indent=2) + "\n").encode())
        scenes = {name: _room(number, facts) for number, name in enumerate(names)}
        draw_plans(scenes, folder / GALLERY)
        for number, (name, scene) in enumerate(scenes.items()):
            say(f"{name}, {number + 1} of {n}: {scene.name}, {len(scene.objects)} objects")
            simulate(scene, folder / name, spectra, seed=seed + number, **options)
    return read_rooms(folder)


def _room(number: int, facts: dict[str, Any]) -> Scene:
    first, shape, layout = facts["seed"], facts["shape"], facts["setting"] == "layout"
    outline: Any = ("rectangle", "l")[(number if layout else first) % 2] if shape == "both" else shape
    furniture = first + number if facts["setting"] == "furniture" else None
    seed, pieces = first + number if layout else first, tuple(facts["pieces"])
    return random_room(seed, pieces, furniture=furniture, shape=outline, large=facts["large"])
