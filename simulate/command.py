"""``bisplat simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from scenes.errors import InputError

Output = Annotated[Path, arg(aliases=["-o"])]


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
    propagation = Propagation(max_depth, los, specular, refraction, diffuse, diffraction, rays)
    for number, (name, seen) in enumerate(where.by_gateway().items()):
        folder = output / name if where.further_gateways else output
        measurement = Measurement(snr, gain_error, phase_error, phase_noise)
        request = Request(
            seen, points, how, propagation, seed, measurement, seed + number, power_db
        )  # each array its own errors
        generate(request, folder, workers, ray)
        print(f"{len(points)} spectra: {folder}")
