"""Commands that use a field or a scene: ``calibrate``, ``locate``, ``plan``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import OmitArgPrefixes, Positional, arg

from bisplat.commands.given_options import names_of, refuse_given
from bisplat.commands.given_propagation import refuse_idle_propagation
from bisplat.commands.located_rows import OF_ROWS, locate_rows
from bisplat.commands.located_tags import OF_TRACKS, Direction, Region, is_dataset, locate_tags_of
from bisplat.commands.output_file import Force, require_new
from bisplat.commands.scene_changes import SceneChanges, changed_scene
from bisplat.commands.simulate_command import Output
from learn.data.splits import SplitKind
from scenes.files.errors import InputError, ParameterError, printable, require_whole
from scenes.files.options import checked, unchecked
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import print_rows, say
from scenes.scene.tolerances import Tolerances
from simulate.dataset.dataset_kinds import is_csi, is_rssi
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
    powers = is_rssi(dataset)
    if powers:
        refuse_given(["--rotation", "--carrier", "--array"], "spectra, found received powers of single antennas")
    followed, allowed = checked(Propagation, propagation), checked(Tolerances, tolerances)
    if split not in ("random", "area"):
        refuse_given(["--seed"], f"--split random or area beside it, found {split}, which draws nothing")
    with new_folder(output, force) as unfinished:
        place = changed_scene(load_scene(scene), changes)
        _refuse_idle_tolerances(place, allowed)
        refuse_idle_propagation(followed, [place])
        options: dict[str, Any] = {"split": split, "seed": seed, "tolerances": allowed, "propagation": followed}
        correct = _by_powers if powers else _by_spectra
        told = correct(place, dataset, spectra, options, unfinished)
    print(told)
    print(printable(f"scene: {output / 'scene.yaml'}"))
    if powers:
        print(printable(f"gateways: {output / 'gateways.yml'}"))


def _by_spectra(scene: Scene, dataset: Path, n: int, options: dict[str, Any], folder: Path) -> str:
    """Correct a scene by spectra, write it to an empty folder and print what changed; returns how well it fits."""
    from learn.twin.calibrate import calibrate as calibrate_scene
    from learn.twin.calibrate import rows_of, write_calibration

    found = calibrate_scene(scene, dataset, n, report=say, **options)
    write_calibration(found, folder)
    print_rows(f"changes of {scene.name}", rows_of(found.which, found.values, found.deviations))
    now, before = found.misfit
    return f"unexplained share of the measured power: {before:.1%} before, {now:.1%} after"


def _by_powers(scene: Scene, dataset: Path, n: int, options: dict[str, Any], folder: Path) -> str:
    """As ``_by_spectra``, by received powers."""
    from learn.twin.calibrate import rows_of
    from learn.twin.calibrate_powers import calibrate_powers, write_power_calibration

    found = calibrate_powers(scene, dataset, n, report=say, **options)
    write_power_calibration(found, folder)
    print_rows(f"changes of {scene.name}", rows_of(found.which, found.values, found.deviations))
    now, before = found.error
    return f"median error of the received powers: {before:.2f} dB before, {now:.2f} dB after"


def _refuse_idle_tolerances(scene: Scene, tolerances: Tolerances) -> None:
    """Refuse tolerances that the user gave for what the scene does not have."""
    from scenes.scene.unknowns import OF_MATERIALS, unknowns

    kinds = {unknown.kind for unknown in unknowns(scene, tolerances)}
    if tolerances.objects and "object" not in kinds:
        refuse_given(["--objects"], f"an object inside the room that can move, found none in {scene.name}")
    if tolerances.materials and not kinds & set(OF_MATERIALS):
        refuse_given(["--materials"], f"a material that is no conductor, found none in {scene.name}")


def locate(
    runs: Positional[tuple[Path, ...]],
    output: Output,
    pictures: tuple[Path, ...] = (),
    heard: Path | None = None,
    split: SplitKind = "files",
    level: float | None = None,
    region: Region | None = None,
    boresight: Direction | None = None,
    force: Force = False,
) -> None:
    """Locate transmitters or tags from what was heard of them.

    The .csv file has a row for each place where a transmitter may be: probability, position (m) and covariance (m²).

    Args:
        runs: the run folder. With several gateways: a run for each, in the same frame. Or one folder of received powers
            (RSSI) or channels (CSI) with positions. Or a dataset folder whose antenna moved; its tags are then located
            from their responses.
        output: the .csv file to write.
        pictures: for each run, a dataset folder or a folder of PNG spectra (00001.png, ...). Of the dataset that the
            first run was trained on, the test part is located; its folder spectrum stands for all pictures.
        heard: what was heard at unknown places: a CSV such as gateway_rssi.csv or a folder of received powers; or a
            folder of channels (default: the test part of the folder).
        split: choice of that test part, as for bisplat compare.
        level: how much stronger the heard transmitter is than that of the known powers, dB (default: estimated).
        region: tags along a track only: the box in which they are, x y z of both corners, metres.
        boresight: tags along a track only: the direction in which the antenna looks, if it has a broad main lobe.
    """
    if len(runs) == 1 and (is_rssi(runs[0]) or is_csi(runs[0])):
        refuse_given(OF_TRACKS, "a dataset whose antenna moved, found powers or channels")
        _require_csv(output, force)
        locate_rows(runs[0], output, heard, split, level)
        return
    refuse_given(OF_ROWS, f"received powers (RSSI) or channels (CSI), found {', '.join(map(str, runs))}")
    if len(runs) == 1 and not pictures and is_dataset(runs[0]):
        locate_tags_of(runs[0], output, force, region, boresight)
        return
    refuse_given(OF_TRACKS, "a dataset whose antenna moved, and no run, found a run")
    from learn.localisation.locate import grid_warning
    from learn.localisation.locate import locate as locate_pictures
    from learn.localisation.located_places import write_places
    from learn.localisation.observations import observed_pictures, parts_of, require_unseen
    from learn.training.config import read_config
    from learn.training.fit_progress import FitProgress
    from learn.training.run_folder import load_run

    _require_csv(output, force)
    for folder in runs:
        read_config(folder)  # a folder that is no run needs no pictures
    if len(runs) != len(pictures) or not runs:
        raise ParameterError("pictures", f"expected a folder for each of the {len(runs)} runs, found {len(pictures)}")
    loaded = [load_run(run) for run in runs]
    seen = [observed_pictures(folder, run) for folder, run in zip(pictures, loaded, strict=True)]
    names = seen[0][0]
    for folder, (other, _) in zip(pictures, seen, strict=True):
        if other != names:
            raise InputError(f"{folder}: expected pictures of the same names as in {pictures[0]}, found other ones")
    parts = parts_of(names, pictures[0], loaded[0])
    for folder, run in zip(pictures[1:], loaded[1:], strict=True):
        of_run = zip(names, parts, parts_of(names, folder, run), strict=True)
        learned = [name for name, first, other in of_run if first == "test" and other in ("train", "validation")]
        require_unseen(run, loaded[0], learned)
    chosen = list(range(len(names)))
    if "test" in parts and pictures[0].resolve().name != "spectrum":
        chosen = [number for number, part in enumerate(parts) if part == "test"]
        say(f"{pictures[0]}: located the {len(chosen)} pictures of the test part; {pictures[0]}/spectrum has all")
        names, parts = ([each[number] for number in chosen] for each in (names, parts))
    for run in loaded:
        unseen_side = run.beamformer.array.cannot_tell
        if unseen_side is not None:
            say(f"warning: {run.folder}: of the array, {unseen_side}; places on both sides may be given")
    warning = grid_warning(loaded)
    if warning is not None:
        say(f"warning: {warning}")
    with FitProgress("location") as report:
        places = locate_pictures(loaded, [each[chosen] for _, each in seen], report)
    write_places(output, names, places, parts)
    several, empty = sum(len(each) > 1 for each in places), sum(not each for each in places)
    told = "with pictures that tell nothing, such as those of one grey level, which the file leaves out"
    unseen = f", and {empty} {told}" if empty else ""
    print(printable(f"{len(names)} pictures, {several} of them with several possible places{unseen}: {output}"))


def _require_csv(output: Path, force: bool) -> None:
    if output.suffix.lower() != ".csv":
        raise InputError(f"{output}: expected a name that ends in .csv")
    require_new(output, force=force)


def plan(
    run_or_scene: Positional[str],
    output: Output,
    positions: Annotated[int | None, arg(aliases=["-n"])] = None,
    target: float | None = None,
    tour: bool = False,
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
        tour: order the positions as a short walk, instead of by usefulness.
        seed: seed of the candidate positions.
        propagation: what the ray tracer follows in a scene.
    """
    require_new(output, force=force)
    from learn.planning.next_positions import plan as plan_positions
    from learn.training.fit_progress import FitProgress
    from scenes.storage.scene_yaml import load_scene
    from simulate.dataset.dataset_writer import write_positions

    followed = checked(Propagation, propagation)
    if Path(run_or_scene).is_dir():
        powers = is_rssi(Path(run_or_scene))
        what = "received powers of" if powers else "run"
        refuse_given(names_of(Propagation), f"a scene to trace, found the {what} {run_or_scene}")
        if powers:
            refuse_given(["--target"], f"a run or a scene, since the curve is of spectra, found {run_or_scene}")
    refuse_idle_propagation(followed, [load_scene(run_or_scene)] if followed.diffuse else [])
    with FitProgress("plan") as progress:
        planned = plan_positions(
            run_or_scene, positions, target=target, tour=tour, seed=seed, propagation=followed, report=progress
        )
    write_positions(output, planned.positions)
    before, after = planned.open_variance[[0, -1]]
    print(printable(f"{len(planned.positions)} positions: {output}"))
    if planned.needed is not None:
        print(planned.needed.sentence())
    print(f"open variance of the field: {before:.1%} before, {after:.1%} after")
    if planned.tour is not None:
        crossings = planned.tour.crossings
        through = f"; {crossings} of its legs cross an object and need a detour" if crossings else ""
        print(f"tour: {planned.tour.length:.1f} m{through}")
