"""The command line. Results go to files, progress to stderr, tables to stdout; errors are one sentence, exit 1."""

from __future__ import annotations

import json as json_format
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table
from tyro.conf import Positional, arg

from scenes.errors import InputError

Output = Annotated[Path, arg(aliases=["-o"])]
Triple = tuple[float, float, float]


def demo(
    output: Output = Path("runs/demo"), spectra: Annotated[int, arg(aliases=["-n"])] = 1000, steps: int = 1500
) -> None:
    """The main job, end to end, on the built-in lab: simulate, train, evaluate, cross-validate, report.

    Args:
        output: folder for dataset/, run/, report.html and metrics.json.
        spectra: spectra to simulate.
        steps: optimiser steps.
    """
    from learn.demo import demo as run_demo

    figures = run_demo(output, spectra, steps)
    _print_table("demo", {"": figures})
    print(f"report: {output / 'report.html'}")


def scene(
    scene: Positional[str],
    output: Annotated[Path | None, arg(aliases=["-o"])] = None,
    material: tuple[str, ...] = (),
    default_material: str | None = None,
    unit: Literal["m", "cm", "mm", "in", "ft"] = "m",
    up: Literal["y", "z"] | None = None,
    frequency: float = 915e6,
    gateway: Triple | None = None,
    boresight: Triple | None = None,
    pattern: Literal["iso", "dipole", "hw_dipole", "tr38901"] = "iso",
    region_min: Triple | None = None,
    region_max: Triple | None = None,
    json: bool = False,
) -> None:
    """Draw and describe a scene; or import a mesh (GLB, GLTF, OBJ, PLY, STL, OFF) or a Mitsuba XML into a new one.

    Args:
        scene: built-in name (lab) or scene YAML; to import: a mesh, a Mitsuba or Sionna RT XML, or sionna:etoile.
        output: the drawing (default NAME.png); for an import: the new scene's folder.
        material: import only: NODE=MATERIAL rules, the first that matches wins; NODE may hold * and ?.
        default_material: import only: material of nodes that neither a rule nor the file gives one.
        unit: import only: the mesh's unit of length.
        up: import only: the mesh's up axis (default: y for glTF, else z).
        frequency: import only: Hz.
        gateway: import only: the gateway's position, metres.
        boresight: import only: direction the gateway looks in; its y axis is up.
        pattern: import only: of the gateway's elements; isotropic ones cannot tell front from back.
        region_min: import only: lowest corner of the transmitter region, metres.
        region_max: import only: highest corner of the transmitter region, metres.
        json: print the description as JSON.
    """
    from scenes import Gateway, Transmitter, load_scene
    from scenes.description import facing
    from scenes.drawing import describe_scene, draw_scene
    from scenes.mesh_import import import_scene, is_importable
    from scenes.scene_yaml import write_scene

    if is_importable(scene):
        needed = {
            "--output": output,
            "--gateway": gateway,
            "--boresight": boresight,
            "--region-min": region_min,
            "--region-max": region_max,
        }
        missing = [name for name, value in needed.items() if value is None]
        if output is None or gateway is None or boresight is None or region_min is None or region_max is None:
            raise InputError(f"{scene}: importing a mesh needs {', '.join(missing)} too")
        placed = Gateway(gateway, facing(boresight), pattern=pattern), Transmitter(region_min, region_max)
        rules = [_rule(text) for text in material]
        place, report = import_scene(Path(scene), rules, default_material, unit, up, frequency, *placed)
        write_scene(place, output)
        for name, count in report.degenerate.items():
            print(f"bisplat: {name}: dropped {count} triangles without area", file=sys.stderr)
        drawing = output / "scene.png"
    else:
        place = load_scene(scene)
        drawing = output or Path(f"{place.name}.png")
    draw_scene(place, drawing)
    description = describe_scene(place)
    if json:
        print(json_format.dumps(description, indent=2))
        return
    for what in ("objects", "materials"):
        _print_rows(what, description.pop(what))
    gateways: dict[str, dict] = description.pop("further_gateways")
    for label, further in gateways.items():
        description |= {f"{label} {name}": value for name, value in further.items()}
    for what in ("bounds", "gateway", "transmitter"):
        description |= {f"{what} {name}": value for name, value in description.pop(what).items()}
    region = description.pop("transmitter region")
    description |= {f"transmitter region {name}": value for name, value in region.items()}
    _print_table("scene (metres, hertz)", {"": description})
    print(f"drawing: {drawing}")


