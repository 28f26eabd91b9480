"""Simulate a dataset of received powers (RSSI) from Python: what ``bisplat simulate --gateways`` does."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from scenes.checks.validation import doubts, validate
from scenes.files.atomic import require_writable, temporary_folder, write_atomically
from scenes.files.errors import named, require_instance, require_path
from scenes.files.options import taken, takes
from scenes.files.output_folder import move_content
from scenes.files.plain_text import say
from scenes.files.progress import progress_bar
from scenes.scene.antennas import Gateway
from scenes.scene.description import Scene
from scenes.scene.shapes import bounding_box
from scenes.storage.scene_digest import scene_digest
from scenes.storage.scene_writing import write_scene
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset, require_written
from simulate.dataset.dataset_kinds import PARTS, POWERS
from simulate.dataset.metadata import made_here
from simulate.dataset.powers_folder import write_powers
from simulate.engines.engine import Setting
from simulate.engines.rays_engine import Rays
from simulate.generation.generate import begun, continued
from simulate.generation.listening_gateways import UPRIGHT, gateways_of
from simulate.generation.power_receiver import PowerReceiver
from simulate.parallel.machines import Machines
from simulate.positions.placement import chosen_positions
from simulate.positions.positions import Places, points_digest, reach_warning

AT_ONCE = 500  # Positions traced at a time. A simulation that is killed loses at most these.


@takes(Places, PowerReceiver, Rays)
def simulate_rssi(
    scene: Scene | str | Path,
    folder: str | Path,
    gateways: Mapping[str, Gateway | Sequence[float]] | str | Path,
    n: int = Places.n,
    **options: Any,
) -> Dataset:
    """Simulate the powers that gateways of one element receive (RSSI), as a folder in the format of NeRF²'s BLE data.

    Each gateway is traced as that of a scene is in ``simulate``. It reports P = P_t + 20 log10 ``|y|`` + X in dBm, with
    the response y of its element, which includes the antenna patterns, and the shadowing X. The folder can be read by
    the published loaders of NeRF² [zhao2023] and GSRF. The same arguments give the same dataset.

    Args:
        scene: a scene, the name of a built-in scene, or a scene YAML file. Its own gateways are left out.
        folder: the folder: a new one, or one that the same call began. If the simulation is interrupted, the same call
            continues.
        gateways: position [x, y, z] of each gateway by its name, metres, world frame, or a ``Gateway``, of whose array
            one element is left; or a YAML file of them. A gateway of which only the position is given has the pattern
            "iso" and vertical polarisation.
        **options: those of ``Places``, ``PowerReceiver`` and ``Rays``.

    Returns:
        The dataset, read from the folder.

    Raises:
        InputError: the scene or a gateway is not valid, the folder holds something else, or the ray tracer cannot run.
        ParameterError: a parameter is outside its range, or a position is inside an object.

    Example:
        >>> import bisplat
        >>> gateways = {"door": (2.0, 0.5, 1.8), "window": (2.5, 0.5, 1.8)}
        >>> coarse = bisplat.Propagation(max_depth=1, diffraction=False, rays=20_000)
        >>> powers = bisplat.simulate_rssi("closet", "powers", gateways, n=5, propagation=coarse)
        >>> powers.powers.shape, powers.gateway_names, len(powers.train)
        ((5, 2), ['door', 'window'], 3)
    """
    require_instance(Scene, str, Path, scene=scene)
    require_path(folder=folder)
    content, receiver, engine = taken({"n": n, **options}, Places, PowerReceiver, Rays)
    require_writable(Path(folder) / "metadata.json")
    if isinstance(scene, Scene):
        validate(scene, scene.name)
        for sentence in doubts(scene):
            say(f"warning: {scene.name}: {sentence}")
    else:
        scene = load_scene(scene)
    return make_rssi(scene, Path(folder), gateways, content, receiver, engine)


def make_rssi(
    scene: Scene,
    folder: Path,
    gateways: Mapping[str, Gateway | Sequence[float]] | str | Path,
    content: Places,
    receiver: PowerReceiver,
    engine: Rays,
) -> Dataset:
    """Simulate received powers in a scene that has been checked; ``simulate_rssi`` explains the arguments."""
    heard = gateways_of(gateways)
    source = str(gateways) if isinstance(gateways, str | Path) else "gateways"
    for name, gateway in heard.items():
        validate(_alone(scene, gateway), f"{source}: {named(name)}")
    points, how = chosen_positions(scene, content)
    around = bounding_box(np.vstack([scene.transmitter.region, points]))
    stated = "position", "orientation", "pattern", "polarization"
    settings = [Setting(_alone(scene, gateway), around, content.seed) for gateway in heard.values()]
    engine.require(settings[0], folder, Machines())
    _say_assumptions(scene, heard, receiver)
    _warn_of_far_places(scene, {name: gateway.position for name, gateway in heard.items()}, source, points, content)
    metadata = {
        **made_here(),
        "kind": "rssi",
        "scene": scene.name,
        "scene_file": "scene/scene.yaml",
        "scene_sha256": scene_digest(scene),
        "frequency_hz": scene.frequency,
        "gateways": {name: {key: getattr(gateway, key) for key in stated} for name, gateway in heard.items()},
        "transmitter": {key: getattr(scene.transmitter, key) for key in ("pattern", "polarization", "orientation")},
        "receiver": asdict(receiver) | {"seed": content.seed},
        "positions": len(points),
        "placement": how,
        "positions_sha256": points_digest(points),
        **engine.metadata(settings[0]),
        "seed": content.seed,
        "versions": engine.versions(),
    }
    if begun(folder, metadata) and _is_finished(folder):
        return read_dataset(folder)
    with continued(folder, metadata):
        if not _is_finished(folder):  # another process may have finished it in the meantime
            (folder / PARTS).mkdir(exist_ok=True)
            reported = receiver.reported(path_gains(settings, engine, points, folder / PARTS), content.seed)
            with temporary_folder(folder) as whole:
                write_scene(scene, whole / "scene")
                at = {name: gateway.position for name, gateway in heard.items()}
                write_powers(whole, points, at, reported, metadata, content.seed)
                require_written(whole, folder)
                move_content(whole, folder)
            shutil.rmtree(folder / PARTS)
    return read_dataset(folder)


def _is_finished(folder: Path) -> bool:
    return (folder / POWERS).is_file() and not (folder / PARTS).exists()


def path_gains(
    settings: Sequence[Setting], engine: Rays, positions: Float[np.ndarray, "K 3"], parts: Path
) -> Float[np.ndarray, "K G"]:
    """The path gain 20 log10 ``|y|`` from each position to each gateway."""
    gains = np.zeros((len(positions), len(settings)))
    with progress_bar() as progress:
        bar = progress.add_task("received powers", total=gains.size)
        for number, setting in enumerate(settings):
            tracer, named_by = None, scene_digest(setting.scene)[:16]  # the gateways' order may change
            for start in range(0, len(positions), AT_ONCE):
                some, path = positions[start : start + AT_ONCE], parts / f"{named_by}-{start:07d}.npy"
                found = _kept(path, len(some))
                if found is None:
                    tracer = tracer or engine.tracer(setting, progress)
                    with np.errstate(divide="ignore"):
                        found = 20 * np.log10(np.abs(tracer.responses(some)[:, 0]))
                    content = BytesIO()
                    np.save(content, found)
                    write_atomically(path, content.getbuffer())
                gains[start : start + AT_ONCE, number] = found
                progress.advance(bar, len(some))
    return gains


def _kept(path: Path, count: int) -> Float[np.ndarray, " count"] | None:
    """The gains in a file; None if there is none, or a damaged one."""
    try:
        gains = np.load(path)
    except (OSError, ValueError, EOFError):
        return None
    return gains if isinstance(gains, np.ndarray) and gains.shape == (count,) else None


def _alone(scene: Scene, gateway: Gateway) -> Scene:
    """The scene with this gateway only."""
    return replace(scene, gateway=gateway, further_gateways={})


def _warn_of_far_places(
    scene: Scene,
    gateways: Mapping[str, Sequence[float]],
    source: str,
    positions: Float[np.ndarray, "K 3"],
    content: Places,
) -> None:
    """Warn of places far outside the scene, as when they are in millimetres."""
    box = bounding_box(np.vstack([scene.bounds, scene.transmitter.region]))
    places = {source: np.array(list(gateways.values()))}
    if content.positions is not None:
        named_file = isinstance(content.positions, str | Path)
        places[str(content.positions) if named_file else "positions"] = positions
    for origin, points in places.items():
        warning = reach_warning(points, box, "the scene", "are they in metres, in the scene's frame?")
        if warning is not None:
            say(f"warning: {origin}: {warning}")


def _say_assumptions(scene: Scene, gateways: Mapping[str, Gateway], receiver: PowerReceiver) -> None:
    count = f"{len(gateways)} gateway{'s' if len(gateways) > 1 else ''} of one element"
    steps = f"steps of {receiver.quantisation_db:g} dB" if receiver.quantisation_db else "no quantisation"
    say(
        f"{scene.name}: {count}, {scene.frequency / 1e6:g} MHz; transmitter of {receiver.tx_power_dbm:g} dBm, floor "
        f"{receiver.floor_dbm:g} dBm, shadowing {receiver.shadowing_db:g} dB, {steps}"
    )
    upright = [name for name, gateway in gateways.items() if gateway.orientation == UPRIGHT]
    if upright:
        who = "all of them" if len(upright) == len(gateways) else ", ".join(upright[:5]) + ", …" * (len(upright) > 5)
        say(f"gateways that look along world +x with +z up, which is the default: {who}")
