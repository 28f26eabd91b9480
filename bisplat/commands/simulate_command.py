"""``bisplat simulate``: spectra in a scene or in random rooms, or received powers."""

from __future__ import annotations

from dataclasses import dataclass, fields, make_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import OmitArgPrefixes, Positional, arg

from bisplat.commands.idle_options import refuse_idle, refuse_idle_propagation
from bisplat.commands.scene_changes import SceneChanges, changed_scene
from scenes.files.atomic import require_writable
from scenes.files.errors import InputError, printable
from scenes.files.options import changed, checked, unchecked
from scenes.files.plain_text import say
from simulate.dataset.dataset_kinds import Outline, Setting
from simulate.engines.engine_table import ENGINES
from simulate.engines.fullwave_engine import FullWave
from simulate.engines.rays_engine import Rays
from simulate.generation.power_receiver import PowerReceiver
from simulate.generation.simulation_options import Simulation
from simulate.parallel.machines import Machines
from simulate.positions.positions import Places

if TYPE_CHECKING:
    from scenes.scene.description import Scene  # its import takes long, and the help does not need it

    EngineName = str
else:
    EngineName = Literal[tuple(ENGINES)]  # the choices of the command line

Output = Annotated[Path, arg(aliases=["-o"])]

EngineOptions: Any = make_dataclass(
    "EngineOptions",
    [
        (name, Annotated[unchecked(engine), OmitArgPrefixes], unchecked(engine)())  # type: ignore[misc]
        for name, engine in ENGINES.items()
    ],
    frozen=True,
)
"""The options of all engines."""

ROOM_SPECTRA = 200  # Number of spectra in each random room, unless stated


@dataclass(frozen=True)
class RandomRooms:
    """Random rooms instead of a scene.

    Attributes:
        rooms: number of random rooms, each with a dataset of its own. bisplat compare scores methods in the last ones.
        setting: what differs from room to room. same: the transmitter's positions; furniture: the furniture, too;
            layout: everything.
        pieces: least and largest number of pieces of furniture, 0 to 12.
        shape: outline of the rooms; l: L-shaped; both: every second one is.
        large: make rooms of four to eight metres instead of two to four.
    """

    rooms: int | None = None
    setting: Setting = "layout"
    pieces: tuple[int, int] = (1, 12)
    shape: Outline = "rectangle"
    large: bool = False


OF_A_REPEAT = ("field", "gpu")
"""The options of engines with which a dataset can be made again. All others are its own."""


def simulate(
    scene: Annotated[Positional[str], arg(metavar="SCENE", help_behavior_hint="")] = "",
    *,
    output: Output,
    gateways: Path | None = None,
    changes: OmitArgPrefixes[SceneChanges] = SceneChanges(),
    content: OmitArgPrefixes[unchecked(Simulation)] = unchecked(Simulation)(),  # type: ignore[valid-type]
    engine: EngineName = "rays",
    engines: Annotated[EngineOptions, OmitArgPrefixes, arg(name="")] = EngineOptions(),
    machines: OmitArgPrefixes[unchecked(Machines)] = unchecked(Machines)(),  # type: ignore[valid-type]
    receiver: OmitArgPrefixes[unchecked(PowerReceiver)] = unchecked(PowerReceiver)(),  # type: ignore[valid-type]
    random: OmitArgPrefixes[RandomRooms] = RandomRooms(),
) -> None:
    """Simulate spectra or received powers (RSSI) in scenes or rooms.

    If the command is interrupted, the same command continues.

    Args:
        scene: built-in name (such as lab) or scene YAML. Or a simulated dataset, to make it again with its settings.
            None with --rooms.
        output: the dataset folder. If the scene has several gateways, or there are several rooms, it gets a dataset
            folder for each.
        gateways: simulate received powers (RSSI) instead of spectra. A YAML file of the gateways, of one element each:
            NAME: [x, y, z], or NAME: {position: [x, y, z], boresight: [x, y, z], pattern: dipole}; metres, world frame.
            Those of the scene are left out.
        changes: what is different from the scene as it is described.
        content: what the dataset contains.
        engine: rays: ray tracing, milliseconds per spectrum. fullwave: Maxwell's equations, minutes to hours per scene.
        machines: where the simulation runs. The results are the same everywhere.
        receiver: with --gateways: what a gateway reports.
        random: random rooms instead of a scene.
    """
    given = changed(changes) | changed(content) | changed(engines) | changed(machines)
    given |= {} if engine == "rays" else {"engine": engine}
    if gateways is None:
        refuse_idle(changed(receiver), changed(receiver), "without --gateways")
    if random.rooms is None:
        refuse_idle(changed(random), changed(random), "without --rooms")
    elif scene or gateways is not None:
        raise InputError(f"expected a scene or --rooms, found both, {scene or gateways} and --rooms {random.rooms}")
    if not scene and random.rooms is None:
        raise InputError("expected a scene, such as lab, or --rooms N, found neither")
    if random.rooms is not None:
        refuse_idle(given, given.keys() - {"n", "seed"}, "with --rooms, whose rooms are made by their seeds")
        _simulate_rooms(output, random, given.get("n", ROOM_SPECTRA), given.get("seed", 0))
    elif gateways is not None:
        wanted = Places(**{each.name: getattr(content, each.name) for each in fields(Places)})
        followed = checked(Rays, engines.rays)
        used = changed(wanted) | changed(followed.propagation) | {"frequency": None}
        refuse_idle(given, [name for name in given if name not in used], "with --gateways")
        _simulate_powers(scene, output, changes, gateways, wanted, checked(PowerReceiver, receiver), followed)
    else:
        _simulate_spectra(scene, output, changes, content, engine, engines, machines)


