"""Commands that use a field or a scene: ``calibrate``, ``locate``, ``plan``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import OmitArgPrefixes, Positional, arg

from bisplat.commands.common_options import Force, require_new
from bisplat.commands.idle_options import given_options, refuse_idle, refuse_idle_propagation
from bisplat.commands.scene_changes import SceneChanges, changed_scene
from bisplat.commands.simulate_command import Output
from learn.data.splits import SplitKind
from scenes.files.errors import printable, require_whole
from scenes.files.options import changed, checked, unchecked
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import print_rows, say
from scenes.scene.tolerances import Tolerances
from simulate.dataset.dataset_kinds import quantity_of
from simulate.rays.core.propagation import Propagation

if TYPE_CHECKING:  # its import takes long, and the help does not need it
    from scenes.scene.description import Scene


def calibrate(
    scene: Positional[str],
    dataset: Positional[Path],
    output: Output,
    changes: OmitArgPrefixes[SceneChanges] = SceneChanges(),
    spectra: Annotated[int, arg(aliases=["-n"])] = 160,
    split: SplitKind = "files",
    seed: int = 0,
    tolerances: OmitArgPrefixes[unchecked(Tolerances)] = unchecked(Tolerances)(),  # type: ignore[valid-type]
    propagation: OmitArgPrefixes[unchecked(Propagation)] = unchecked(Propagation)(),  # type: ignore[valid-type]
    force: Force = False,
) -> None:
    """Correct a scene with measured spectra or received powers.

    The corrections are the gateway's position and orientation, the materials, and the positions of objects. From
    received powers, the positions of all their gateways are corrected; their orientations stay.

    Args:
        scene: the scene to correct: a built-in name or a scene YAML.
        dataset: dataset folder of spectra or received powers measured there.
        output: folder of the corrected scene, and of gateways.yml, the gateways of received powers.
        changes: what is different from the scene as it is described.
        spectra: largest number of spectra, or of positions of received powers, to use. Held-out ones are never used.
        split: choice of held-out spectra, as for bisplat train.
        seed: seed of that split.
        tolerances: how wrong the scene may be, as standard deviations.
        propagation: what the ray tracer follows.
    """
    from scenes.storage.scene_yaml import load_scene
    from simulate.positions.positions import MOST_POSITIONS

    require_whole(1, MOST_POSITIONS, spectra=spectra)
    if quantity_of(dataset) == "power":
        idle = ["rotation", "carrier", "array"]
        refuse_idle(changed(changes) | changed(tolerances), idle, "for received powers of single antennas")
    followed, allowed = checked(Propagation, propagation), checked(Tolerances, tolerances)
    if split not in ("random", "area"):
        refuse_idle(given_options(calibrate, locals()), ["seed"], f"with --split {split}, which draws nothing")
    with new_folder(output, force) as unfinished:
        place = changed_scene(load_scene(scene), changes)
        _refuse_idle_tolerances(place, allowed)
        refuse_idle_propagation(followed, [place])
        from learn.twin.calibrate import calibrate as calibrate_scene
        from learn.twin.calibration import GATEWAYS, write_calibration

        found = calibrate_scene(
            place, dataset, spectra, split=split, seed=seed, propagation=followed, report=say, **vars(allowed)
        )
        write_calibration(found, unfinished)
    print_rows(f"changes of {place.name}", found.rows())
    print(found.sentence())
    print(printable(f"scene: {output / 'scene.yaml'}"))
    if found.gateways:
        print(printable(f"gateways: {output / GATEWAYS}"))


def _refuse_idle_tolerances(scene: Scene, tolerances: Tolerances) -> None:
    """Refuse tolerances that the user gave for what the scene does not have."""
    from scenes.scene.unknowns import OF_MATERIALS, unknowns

    kinds = {unknown.kind for unknown in unknowns(scene, tolerances)}
    given = changed(tolerances)
    if tolerances.objects and "object" not in kinds:
        refuse_idle(given, ["objects"], f"in {scene.name}, without an object inside the room that can move")
    if tolerances.materials and not kinds & set(OF_MATERIALS):
        refuse_idle(given, ["materials"], f"in {scene.name}, where all materials are conductors")


def plan(
    run_or_scene: Positional[str],
    output: Output,
    positions: Annotated[int | None, arg(aliases=["-n"])] = None,
    target: float | None = None,
    seed: int = 0,
    propagation: OmitArgPrefixes[unchecked(Propagation)] = unchecked(Propagation)(),  # type: ignore[valid-type]
    force: Force = False,
) -> None:
    """Plan where to measure next.

    The planned positions leave the least variance of the field open. They lie in the transmitter region of the scene,
    outside its objects. For a run on measured spectra, they lie in the convex hull of its training positions. If the
    scene has several gateways, all of them count. So do all gateways of received powers (RSSI).

    Args:
        run_or_scene: a run folder; a folder of received powers (RSSI); or a scene without measurements (a built-in name
            or a scene YAML).
        output: the CSV file to write, with the header x,y,z, in metres, in the world frame.
        positions: number of positions (default: as many as the target needs, at most 1000; without a target 50).
        target: tell how many more spectra this median SSIM needs.
        seed: seed of the candidate positions.
        propagation: what the ray tracer follows in a scene.
    """
    require_new(output, force=force)
    from learn.planning.next_positions import plan as plan_positions
    from learn.training.fit_progress import FitProgress
    from scenes.storage.scene_yaml import load_scene
    from simulate.positions.positions import write_positions

    followed = checked(Propagation, propagation)
    if Path(run_or_scene).is_dir():
        powers = quantity_of(Path(run_or_scene)) == "power"
        what = "received powers of" if powers else "run"
        refuse_idle(changed(propagation), vars(propagation), f"for the {what} {run_or_scene}, which traces nothing")
    refuse_idle_propagation(followed, [load_scene(run_or_scene)] if followed.diffuse else [])
    with FitProgress("plan") as progress:
        planned = plan_positions(
            run_or_scene, positions, target=target, seed=seed, propagation=followed, report=progress
        )
    write_positions(output, planned.positions)
    before, after = planned.open_variance[[0, -1]]
    print(printable(f"{len(planned.positions)} positions: {output}"))
    if planned.needed is not None:
        print(planned.needed.sentence())
    print(f"open variance of the field: {before:.1%} before, {after:.1%} after")
