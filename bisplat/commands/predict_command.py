"""The command ``bisplat predict``: spectra at positions, or maps of received powers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from tyro.conf import OmitArgPrefixes, Positional

from bisplat.commands.common_options import Force, require_new
from bisplat.commands.idle_options import given_options, refuse_idle
from bisplat.commands.simulate_command import Output
from scenes.files.errors import InputError, ParameterError, printable
from scenes.files.long_work import doing
from scenes.files.options import changed
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import say


@dataclass(frozen=True)
class MapOptions:
    """A map of received powers (RSSI) at a height, with 90 % intervals, as arrays and figures.

    Attributes:
        map: map the powers of every gateway. The source is then a run of received powers, or their folder: the method
            learns from all of its positions.
        height: z of the map, metres (default: the median of the known positions).
        step: side of a cell, metres.
        region: smallest x and y, then largest x and y of the map, metres, within which every cell is predicted
            (default: the convex hull of the known positions).
        method: of a folder, name of the method, as for bisplat compare. Only twin traces rays; otherwise, walls count
            as far as the measured powers show them.
        scene: scene whose walls are drawn, and which the method twin traces: a built-in name or a scene YAML (default,
            for the walls: that of the folder, if any).
    """

    map: bool = False
    height: float | None = None
    step: float = 0.1
    region: tuple[float, float, float, float] | None = None
    method: str = "helmholtz"
    scene: str | None = None


def predict(
    source: Positional[Path],
    output: Output,
    positions: Path | None = None,
    dtype: Literal["float32", "uint8"] = "float32",
    mapped: OmitArgPrefixes[MapOptions] = MapOptions(),
    force: Force = False,
) -> None:
    """Predict what a run has learned, or map received powers (RSSI).

    Of spectra, the .npz file holds spectra [K, 90, 360]. If they are known, it also holds the standard deviation of
    each spectrum's values, deviation [K], and, if the model predicts them, the element responses, channels
    [K, elements]. Of received powers it holds powers [K, gateways] in dBm, and of responses over a band responses
    [K, elements, subcarriers], with low and high, the ends of the 90 % interval, or deviation [K], if the method states
    them.

    Args:
        source: the run folder. With --map, a run of received powers, or their folder.
        output: the .npz file to write; with --map, the new folder.
        positions: CSV file with the header x,y,z, in metres, in the dataset's world frame.
        dtype: numbers of the spectra: float32, 0 to 1, or uint8, grey levels 0 to 255, a quarter of the size.
        mapped: a map of received powers.
    """
    if mapped.map:
        refuse_idle(given_options(predict, locals()), ["positions", "dtype"], "with --map")
        map_powers(source, output, mapped, force)
        return
    refuse_idle(changed(mapped), changed(mapped), "without --map")
    if positions is None:
        raise ParameterError("positions", "expected a CSV file of positions, or --map, found neither")
    if output.suffix.lower() != ".npz":
        raise InputError(f"{output}: expected a name that ends in .npz, since the file holds several arrays")
    require_new(output, force=force)
    from learn.training.config import learned_quantity

    if learned_quantity(source) not in (None, "spectrum"):
        refuse_idle(given_options(predict, locals()), ["dtype"], "for other quantities than spectra")
        predict_values(source, positions, output)
        return
    predict_spectra(source, positions, output, dtype)


def predict_values(folder: Path, positions: Path, output: Path) -> None:
    """Write the powers or responses that a run predicts at positions."""
    from learn.fitted.runs import load_run
    from scenes.files.npz_file import write_arrays
    from simulate.positions.positions import read_points

    run: Any = load_run(folder)
    points = read_points(positions)
    found, quantity = run.predict(points), run.fitted.quantity
    parts = {"low": found.low, "high": found.high, "deviation": found.deviation}
    stated = {name: values for name, values in parts.items() if values is not None}
    write_arrays(output, {Path(quantity.file).stem: found.value, **stated})
    print(printable(f"{quantity.in_words} at {len(points)} positions: {output}"))


def predict_spectra(folder: Path, positions: Path, output: Path, dtype: Literal["float32", "uint8"]) -> None:
    """Write the spectra that a run predicts at positions."""
    from learn.training.run_folder import load_spectra
    from scenes.files.npz_file import write_arrays
    from simulate.positions.positions import reach_warning, read_points

    run = load_spectra(folder)
    points = read_points(positions)
    region = run.model.region.cpu().numpy()
    warning = reach_warning(points, region, "the training positions", "predictions there are guesses")
    if warning is not None:
        say(f"warning: {positions}: {warning}")
    doing(f"{output}: predicting {len(points):,} spectra")
    prediction, deviation = run.predict(points, dtype), run.deviation(points)
    arrays = {"spectra": prediction.spectra}
    if prediction.responses is not None:
        arrays["channels"] = prediction.responses
    if deviation is not None:
        arrays["deviation"] = deviation.astype("float32")
    write_arrays(output, arrays)
    print(printable(f"{len(points)} spectra: {output}"))


def map_powers(powers: Path, output: Path, options: MapOptions, force: bool) -> None:
    """Write maps of received powers."""
    from learn.fitted.coverage import coverage_map
    from learn.fitted.fitted_method import fit_method
    from learn.fitted.runs import load_run
    from learn.methods.method_table import TWIN
    from learn.reports.coverage_report import write_coverage_files
    from learn.training.config import learned_quantity
    from learn.training.fit_progress import FitProgress
    from scenes.storage.scene_yaml import load_scene

    drawn = None if options.scene is None else load_scene(options.scene)
    with new_folder(output, force) as unfinished:
        fitted: Any = powers
        if learned_quantity(powers) is not None:
            fitted = load_run(powers)
        elif options.method == TWIN:
            fitted = fit_method(powers, "power", TWIN, scene=drawn)
        with FitProgress("coverage") as report:
            found = coverage_map(
                fitted,
                height=options.height,
                step=options.step,
                region=options.region,
                method=options.method,
                report=report,
            )
        write_coverage_files(found, unfinished, drawn)
    columns, rows = len(found.x), len(found.y)
    gateways = len(found.median)
    print(
        printable(
            f"{gateways} gateway{'s' * (gateways > 1)}, {columns} × {rows} cells of {found.step:g} m at "
            f"z = {found.height:.2f} m: {output}"
        )
    )