def simulate(
    scene: Positional[str],
    output: Output,
    spectra: Annotated[int, arg(aliases=["-n"])] = 6000,
    placement: Literal["uniform", "grid", "path"] = "uniform",
    positions: Path | None = None,
    seed: int = 0,
    max_depth: int = 5,
    rays: int = 1_000_000,
    los: bool = True,
    specular: bool = True,
    refraction: bool = True,
    diffuse: bool = False,
    diffraction: bool = False,
    snr: float | None = None,
    gain_error: float = 0.0,
    phase_error: float = 0.0,
    phase_noise: float = 0.0,
    power_db: bool = False,
    workers: int | None = None,
    ray: str | None = None,
) -> None:
    """Ray-trace a scene into a NeRF² dataset folder. The same command again finishes an interrupted one.

    Args:
        scene: built-in name (lab, conference, bedroom, office), scene YAML, or a simulated dataset folder, which is
            then made once more, by its own settings and not by those given here.
        output: the dataset folder; for a scene of several gateways a folder of one dataset each.
        spectra: transmitter positions to draw.
        placement: how they are drawn in the scene's region; path walks a smooth curve, as measurements do.
        positions: CSV of positions (header x,y,z; metres) to use instead.
        seed: of positions, train/test split and rays.
        max_depth: most interactions on a path.
        rays: rays per source; with diffuse reflection or diffraction choose about 20000.
        los: line of sight.
        specular: specular reflection.
        refraction: transmission through objects.
        diffuse: diffuse reflection off materials with a scattering coefficient.
        diffraction: first-order diffraction at edges.
        snr: thermal noise: signal over noise, dB, averaged over the array.
        gain_error: standard deviation of the elements' gains, dB, drawn once for the array.
        phase_error: standard deviation of the elements' phases, degrees, drawn once for the array.
        phase_noise: standard deviation of a phase drawn anew for every element and spectrum, degrees.
        power_db: also write each spectrum's absolute power in dB, as power_db/NNNNN.tif.
        workers: trace with so many Ray workers at a time (needs bisplat-wrf[ray]).
        ray: address of a running Ray cluster to trace on.
    """
    from scenes import load_scene
    from simulate.generate import generate
    from simulate.measurement import Measurement
    from simulate.placement import place, read_positions
    from simulate.propagation import Propagation
    from simulate.request import Request, read_request

    for name, value, least in (
        ("spectra", spectra, 2),
        ("max-depth", max_depth, 0),
        ("rays", rays, 1),
        ("workers", workers, 1),
    ):
        if value is not None and value < least:
            raise InputError(f"--{name}: expected at least {least}, found {value}")
    if Path(scene).is_dir():
        request = read_request(Path(scene))
        generate(request, output, workers, ray)
        print(f"{len(request.positions)} spectra: {output}")
        return
    where = load_scene(scene)
    if positions is not None:
        points, how = read_positions(positions, where), f"positions of {positions.name}"
    else:
        points, how = place(where, placement, spectra, seed), f"{placement}, seed {seed}"
    propagation = Propagation(max_depth, los, specular, refraction, diffuse, diffraction, rays, seed)
    for number, (name, seen) in enumerate(where.by_gateway().items()):
        folder = output / name if where.further_gateways else output
        measurement = Measurement(snr, gain_error, phase_error, phase_noise, seed + number)  # each array its own errors
        generate(Request(seen, points, how, propagation, seed, measurement, power_db), folder, workers, ray)
        print(f"{len(points)} spectra: {folder}")


