"""The commands of a dataset and a run: demo, check, train, predict, export."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import OmitArgPrefixes, Positional, arg

from bisplat.commands.output_file import Force, require_new
from bisplat.commands.simulate_command import Output
from learn.data.splits import SplitKind
from learn.models.steps import Processes, Steps
from learn.training.registry import DEFAULT_MODEL, MODELS
from scenes.files.errors import InputError, ParameterError, printable
from scenes.files.options import changed, optional, unchecked
from scenes.files.plain_text import say
from scenes.files.text_tables import print_table

ModelName = Annotated[str, arg(metavar=f"{{{','.join(MODELS)},MODULE:CLASS}}")]


def demo(
    output: Output = Path("runs/demo"), spectra: Annotated[int, arg(aliases=["-n"])] = 1000, steps: int | None = None
) -> None:
    """Run every step on the built-in lab: simulate, train, evaluate, cross-validate, write a report.

    Args:
        output: folder for dataset/, run/, run-bisplat/, report.html and metrics.json.
        spectra: number of spectra to simulate.
        steps: number of optimiser steps of the BiSplat model.
    """
    from bisplat.commands.demo_run import demo as run_demo

    figures = run_demo(output, spectra, steps)
    print_table("demo", {"": figures})
    print(printable(f"report: {output / 'report.html'}"))


def check(dataset: Positional[Path], json: bool = False) -> None:
    """Validate and describe a NeRF² dataset folder, and warn if its split leaks. Exit status 1 if it is invalid.

    Args:
        dataset: the dataset folder.
        json: print {"valid", "spectra", "problems", "warnings", "array", "grid", "fit_residual_grey_levels"} as JSON.
    """
    from learn.evaluation.check import check as check_folder

    found = check_folder(dataset)
    if json:
        result = {
            "valid": found.valid,
            "spectra": 0 if found.dataset is None else len(found.dataset.names),
            "problems": found.problems,
            "warnings": found.warnings,
            **found.beamformer(),
        }
        print(json_format.dumps(result, indent=2))
    else:
        if found.dataset is not None:
            print_table(str(dataset), {"": found.description()})
        for kind, sentences in (("problem", found.problems), ("warning", found.warnings)):
            for sentence in sentences:
                print(printable(f"{kind}: {sentence}"))
    if not found.valid:
        raise SystemExit(1)


def train(
    dataset: Positional[Path],
    output: Output,
    model: ModelName = DEFAULT_MODEL,
    split: SplitKind = "files",
    seed: int = 0,
    encoding: Literal["octaves", "waves"] | None = None,
    bypass: tuple[str, ...] = (),
    scene: str | None = None,
    steps: OmitArgPrefixes[optional(Steps)] = optional(Steps)(),  # type: ignore[valid-type]
    processes: OmitArgPrefixes[unchecked(Processes)] = unchecked(Processes)(),  # type: ignore[valid-type]
) -> None:
    """Train a model on a dataset folder. The same command again resumes an interrupted run.

    Args:
        dataset: NeRF² dataset folder, simulated or measured.
        output: the run folder.
        model: name of the model; docs/model.md and docs/peers.md describe each. Or module:Class, a model of your own
            in the current folder or on Python's path.
        split: how the test part is chosen. files: the folder's own index files; random: a random fifth of the spectra;
            blocked: every fourth block of ten consecutive spectra.
        seed: seed of the split, the initial weights and the order of the spectra.
        encoding: encoding of the transmitter's position: octaves, the paper's TX-PE, or waves, plane waves of the
            dataset's wavelength.
        bypass: branches of bisplat or bisplat-plus to switch off, as the paper's ablation does: dynamic, delta, bst; or
            order, to blend the primitives in stored order instead of by depth.
        scene: of twin: the scene as described, a built-in name or a scene YAML.
        steps: settings of training by steps, by default the model's own; a model fitted in closed form (helmholtz)
            takes none.
        processes: where the training runs.
    """
    from learn.training.train import train as train_model

    place = str(Path(scene).resolve()) if scene is not None and Path(scene).is_file() else scene
    given = {"bypass": bypass, "encoding": encoding, "scene": place}
    train_model(
        dataset,
        output,
        model=model,
        split=split,
        seed=seed,
        options={name: value for name, value in given.items() if value},
        **changed(steps),
        **vars(processes),
    )
    print(printable(f"run: {output}"))


def predict(runs: Positional[tuple[Path, ...]], positions: Path, output: Output, force: Force = False) -> None:
    """Predict spectra, how far they may be off, and element responses if the model predicts them, at given positions.

    Args:
        runs: the run folder; or several of one dataset and split, whose predictions are averaged.
        positions: CSV file with the header x,y,z; metres, in the dataset's world frame.
        output: the .npz file to write: spectra [K, 90, 360] float32, channels (the responses; of one run) [K, elements]
            complex64, deviation [K] float32, the standard deviation of a spectrum's values (0 to 1).
    """
    if output.suffix.lower() != ".npz":
        raise InputError(f"{output}: expected a name that ends in .npz, since the file holds several arrays")
    if not runs:
        raise ParameterError("runs", "expected at least one run folder, found none")
    require_new(output, force=force)
    from learn.training.ensemble import Ensemble
    from learn.training.run_folder import load_run
    from scenes.files.npz_file import write_arrays
    from simulate.positions.given_positions import reach_warning, read_points

    loaded = [load_run(run) for run in runs]
    points = read_points(positions)
    region = loaded[0].model.region.cpu().numpy()
    warning = reach_warning(points, region, "the training positions", "predictions there are guesses")
    if warning is not None:
        say(f"warning: {positions}: {warning}")
    if len(loaded) > 1:
        together = Ensemble(loaded)
        mean = together.predict(points)
        arrays, deviation = {"spectra": mean.spectra}, together.deviation(mean.variance)
    else:
        prediction, deviation = loaded[0].predict(points), loaded[0].deviation(points)
        arrays = {"spectra": prediction.spectra}
        if prediction.responses is not None:
            arrays["channels"] = prediction.responses
    if deviation is not None:
        arrays["deviation"] = deviation.astype("float32")
    write_arrays(output, arrays)
    print(printable(f"{len(points)} spectra: {output}"))


def export(
    what: Positional[Path],
    output: Annotated[Path | None, arg(aliases=["-o"])] = None,
    hdf5: Path | None = None,
    deepmimo: Path | None = None,
    force: Force = False,
) -> None:
    """Write a trained model or a dataset for other programs. Give one of --output, --hdf5 and --deepmimo.

    Args:
        what: a run folder (for --output) or a dataset folder (for the others).
        output: of a run, the model as one file: NAME.onnx (needs bisplat-wrf[onnx]) or NAME.pt2, a torch.export
            program. It maps positions [batch, 3] to spectra [batch, 90, 360].
        hdf5: of a dataset, simulated or measured, one HDF5 file, which MATLAB and others read.
        deepmimo: of a dataset simulated by rays, a scenario folder of DeepMIMO 4: the paths, traced again.
    """
    outputs = {"--output": output, "--hdf5": hdf5, "--deepmimo": deepmimo}
    given = [name for name, path in outputs.items() if path is not None]
    if len(given) != 1:
        raise InputError(f"expected one of {', '.join(outputs)}, found {' and '.join(given) or 'none'}")
    if deepmimo is not None:
        from simulate.exchange.deepmimo.deepmimo_export import export_deepmimo

        export_deepmimo(what, deepmimo, force)
        print(printable(f"scenario: {deepmimo}"))
    elif hdf5 is not None:
        from simulate.exchange.hdf5_export import export_hdf5

        require_new(hdf5, force=force)
        export_hdf5(what, hdf5)
        print(printable(f"dataset: {hdf5}"))
    elif output is not None:
        from learn.training.model_export import export as export_model
        from learn.training.run_folder import load_run

        require_new(output, force=force)
        export_model(load_run(what), output)
        print(printable(f"model: {output}"))
