"""The commands of a dataset and a run: demo, check, train, export."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import OmitArgPrefixes, Positional, arg

from bisplat.commands.common_options import Force, require_new
from bisplat.commands.idle_options import given_options, refuse_idle
from bisplat.commands.simulate_command import Output
from learn.data.splits import SplitKind
from learn.models.model_settings import Steps
from learn.quantities.quantity_table import QuantityName
from learn.training.registry import DEFAULT_MODEL, MODELS, PRESETS, PresetName, model_class, model_entry
from scenes.files.errors import InputError, ParameterError, printable, shown
from scenes.files.options import changed, optional
from scenes.files.plain_text import print_table
from simulate.dataset.dataset_kinds import quantity_of

ModelName = Annotated[str, arg(metavar=f"{{{','.join(MODELS)},MODULE:CLASS}}")]


def demo(
    output: Output = Path("runs/demo"), spectra: Annotated[int, arg(aliases=["-n"])] = 1000, steps: int | None = None
) -> None:
    """Run every step once, on the built-in lab, and write a report.

    The report appears in the first minute and grows with the results. If the demo is interrupted, the same command
    continues.

    Args:
        output: folder for the report, the dataset and the trained models.
        spectra: number of spectra to simulate.
        steps: number of training steps of the BiSplat model (default: until validation no longer rises, at most
            1,500).
    """
    from bisplat.commands.demo_run import demo as run_demo
    from bisplat.commands.demo_run import next_steps

    figures = run_demo(output, spectra, steps)
    print_table("demo", {"": figures})
    print(next_steps(output))


def check(
    dataset: Positional[Path], split: SplitKind | None = None, guard: float = 0.0, seed: int = 0, json: bool = False
) -> None:
    """Check and describe a dataset folder.

    The folder holds spectra, received powers (RSSI) or channels (CSI). The command also warns if test spectra lie too
    close to known spectra. The exit status is 1 if the folder is invalid.

    Args:
        dataset: the dataset folder.
        split: look at this split, as bisplat train would make it (default: the folder's own).
        guard: with --split: known positions nearer than this to a test position are left out, wavelengths.
        seed: with --split: its seed.
        json: print the result as JSON.
    """
    options = given_options(check, locals())

    from learn.evaluation.check import check as check_folder

    if split is None:
        refuse_idle(options, ["guard", "seed"], "without --split")
    found = check_folder(dataset, split, guard, seed)
    if json:
        common = {"valid": found.valid, "problems": found.problems, "warnings": found.warnings}
        print(json_format.dumps(common | found.figures(), indent=2))
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
    preset: PresetName | None = None,
    quantity: QuantityName | None = None,
    split: SplitKind = "files",
    guard: float = 0.0,
    seed: int = 0,
    bypass: tuple[str, ...] = (),
    scene: str | None = None,
    option: tuple[str, ...] = (),
    budget: float | None = None,
    trainer: tuple[str, ...] = (),
    steps: OmitArgPrefixes[optional(Steps)] = optional(Steps)(),  # type: ignore[valid-type]
) -> None:
    """Train a model on a dataset.

    If the command is interrupted, the same command continues.

    Args:
        dataset: dataset folder, simulated or measured.
        output: folder of the new run.
        model: name of the model (documentation: The models), or module:Class for your own. Of received powers, channels
            and responses over a band, a method as for bisplat compare.
        preset: a published model with its number of steps, instead of --model. paper: BiSplat-WRF; paper-plus:
            BiSplat-WRF+.
        quantity: what is learned (default: what the dataset mainly holds).
        split: choice of test spectra. files: the dataset's own; random: a fifth; blocked: every fourth block of ten;
            area: areas with about a fifth.
        guard: known positions nearer than this to a test position are left out, wavelengths.
        seed: seed of the split, the initial weights and the order of the spectra.
        bypass: parts of bisplat or bisplat-plus to switch off: dynamic, delta, bst, order.
        scene: twin only: the scene, a built-in name or a scene YAML.
        option: NAME=VALUE: options of the model that differ from its defaults, such as primitives=250.
        budget: training time, minutes, instead of a number of steps.
        trainer: NAME=VALUE: where a training by steps runs, as arguments of Lightning's Trainer: devices=2,
            num_nodes=2, accelerator=cpu, strategy=ddp.
        steps: training settings (default: the model's own). helmholtz, twin and mirror-images take none.
    """
    settings = changed(steps)
    if preset is not None:
        refuse_idle(given_options(train, locals()), ["model"], f"beside --preset {preset}, which has a model")
    if budget is not None:
        refuse_idle(settings, ["steps"], "beside --budget, which is turned into a number of steps")
    if (quantity or quantity_of(dataset)) in ("spectrum", None):
        _refuse_idle_settings(settings, model if preset is None else PRESETS[preset].model, dataset)
    from learn.fitted.runs import train as train_model

    given = {"bypass": bypass or None, "scene": scene}
    options: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    for name, value in map(read_option, option):
        if name in options:
            raise ParameterError("option", f"expected each option once, found {name} twice")
        options[name] = [value] if name == "bypass" and isinstance(value, str) else value
    try:
        train_model(
            dataset,
            output,
            model=model,
            quantity=quantity,
            split=split,
            guard=guard,
            seed=seed,
            options=options,
            budget=budget,
            preset=preset,
            trainer=dict(read_option(each, "trainer", "devices=2") for each in trainer),
            **changed(steps),
        )
    except ParameterError as error:  # of an option of the model, which is no option of the command
        if error.parameter not in options or given.get(error.parameter) is not None:
            raise
        raise ParameterError("option", f"{error.parameter}: {error.message}") from None
    print(printable(f"run: {output}"))


def read_option(text: str, parameter: str = "option", example: str = "primitives=250") -> tuple[str, Any]:
    """Read an option of a model, or where it is trained. Values: a number, true or false, a list in JSON, or a text."""
    name, equals, value = text.partition("=")
    if not (name and equals and value):
        raise ParameterError(parameter, f"expected NAME=VALUE, such as {example}, found {shown(text)}")
    try:
        return name, json_format.loads(value)
    except ValueError:
        return name, value


def _refuse_idle_settings(settings: dict[str, Any], model: str, dataset: Path) -> None:
    """Refuse settings that this model has no use for on this dataset."""
    if model_entry(model).by_steps is None:
        refuse_idle(settings, ["find_phases"], f"for {model}, which is not trained by steps")
    if not settings.keys() & {"find_phases", "full_resolution"}:
        return
    from learn.models.capabilities import HasOwnLoss, PredictsResponses
    from simulate.dataset.dataset_folder import read_dataset

    kind = model_class(model)
    if not issubclass(kind, PredictsResponses):
        refuse_idle(settings, ["find_phases"], f"for {model}, which predicts no responses")
    elif "response" in read_dataset(dataset).values:
        refuse_idle(settings, ["find_phases", "full_resolution"], f"for {dataset}, from whose responses {model} learns")
    if issubclass(kind, HasOwnLoss):
        refuse_idle(settings, ["full_resolution"], f"for {model}, which cannot train on a few pixels")


EXPORTED: dict[str, tuple[Any, str]] = {
    "--output": (None, "model"),
    "--hdf5": ("hdf5", "dataset"),
    "--deepmimo": ("deepmimo", "scenario"),
    "--csi": ("csi", "channels"),
}
"""The format of each option of ``export``, and what it writes."""


def export(
    what: Positional[Path],
    output: Annotated[Path | None, arg(aliases=["-o"])] = None,
    hdf5: Path | None = None,
    deepmimo: Path | None = None,
    csi: Path | None = None,
    force: Force = False,
) -> None:
    """Write a trained model or a dataset for other programs.

    Give one of --output, --hdf5, --deepmimo and --csi. An exported model maps positions [batch, 3] to spectra
    [batch, 90, 360].

    Args:
        what: a run folder (for --output) or a dataset folder (for the others).
        output: the model as NAME.onnx (needs bisplat-wrf[onnx]) or as NAME.pt2 (torch.export).
        hdf5: the dataset as one HDF5 file, for MATLAB and others.
        deepmimo: the paths of a ray-traced dataset as a scenario folder of DeepMIMO 4.
        csi: the responses over a band as the CSI folder of NeRF² and GSRF.
    """
    outputs = {"--output": output, "--hdf5": hdf5, "--deepmimo": deepmimo, "--csi": csi}
    given = {name: path for name, path in outputs.items() if path is not None}
    if len(given) != 1:
        raise InputError(f"expected one of {', '.join(outputs)}, found {' and '.join(given) or 'none'}")
    ((name, path),) = given.items()
    form, words = EXPORTED[name]
    if form is None and path.suffix not in (".onnx", ".pt2"):
        raise InputError(f"{path}: expected a name that ends in .onnx or .pt2, found {path.name}")
    if form in (None, "hdf5"):
        require_new(path, force=force)
    from learn.reports.export import export as write

    write(what, path, form, force=force)
    print(printable(f"{words}: {path}"))
