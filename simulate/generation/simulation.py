"""Simulate a dataset from Python: what ``bisplat simulate`` does, as a function."""

from __future__ import annotations

from dataclasses import fields, replace
from os import PathLike
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np
from jaxtyping import Float

from scenes.checks.occupancy import TOUCHING
from scenes.checks.validation import doubts, validate
from scenes.files.errors import InputError, ParameterError, require_instance, require_path, shown
from scenes.files.options import default_of, differs, taken, takes
from scenes.files.plain_text import say
from scenes.places.built_in import BUILT_IN
from scenes.scene.description import Scene
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.engines.engine import Engine
from simulate.engines.engine_table import ENGINES, engine_class
from simulate.engines.rays_engine import Rays
from simulate.generation.generate import generate
from simulate.generation.reciprocity import element_offsets
from simulate.generation.request import Request, read_request
from simulate.generation.simulation_options import MOST_TRANSMITTERS, Simulation
from simulate.parallel.machines import Machines
from simulate.positions.placement import AT_IT, all_the_same, chosen_positions, free_places, free_positions, place
from simulate.spectra.array import too_few_elements
from simulate.spectra.element_array import array_of


@takes(Simulation, Machines, *ENGINES.values())
def simulate(
    scene: Scene | str | Path,
    output: str | Path,
    n: int = Simulation.n,
    *,
    engine: str | Engine = "rays",
    **options: Any,
) -> Dataset:
    """Simulate a scene into a NeRF² dataset folder.

    The engine computes the element responses, the receiver's errors are added, and the pictures are the min–max
    normalised spectra of the result. The folder can be read by the published loaders of NeRF² [zhao2023] and its
    successors. The same call again finishes an interrupted simulation, and repairs damaged files of a finished one. The
    same arguments give the same dataset.

    Args:
        scene: a scene with one gateway, the name of a built-in scene, a scene YAML file, or a simulated dataset folder.
            A dataset folder is simulated again with its own settings, and those given here are ignored.
        output: the dataset folder: a new one, an empty one, or one that the same call began.
        engine: "rays" (trace rays), "fullwave" (solve Maxwell's equations by finite differences), or an engine with its
            own options: ``Rays(...)`` or ``FullWave(...)``. Options of a named engine are given here.
        **options: those of ``Simulation``, ``Machines`` and the engine.

    Returns:
        The dataset, read from the folder; of several frequencies, the spectra of the lowest one (``read_dataset`` reads
        the others).

    Raises:
        InputError: the scene is not valid or has several gateways, the folder holds something else, or the engine
            cannot run.
        ParameterError: a parameter is outside its range, a position is inside an object, or both ends move in full
            wave, where each transmitter needs a run of its own.

    Example:
        Three spectra of a gateway that stands in front of a wall:

        >>> import bisplat
        >>> wall = bisplat.SceneObject("wall", bisplat.shapes.sheet((-5, 2, 0), (10, 0, 0), (0, 0, 3)), "concrete")
        >>> gateway = bisplat.Gateway(position=(0, 0, 1.5), orientation=bisplat.facing((-1, 0, 0)))
        >>> region = bisplat.Transmitter(region_min=(-4, -1, 0.5), region_max=(-2, 1, 2))
        >>> materials = bisplat.p2040_materials(["concrete"], 915e6)
        >>> scene = bisplat.Scene("wall", 915e6, gateway, region, (wall,), materials)
        >>> coarse = bisplat.Propagation(max_depth=1, diffraction=False, rays=20_000)
        >>> dataset = bisplat.simulate(scene, "data/wall", n=3, propagation=coarse)
        >>> dataset.positions.shape, dataset.responses.shape, dataset.pictures.shape
        ((3, 3), (3, 16), (3, 90, 360))
    """
    require_instance(Scene, str, PathLike, scene=scene)
    require_path(output=output)
    defaults = {each.name: default_of(each) for every in ENGINES.values() for each in fields(every)}
    others = {name: value for name, value in options.items() if name not in defaults}
    content, machines = taken({"n": n, **others}, Simulation, Machines)
    given = {name: value for name, value in options.items() if name in defaults and differs(value, defaults[name])}
    kind = engine_class(name_of_engine(scene, engine))
    if isinstance(engine, Engine):
        for name, value in given.items():
            found = f"found {shown(value)} beside {type(engine).__name__}(...)"
            raise ParameterError(name, f"expected it as an argument of the engine, {found}")
        by = engine
    else:
        names = {every.name: {each.name for each in fields(every)} for every in ENGINES.values()}
        for name in given.keys() - names[kind.name]:
            of = " or ".join(each for each in names if name in names[each])
            found = f"found {shown(given[name])} for {kind.name}"
            raise ParameterError(name, f"expected none, or the engine {of}, {found}")
        by = kind(**given)
    request = request_for(scene, content, by, content.seed)
    if isinstance(scene, Scene):  # those of a file were said when it was read
        for sentence in doubts(scene):
            say(f"warning: {scene.name}: {sentence}")
    generate(request, Path(output), machines)
    return read_dataset(output, request.frequencies[0] if request.frequencies else None)


def made_again(scene: Scene | str | Path) -> TypeGuard[str | Path]:
    if isinstance(scene, Scene) or not Path(scene).is_dir():
        return False
    if str(scene) in BUILT_IN:
        raise InputError(
            f"{scene}: expected a scene or a dataset folder, found a built-in scene and a folder of this name; give "
            f"./{scene} for the folder, or rename it"
        )
    return True