def _simulate_rooms(output: Path, random: RandomRooms, spectra: int, seed: int) -> None:
    from simulate.generation.simulated_rooms import GALLERY, simulate_rooms

    options = {each.name: getattr(random, each.name) for each in fields(RandomRooms)}
    made = simulate_rooms(output, options.pop("rooms"), seed=seed, spectra=spectra, **options)
    print(printable(f"{'1 room' if len(made) == 1 else f'{len(made)} rooms'}: {output}"))
    print(printable(f"floor plans: {output / GALLERY}"))


def _simulate_powers(
    scene: str,
    output: Path,
    changes: SceneChanges,
    gateways: Path,
    wanted: Places,
    receiver: PowerReceiver,
    rays: Rays,
) -> None:
    from scenes.storage.scene_yaml import load_scene
    from simulate.generation.simulated_powers import make_rssi

    if wanted.positions is not None:
        refuse_idle(changed(wanted), ["n", "placement"], f"beside --positions {wanted.positions}")
    require_writable(output / "metadata.json")
    place = changed_scene(load_scene(scene), changes)
    refuse_idle_propagation(rays.propagation, [place])
    made = make_rssi(place, output, gateways, wanted, receiver, rays)
    print(printable(f"{len(made)} positions, {len(made.gateway_names)} gateways: {output}"))


def _simulate_spectra(
    scene: str, output: Path, changes: SceneChanges, content: Any, engine: str, engines: Any, machines: Any
) -> None:
    import numpy as np

    from learn.data.expected_score import say_expectation
    from scenes.scene.shapes import bounding_box
    from scenes.storage.scene_yaml import load_scene
    from simulate.generation.generate import generate, has_work
    from simulate.generation.simulation import made_again, name_of_engine, request_for
    from simulate.positions.positions import reach_warning

    wanted, places = checked(Simulation, content), checked(Machines, machines)
    again = made_again(scene)
    if again:
        settings = changed(changes) | changed(content) | changed(engines) | {"engine": engine}
        own = [name for name in settings if name not in OF_A_REPEAT and settings[name] != "rays"]
        refuse_idle(own, own, f"for the dataset {scene}, which is made again with its own settings")
    options = {name: checked(kind, getattr(engines, name)) for name, kind in ENGINES.items()}
    by = options.pop(name_of_engine(scene, engine))
    for name, other in options.items():
        refuse_idle(changed(other), changed(other), f"with the engine {by.name}; it is one of {name}")
    if wanted.positions is not None:
        refuse_idle(changed(content), ["n", "placement"], f"beside --positions {wanted.positions}")
    if isinstance(by, FullWave) and by.field is not None:
        solving = {**changed(by), **changed(machines)}
        refuse_idle(solving, ["cell", "gpu", "workers", "ray"], f"beside --field {by.field}, which is solved")
    if again:
        folders: dict[Path, str | Scene] = {output: scene}
    else:
        place = changed_scene(load_scene(scene), changes)
        if isinstance(by, Rays):
            refuse_idle_propagation(by.propagation, [place])
        folders = {output / name: seen for name, seen in place.by_gateway().items()}
        if not place.further_gateways:
            folders = {output: place}
    # Each array has errors of its own.
    requests = {
        folder: request_for(seen, wanted, by, wanted.seed + number)
        for number, (folder, seen) in enumerate(folders.items())
    }
    for number, (folder, request) in enumerate(requests.items()):
        if len(requests) > 1:  # the last folder must not be refused after the work on the first
            has_work(request, folder, places)
        if wanted.positions is not None and number == 0:
            box = bounding_box(np.vstack([request.scene.bounds, request.scene.transmitter.region]))
            for given, points in ((wanted.positions, request.positions), (wanted.receivers, request.receivers)):
                if points is None:
                    continue
                warning = reach_warning(points, box, "the scene", "are they in metres, in the scene's frame?")
                if warning is not None:
                    say(f"warning: {given}: {warning}")
    for folder, request in requests.items():
        generate(request, folder, places)
        print(printable(f"{len(request)} spectra: {folder}"))
    first = next(iter(requests.values()))
    if first.moving == "both":
        return  # no model learns from such spectra
    known = first.known[first.known < len(first.positions)]  # those of the first frequency
    say_expectation(first.positions[known], first.scenes[0].wavelength, first.beamformer.array, True)
