"""``bisplat simulate``."""

from __future__ import annotations

from dataclasses import make_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import OmitArgPrefixes, Positional, arg

from bisplat.commands.idle_options import refuse_idle, refuse_idle_propagation
from bisplat.commands.scene_changes import SceneChanges, changed_scene
from scenes.files.errors import printable
from scenes.files.options import changed, checked, unchecked
from scenes.files.plain_text import say
from simulate.engines.engine_table import ENGINES
from simulate.engines.fullwave_engine import FullWave
from simulate.engines.rays_engine import Rays
from simulate.generation.simulation_options import Simulation
from simulate.parallel.machines import Machines

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

OF_A_REPEAT = ("field", "gpu")
"""The options of engines with which a dataset can be made again. All others are its own."""


def simulate(
    scene: Positional[str],
    output: Output,
    changes: OmitArgPrefixes[SceneChanges] = SceneChanges(),
    content: OmitArgPrefixes[unchecked(Simulation)] = unchecked(Simulation)(),  # type: ignore[valid-type]
    engine: EngineName = "rays",
    engines: Annotated[EngineOptions, OmitArgPrefixes, arg(name="")] = EngineOptions(),
    machines: OmitArgPrefixes[unchecked(Machines)] = unchecked(Machines)(),  # type: ignore[valid-type]
) -> None:
    """Simulate a dataset of spectra in a scene.

    If the command is interrupted, the same command continues.

    Args:
        scene: built-in name (such as lab) or scene YAML. Or a simulated dataset, to make it again with its settings.
        output: the dataset folder. If the scene has several gateways, it gets a dataset folder for each.
        changes: what is different from the scene as it is described.
        content: what the dataset contains.
        engine: rays: ray tracing, milliseconds per spectrum. fullwave: Maxwell's equations, minutes to hours per scene.
        machines: where the simulation runs. The results are the same everywhere.
    """
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