def check(dataset: Positional[Path], json: bool = False) -> None:
    """Validate a NeRF² dataset folder, describe it, warn of a leaking split. Exit status 1 if it is invalid.

    Args:
        dataset: the folder.
        json: print {"valid", "spectra", "problems", "warnings"} as JSON.
    """
    from learn.leakage import leakage
    from simulate.dataset import inspect

    inspection = inspect(dataset)
    warnings, data = list(inspection.warnings), inspection.dataset
    leak = leakage(data) if data is not None else None
    if leak is not None and leak.leaks:
        warnings.append(leak.sentence())
    if json:
        result = {
            "valid": not inspection.problems,
            "spectra": len(data.names) if data is not None else 0,
            "problems": inspection.problems,
            "warnings": warnings,
        }
        print(json_format.dumps(result, indent=2, ensure_ascii=False))
    else:
        if data is not None:
            span = " to ".join(
                str(corner.round(3).tolist()) for corner in (data.positions.min(0), data.positions.max(0))
            )
            description = {
                "spectra": len(data.names),
                "training / test": f"{len(data.train)} / {len(data.test)}",
                "positions (m)": span,
                "gateway at (m)": data.gateway_position.round(3).tolist(),
                "gateway looks along": _boresight(data.gateway_orientation),
                "array": f"{data.array.rows} × {data.array.columns}, {data.array.spacing} wavelengths apart",
                "complex channels": "yes" if data.channels is not None else "no",
                "split": leak.sentence() if leak is not None else "none",
            }
            _print_table(str(dataset), {"": description})
        for kind, lines in (("problem", inspection.problems), ("warning", warnings)):
            for line in lines:
                print(f"{kind}: {line}")
    if inspection.problems:
        raise SystemExit(1)


def train(
    dataset: Positional[Path],
    output: Output,
    model: Literal[
        "bisplat", "bisplat-plus", "bisplat-aperture", "mlp", "mlp-responses", "nerf2", "swiftwrf"
    ] = "bisplat-aperture",
    split: Literal["files", "random", "blocked"] = "files",
    seed: int = 0,
    steps: int = 1500,
    batch_size: int = 8,
    learning_rate: float | None = None,
    bypass: tuple[Literal["dynamic", "delta", "bst", "order"], ...] = (),
    init: Path | None = None,
    devices: int = 1,
    nodes: int = 1,
) -> None:
    """Train a model on a dataset folder. The same command again resumes an interrupted run.

    Args:
        dataset: NeRF² dataset folder, simulated or measured.
        output: the run folder.
        model: which model.
        split: the folder's own files, a random fifth for testing, or every fourth run of ten positions.
        seed: of split, initial weights and order.
        steps: optimiser steps.
        batch_size: spectra per step.
        learning_rate: of AdamW (default: 2e-3; 3e-4 for bisplat-plus).
        bypass: branches to switch off, as the paper's ablation does; order: blend in stored order, not by depth.
        init: a finished run of the same model to begin with, instead of random weights.
        devices: GPUs per machine (processes, where there is no GPU).
        nodes: machines; start this command on each, as Lightning's launchers do.
    """
    from learn.run import LEARNING_RATE, Config
    from learn.train import train as fit

    if learning_rate is None:
        learning_rate = LEARNING_RATE[model]
    _positive(steps=steps, batch_size=batch_size, learning_rate=learning_rate, devices=devices, nodes=nodes)
    config = Config(str(dataset.resolve()), model, split, seed, seed, steps, batch_size, learning_rate, bypass)
    if init is not None:
        config = replace(config, init=str(init.resolve()))
    fit(config, output, devices, nodes)
    print(f"run: {output}")


def evaluate(run: Positional[Path], dataset: Path | None = None, index: Path | None = None, json: bool = False) -> None:
    """Score a run on held-out spectra, beside baselines and the array's ceiling. Writes RUN/evaluation.

    Args:
        run: the run folder.
        dataset: another dataset folder to test on.
        index: file with the names of the spectra to test on.
        json: print the figures as JSON.
    """
    from learn.evaluate import evaluate as score_run

    metrics = score_run(run, dataset, index).metrics()
    if json:
        print(json_format.dumps(metrics, indent=2))
        return
    baselines = metrics.pop("baselines")
    tested = metrics.pop("test_spectra")
    _print_table(f"{tested} test spectra", {"model": metrics, **baselines})


