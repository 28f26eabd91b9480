"""Commands that use a field or a scene: ``calibrate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, Positional, arg

from learn.splits import SplitKind
from scenes.errors import printable, require_seed, require_whole
from scenes.new_folder import new_folder
from scenes.output_file import Force
from scenes.plain_text import say
from scenes.text_tables import print_rows
from scenes.tolerances import Tolerances
from simulate.command import Output, PropagationOptions
from simulate.propagation import Propagation


class ToleranceOptions(Tolerances):
    def __post_init__(self) -> None:  # checked by the command, as simulate's options are
        pass


def calibrate(
    scene: Positional[str],
    dataset: Positional[Path],
    output: Output,
    spectra: Annotated[int, arg(aliases=["-n"])] = 160,
    split: SplitKind = "files",
    seed: int = 0,
    tolerances: OmitArgPrefixes[ToleranceOptions] = ToleranceOptions(),
    propagation: OmitArgPrefixes[PropagationOptions] = PropagationOptions(),
    force: Force = False,
) -> None:
    """Correct a scene by measured spectra: gateway, materials, places of objects. Writes the corrected scene.

    Args:
        scene: the scene as described: a built-in name or a scene YAML.
        dataset: folder of spectra that were measured there.
        output: folder for scene.yaml, its meshes, and calibration.json.
        spectra: largest number of spectra to use; held-out ones are never used.
        split: which spectra are held out, as for train.
        seed: seed of that split.
        tolerances: how wrong the scene may be: standard deviations.
        propagation: mechanisms that the ray tracer follows.
    """
    from learn.splits import split as split_dataset
    from learn.twin.measured import calibrate_by, rows_of, write_calibration
    from scenes.scene_yaml import load_scene
    from simulate.dataset import read_dataset
    from simulate.evenly import evenly
    from simulate.positions import MOST_POSITIONS

    require_whole(1, MOST_POSITIONS, spectra=spectra)
    require_seed(seed=seed)
    followed, allowed = Propagation(**vars(propagation)), Tolerances(**vars(tolerances))
    with new_folder(output, force) as unfinished:
        place, measured = load_scene(scene), read_dataset(dataset)
        known = evenly(split_dataset(measured, split, seed).known, spectra)
        found = calibrate_by(place, measured, known, allowed, followed, report=say)
        write_calibration(found, unfinished)
    print_rows(f"changes of {place.name}", rows_of(found))
    now, before = found.misfit
    print(f"{before:.1%} of the measured power was unexplained, {now:.1%} is now")
    print(printable(f"scene: {output / 'scene.yaml'}"))