def name_of_engine(scene: Scene | str | Path, engine: str | Engine) -> str:
    if not isinstance(engine, str | Engine):
        raise ParameterError("engine", f"expected an engine, such as Rays(), or its name, found {shown(engine)}")
    if made_again(scene):
        return read_request(Path(scene)).engine.name
    return engine if isinstance(engine, str) else engine.name


def request_for(scene: Scene | str | Path, content: Simulation, engine: Engine, measurement_seed: int) -> Request:
    """Collect everything that the content of a dataset folder depends on."""
    if made_again(scene):
        request = read_request(Path(scene))
        return replace(request, engine=engine.again(request.engine).for_scene(request.scene, request.frequencies))
    if isinstance(scene, Scene):
        validate(scene, scene.name)
    else:
        scene = load_scene(scene)
    if scene.further_gateways:
        raise InputError(
            f"{scene.name}: expected a scene of one gateway, found {len(scene.by_gateway())}; simulate each scene of "
            "scene.by_gateway() into a folder of its own"
        )
    if len(content.hertz) > 1 and not engine.knows_frequencies:
        raise ParameterError("frequencies", f"expected one frequency with the engine {engine.name}, found several")
    if content.moving == "both" and engine.keeps_source:
        raise ParameterError(
            "moving",
            f"expected transmitter or receiver in {engine.called}, found both; --moving receiver solves one "
            "transmitter at a time",
        )
    if content.band is not None and not engine.knows_bands:
        raise ParameterError("bandwidth", f"expected none with the engine {engine.name}, found one")
    if content.band is not None and isinstance(engine, Rays) and engine.propagation.sionna:
        raise ParameterError("bandwidth", "expected none with Sionna's path solver (sionna), found one")
    if content.band is not None:
        content.band.frequencies(scene.frequency)  # refuses one that is too wide
    few = too_few_elements(array_of(scene.gateway, scene.frequency))
    if few is not None:
        say(f"warning: {scene.name}: {few}, so they are not scored; powers and responses tell more")
    offsets, receivers = element_offsets(scene.gateway, scene.wavelength), None
    if content.moving == "both":
        points, receivers, how = chosen_pairs(scene, content, offsets)
    else:
        points, how = chosen_positions(scene, content, offsets if content.moving == "receiver" else AT_IT)
    return Request(
        scene=scene,
        positions=points,
        placement=how,
        engine=engine.for_scene(scene, content.hertz),
        seed=content.seed,
        measurement=content.measurement,
        measurement_seed=measurement_seed,
        power=content.power_db,
        band=content.band,
        frequencies=content.hertz,
        moving=content.moving,
        receivers=receivers,
    )


def chosen_pairs(
    scene: Scene, content: Simulation, offsets: Float[np.ndarray, "elements 3"]
) -> tuple[Float[np.ndarray, "K 3"], Float[np.ndarray, "K 3"], str]:
    """The places of transmitter and array that the options of a simulation ask for, and how they were chosen."""
    if content.positions is None or content.receivers is None:
        return _drawn(scene, content, offsets)
    transmitters = free_places(content.positions, scene).round(6)
    receivers = free_places(content.receivers, scene, offsets, "receivers").round(6)
    if len(receivers) != len(transmitters):
        row = f"expected a row for each of the {len(transmitters)} positions, found {len(receivers)}"
        if isinstance(content.receivers, str | Path):
            raise InputError(f"{content.receivers}: {row}")
        raise ParameterError("receivers", row)
    if all_the_same(np.hstack([transmitters, receivers])):
        raise ParameterError("positions", f"expected at least two different pairs, found {len(receivers)} alike")
    apart = np.linalg.norm(receivers[:, None] + offsets - transmitters[:, None], axis=-1).min(axis=1)
    if apart.min() < TOUCHING:
        raise ParameterError(
            "positions",
            f"expected transmitters apart from the array's elements, found one at an element in row "
            f"{int(apart.argmin())}",
        )
    count = len(np.unique(transmitters, axis=0))
    if count > MOST_TRANSMITTERS:
        raise ParameterError(
            "positions", f"expected at most {MOST_TRANSMITTERS} places of the transmitter, found {count}"
        )
    names = [Path(each).name for each in (content.positions, content.receivers) if isinstance(each, str | Path)]
    return transmitters, receivers, f"positions of {' and '.join(names)}" if len(names) == 2 else "given positions"


def _drawn(
    scene: Scene, content: Simulation, offsets: Float[np.ndarray, "elements 3"]
) -> tuple[Float[np.ndarray, "K 3"], Float[np.ndarray, "K 3"], str]:
    """Draw the array's places as those of any end that moves, and assign the transmitter's evenly, at random."""
    assert content.transmitters is not None
    receivers = place(scene, content.placement, content.n, content.seed, offsets)
    generator = np.random.default_rng([content.seed, 1])  # the array's places are drawn from the seed alone
    places = free_positions(scene, scene.transmitter.region, content.transmitters, generator)
    turns = generator.permutation(np.arange(len(receivers)) % content.transmitters)
    how = f"{content.placement}, {content.transmitters} transmitters, seed {content.seed}"
    return places[turns].round(6), receivers.round(6), how