def crossvalidate(
    run: Positional[Path],
    scene: str,
    positions: Annotated[int, arg(aliases=["-n"])] = 100,
    seed: int = 1,
    json: bool = False,
) -> None:
    """Compare a run with fresh ray tracing at new positions. Writes RUN/crossvalidation.json and figures.

    Args:
        run: the run folder.
        scene: the place its dataset was simulated in.
        positions: number of fresh positions.
        seed: draws them.
        json: print the figures as JSON.
    """
    from learn.crossvalidate import crossvalidate as compare_with_tracing
    from scenes import load_scene

    metrics = compare_with_tracing(run, load_scene(scene), positions, seed).metrics()
    if json:
        print(json_format.dumps(metrics, indent=2))
    else:
        _print_table("against fresh ray tracing", {"model": metrics})


def export(run: Positional[Path], output: Output) -> None:
    """Write a trained model as one file for other programs: positions [batch, 3] in, spectra [batch, 90, 360] out.

    Args:
        run: the run folder.
        output: NAME.onnx (needs bisplat-wrf[onnx]) or NAME.pt2, a torch.export program.
    """
    from learn.export import export as export_model
    from learn.run import load_run

    export_model(load_run(run), output)
    print(f"model: {output}")


def predict(run: Positional[Path], positions: Path, output: Output) -> None:
    """Predict spectra (and the aperture model's element responses) at given positions.

    Args:
        run: the run folder.
        positions: CSV with the header x,y,z; metres, in the dataset's frame.
        output: the .npz to write: spectra [K, 90, 360] float32, channels [K, 16] complex64.
    """
    from learn.run import load_run
    from simulate.dataset import read_points
    from simulate.dataset_writer import write_arrays

    loaded = load_run(run)
    points = read_points(positions)
    arrays = {"spectra": loaded.predict(points)}
    channels = loaded.predict_channels(points)
    if channels is not None:
        arrays["channels"] = channels
    write_arrays(output, arrays)
    print(f"{len(points)} spectra: {output}")


def compare(
    dataset: Positional[Path],
    output: Output,
    models: tuple[str, ...] = (),
    split: Literal["files", "random", "blocked"] = "files",
    budget: float = 5.0,
    seeds: int = 1,
    json: bool = False,
) -> None:
    """Every model and baseline on one split, in one table. The same command again adds what is missing, and redraws.

    Args:
        dataset: NeRF² dataset folder.
        output: folder for table.html, ssim_cdf.png, results.jsonl, per_sample/ and the runs.
        models: which (default: all): mean-picture, nearest, inverse-distance, kriging, kriging-responses, mlp,
            mlp-responses, nerf2, swiftwrf, bisplat, bisplat-plus, bisplat-aperture, or module:Class of your own.
        split: as for train; random draws the same test part for every method.
        budget: minutes of training, for each method that learns.
        seeds: how often each method is fitted.
        json: print the table as JSON.
    """
    from learn.compare import compare as compare_methods
    from learn.methods import METHODS

    _positive(budget=budget, seeds=seeds)
    _print_figures("comparison", compare_methods(dataset, output, models or tuple(METHODS), split, budget, seeds), json)
    print(f"table: {output / 'table.html'}", file=sys.stderr)


def ablate(
    dataset: Positional[Path],
    output: Output,
    models: tuple[Literal["bisplat", "bisplat-plus", "bisplat-aperture"], ...] = ("bisplat", "bisplat-aperture"),
    split: Literal["files", "random", "blocked"] = "blocked",
    budget: float = 5.0,
    seeds: int = 3,
    json: bool = False,
) -> None:
    """What each part of a model is worth: the paper's table over several seeds, and ours. Goes on where it stopped.

    Args:
        dataset: NeRF² dataset folder.
        output: folder for ablation.png, results.jsonl, per_sample/ and the runs.
        models: whose parts.
        split: as for train.
        budget: minutes of training for each row and seed.
        seeds: how often each row is trained.
        json: print the table as JSON.
    """
    from learn.ablate import ablate as ablate_models

    _positive(budget=budget, seeds=seeds)
    _print_figures("ablation", ablate_models(dataset, output, models, split, budget, seeds), json)


