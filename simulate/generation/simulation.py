"""Simulate a dataset from Python: what ``bisplat simulate`` does, as a function."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any, get_type_hints

from scenes.checks.validation import validate
from scenes.files.errors import InputError, ParameterError, shown
from scenes.files.options import default_of, taken, takes
from scenes.scene.description import Scene
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset_folder import Dataset, read_dataset
from simulate.engines.engine import Engine, Machines
from simulate.engines.engine_table import ENGINES, engine_class
from simulate.generation.generate import generate
from simulate.generation.request import Request, read_request
from simulate.generation.simulation_options import Simulation
from simulate.positions.placement import check_positions, place, read_positions


@takes(Simulation, Machines, *ENGINES.values())
def simulate(
    scene: Scene | str | Path,
    output: str | Path,
    n: int = Simulation.n,
    *,
    engine: str | Engine = "rays",
    **options: Any,
) -> Dataset:
    """Simulate a scene into a NeRF² dataset folder; the same call again finishes an interrupted one.

    Args:
        scene: a scene of one gateway, a built-in place's name, a scene YAML, or a simulated dataset folder, which is
            then made once more by its own settings instead of those given here.
        output: the dataset folder.
        engine: name of the engine, whose options are then given here too, or the engine itself: "rays" (trace rays),
            "fullwave" (solve Maxwell's equations by finite differences), ``Rays(...)`` or ``FullWave(...)``.
        **options: those of ``Simulation``, ``Machines`` and the engine.

    Returns:
        The dataset, read from the folder.

    Raises:
        InputError: a scene that is refused or has several gateways, or a folder that holds something else.
        ParameterError: a parameter out of its range, or positions inside an object.

    >>> import bisplat, tempfile
    >>> floor = bisplat.SceneObject("floor", bisplat.shapes.sheet((-5, -5, 0), (10, 0, 0), (0, 10, 0)), "concrete")
    >>> gateway = bisplat.Gateway(position=(0, 0, 1.5), orientation=bisplat.facing((-1, 0, 0)))
    >>> region = bisplat.Transmitter(region_min=(-4, -1, 0.5), region_max=(-2, 1, 2))
    >>> materials = bisplat.p2040_materials(["concrete"], 915e6)
    >>> outdoors = bisplat.Scene("outdoors", 915e6, gateway, region, (floor,), materials)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     coarse = bisplat.Propagation(max_depth=1, rays=10_000)
    ...     dataset = bisplat.simulate(outdoors, f"{folder}/data", n=3, propagation=coarse)
    >>> dataset.positions.shape, dataset.responses.shape, dataset.pictures.shape
    ((3, 3), (3, 16), (3, 90, 360))
    """
    defaults = {each.name: default_of(each) for every in ENGINES.values() for each in fields(every)}
    others = {name: value for name, value in options.items() if name not in defaults}
    content, machines = taken({"n": n, **others}, Simulation, Machines)
    given = {name: value for name, value in options.items() if name in defaults and value != defaults[name]}
    kind = engine_class(name_of_engine(scene, engine))
    if isinstance(engine, Engine):
        for name, value in given.items():
            found = f"found {shown(value)} beside {type(engine).__name__}(...)"
            raise ParameterError(name, f"expected it among the engine's own options, {found}")
        by = engine
    else:
        own = {each.name for each in fields(kind)}
        require_no_options(kind.name, **{name: value for name, value in given.items() if name not in own})
        by = kind(**given)
    request = request_for(scene, content, by, content.seed)
    generate(request, Path(output), machines)
    return read_dataset(output)


def name_of_engine(scene: Scene | str | Path, engine: str | Engine) -> str:
    """The name of the engine that a dataset will be made by.

    Args:
        scene: as ``simulate`` takes it; a dataset folder has an engine of its own already.
        engine: as ``simulate`` takes it.
    """
    if not isinstance(engine, str | Engine):
        raise ParameterError("engine", f"expected an engine, such as Rays(), or its name, found {shown(engine)}")
    if not isinstance(scene, Scene) and Path(scene).is_dir():
        return read_request(Path(scene)).engine.name
    return engine if isinstance(engine, str) else engine.name


def require_no_options(engine: str, **options: Any) -> None:
    """Refuse options of one engine that were given for another.

    Args:
        engine: name of the engine that they were given for.
        options: values by name.

    Raises:
        ParameterError: there are any.
    """
    for name, value in options.items():
        of = " or ".join(each.name for each in ENGINES.values() if name in _names(each))
        raise ParameterError(name, f"expected none, or the engine {of}, found {shown(value)} for {engine}")


def _names(options: type) -> set[str]:
    """The names of a dataclass's options, and of those of dataclasses in it."""
    hints = get_type_hints(options)
    inner = [_names(hints[each.name]) for each in fields(options) if is_dataclass(hints[each.name])]
    return {each.name for each in fields(options)}.union(*inner)


def request_for(scene: Scene | str | Path, content: Simulation, engine: Engine, measurement_seed: int) -> Request:
    """Everything that the content of a dataset folder depends on.

    Args:
        scene: as ``simulate`` takes it.
        content: what the dataset holds.
        engine: what finds the responses. A dataset folder has an engine of its own already.
        measurement_seed: seed of the receiver's errors.

    Returns:
        The request, for ``generate``.

    Raises:
        InputError: as ``simulate``.
        ParameterError: as ``simulate``.
    """
    if not isinstance(scene, Scene) and Path(scene).is_dir():
        request = read_request(Path(scene))
        return replace(request, engine=engine.again(request.engine).for_scene(request.scene))
    if isinstance(scene, Scene):
        validate(scene, scene.name)
    else:
        scene = load_scene(scene)
    if scene.further_gateways:
        raise InputError(
            f"{scene.name}: expected a scene of one gateway, found {len(scene.by_gateway())}; simulate each scene of "
            "scene.by_gateway() into a folder of its own"
        )
    given = content.positions
    if given is None:
        points, how = (
            place(scene, content.placement, content.n, content.seed),
            f"{content.placement}, seed {content.seed}",
        )
    elif isinstance(given, str | Path):
        points, how = read_positions(Path(given), scene), f"positions of {Path(given).name}"
    else:
        points, how = check_positions(given, scene), "given positions"
    return Request(
        scene=scene,
        positions=points,
        placement=how,
        engine=engine.for_scene(scene),
        seed=content.seed,
        measurement=content.measurement,
        measurement_seed=measurement_seed,
        power=content.power_db,
    )