def sweep(
    dataset: Positional[Path],
    output: Output,
    sizes: tuple[int, ...],
    models: tuple[str, ...] = ("bisplat-aperture", "bisplat", "inverse-distance"),
    split: Literal["files", "random", "blocked"] = "files",
    budget: float = 5.0,
    seeds: int = 1,
    init: Path | None = None,
    json: bool = False,
) -> None:
    """Accuracy against the number of training spectra, on the same test part. Goes on where it stopped.

    Args:
        dataset: NeRF² dataset folder.
        output: folder for sweep.png, results.jsonl, per_sample/ and the runs.
        sizes: numbers of training spectra; baselines also have the validation part.
        models: as for compare.
        split: as for train.
        budget: minutes of training, for each method that learns.
        seeds: how often each is fitted.
        init: a finished run (of a simulated place, say) whose model is then also trained on from its weights.
        json: print the table as JSON.
    """
    from learn.sweep import sweep as sweep_sizes

    _positive(budget=budget, seeds=seeds)
    table = sweep_sizes(dataset, output, models, sizes, split, budget, seeds, init)
    _print_figures("sweep", {f"{label}, {size}": row for (label, size), row in table.items()}, json)


def _positive(**values: float) -> None:
    for name, value in values.items():
        if value <= 0:
            raise InputError(f"--{name.replace('_', '-')}: expected a positive number, found {value}")


def _print_figures(title: str, table: dict[str, dict[str, float]], json: bool) -> None:
    if json:
        print(json_format.dumps(table, indent=2))
        return
    shown = (
        "ssim_median",
        "ssim_spread",
        "ssim_mean",
        "ssim_p05",
        "psnr_mean",
        "mae_mean",
        "aoa_error_median_deg",
        "parameters",
        "training_seconds",
        "milliseconds_per_spectrum",
    )
    _print_rows(title, [{"": name, **{key: row.get(key, "") for key in shown}} for name, row in table.items()])


def _rule(text: str) -> tuple[str, str]:
    pattern, separator, material = text.rpartition("=")
    if not separator:
        raise InputError(f"--material: expected NODE=MATERIAL, found {text}")
    return pattern, material


def _boresight(orientation: np.ndarray) -> list[float]:
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(orientation).apply([0, 0, 1]).round(3).tolist()


def _print_table(title: str, columns: dict[str, dict]) -> None:
    table = Table(title=title)
    table.add_column("")
    for name in columns:
        table.add_column(name.replace("_", " "))
    for row in next(iter(columns.values())):
        values = (column.get(row, "") for column in columns.values())
        table.add_row(row, *(f"{value:.4g}" if isinstance(value, float) else str(value) for value in values))
    Console().print(table)


def _print_rows(title: str, rows: list[dict]) -> None:
    table = Table(title=title)
    for name in rows[0]:
        table.add_column(name)
    for row in rows:
        table.add_row(*(f"{value:.4g}" if isinstance(value, float) else str(value) for value in row.values()))
    Console().print(table)


def main() -> None:
    """Run a command; turn what a user can mend into one sentence."""
    commands = {
        command.__name__: command
        for command in (
            demo,
            scene,
            simulate,
            check,
            train,
            evaluate,
            crossvalidate,
            predict,
            export,
            compare,
            ablate,
            sweep,
        )
    }
    try:
        tyro.extras.subcommand_cli_from_dict(commands, prog="bisplat", description=__doc__)
    except InputError as error:
        print(f"bisplat: {error}", file=sys.stderr)
        raise SystemExit(1) from None
    except BrokenPipeError:  # the reader of our output has had enough
        raise SystemExit(1) from None
    except OSError as error:
        print(f"bisplat: {error.filename or 'file'}: {error.strerror or error}", file=sys.stderr)
        raise SystemExit(1) from None
    except KeyboardInterrupt:
        print("bisplat: interrupted; the same command again goes on from here", file=sys.stderr)
        raise SystemExit(130) from None


if __name__ == "__main__":
    main()
