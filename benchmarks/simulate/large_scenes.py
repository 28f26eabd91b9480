"""How long do imports and spectra of large scenes take, beside Sionna's path solver, and how does that grow?

python -m benchmarks.simulate.large_scenes --json > runs/large_scenes.json

The scenes are those of Sionna RT, streets of detached houses, and scans of one furnished room (6 mm of noise, with
holes) at 3.5 GHz, with 4 × 4 elements. Each step is a process of its own, from its start: the import, the first five
spectra of ``simulate`` with its defaults, and the same five transmitters by Sionna's ``PathSolver``, with the same
depth, diffraction, its own other defaults, and elements at their true positions. A further spectrum is the mean of a
hundred more in the same process, for the path solver of five more. Seconds are those of the processor, and a step that
takes more than ``--limit`` of them, or 12 GB, is "not done". ``growth`` is the exponent of the number of houses or
triangles in a fit of the seconds.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from itertools import zip_longest
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import tyro

from benchmarks.ledger.large_places import write_scan, write_street
from benchmarks.ledger.printing import print_figures
from scenes.importing.mitsuba_xml import sionna_scene
from scenes.storage.scene_yaml import load_scene
from simulate.rays.core.propagation import Propagation

FREQUENCY, SPECTRA, FURTHER = 3.5e9, 5, 100
MEMORY = 12_000_000_000
"""Most bytes of a process."""

UNITS = "s", "s by the clock", "GB", "ms for one more"
"""Of the figures of each step. The import has no last one."""

NOT_DONE = "not done"

MODULE = "benchmarks.simulate.large_scenes"

BEGAN = "BENCHMARK_BEGAN"
"""Environment variable with the time of day at which a process was started."""

Triple = tuple[float, float, float]


class Place(NamedTuple):
    """Where the antennas of a scene are, metres."""

    gateway: Triple
    boresight: Triple
    region_min: Triple  # lowest corner of the transmitter region
    region_max: Triple  # highest corner


CANYON = Place((-20, 0, 6), (1, 0, -0.2), (-5, -6, 1.2), (15, 6, 2))
OF_SIONNA = {
    "box": Place((-4, 0, 2.5), (1, 0, 0), (-2, -3, 1), (3, 3, 2)),
    "simple_street_canyon": CANYON,
    "simple_street_canyon_with_cars": CANYON._replace(region_min=(-5, -6, 2.2), region_max=(15, 6, 3)),
    "etoile": Place((0, -20, 6), (1, 1, -0.2), (10, -10, 1.2), (30, 10, 2)),
    "munich": Place((20, 70, 6), (1, 0.8, -0.2), (35, 80, 1.2), (55, 100, 2)),
    "florence": Place((5, 0, 6), (0, -1, -0.1), (0, -55, 1.2), (12, -40, 2)),
    "san_francisco": Place((80, 65, 16), (1, 0.3, -0.2), (96, 66, 11.2), (112, 80, 12)),
}
STREET = Place((-20, 0, 6), (1, 0, -0.2), (-10, -3, 1.2), (15, 3, 2))
ROOM = Place((0.5, 0.8, 1.6), (1, 0.3, 0), (2.4, 1.5, 1), (4, 2.6, 1.6))
EVERY = (
    *OF_SIONNA,
    *(f"street of {houses}" for houses in (50, 200, 500, 1000)),
    *(f"scan of {triangles}" for triangles in (20_000, 200_000)),
)
"""The scenes, with the number of houses or triangles."""


def by_bisplat(scene: str, folder: str, rays: int) -> None:
    """The first five spectra of a scene, then further ones with the same tracer."""
    from simulate.engines.rays_engine import Rays
    from simulate.generation.dataset_parts import make_part
    from simulate.generation.generate import generate
    from simulate.generation.simulation import request_for
    from simulate.generation.simulation_options import Simulation

    kept: list[Any] = []

    class Kept(Rays):
        def tracer(self, *given):
            kept.append(super().tracer(*given))
            return kept[-1]

    place, engine = load_scene(scene), Kept(Propagation(rays=rays))
    generate(request_for(place, Simulation(n=SPECTRA), engine, 0), Path(folder))
    tell()
    request = request_for(place, Simulation(n=SPECTRA + FURTHER), engine, 0)
    make_part(request, kept, 0, SPECTRA)
    before = time.process_time()
    make_part(request, kept, SPECTRA, FURTHER)
    print(1e3 * (time.process_time() - before) / FURTHER)


def by_sionna(scene: str, xml: str, rays: int) -> None:
    """The same transmitters by Sionna's path solver, then as many others. ``xml`` is empty for a mesh."""
    from simulate.positions.placement import place
    from simulate.rays.core.ray_tracer import dr, mi, rt
    from simulate.rays.core.sionna_scene import build_scene, gateway_antennas

    described = load_scene(scene)
    sionna = rt.load_scene(xml) if xml else build_scene(described)
    sionna.frequency = described.frequency
    sionna.rx_array, sionna.tx_array = (
        rt.PlanarArray(num_rows=side, num_cols=side, pattern="iso", polarization="V") for side in (4, 1)
    )
    gateway, angles = described.gateway.position, gateway_antennas(described).angles
    sionna.add(rt.Receiver("gateway", mi.Point3f(*map(float, gateway)), mi.Point3f(*map(float, angles))))
    solver, positions = rt.PathSolver(), place(described, "uniform", SPECTRA, 0)
    for name, position in enumerate(positions):
        sionna.add(rt.Transmitter(f"transmitter {name}", mi.Point3f(*map(float, position))))

    def solve() -> None:
        paths = solver(
            sionna,
            max_depth=Propagation().max_depth,
            samples_per_src=rays,
            max_num_paths_per_src=rays,
            synthetic_array=False,
            diffraction=True,
        )
        dr.eval(paths.a, paths.tau)
        dr.sync_thread()

    solve()
    tell()
    before = time.process_time()
    solve()
    print(1e3 * (time.process_time() - before) / SPECTRA)


def tell() -> None:
    """Print what this process has taken: seconds of the processor and of the clock, and gigabytes."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    print(usage.ru_utime + usage.ru_stime, time.time() - float(os.environ[BEGAN]), usage.ru_maxrss * 1024 / 1e9)
    sys.stdout.flush()


def took(limit: float, *command: str) -> tuple[list[float], list[float]]:
    """What a process took until its end (none if it failed), as ``tell`` counts, and the numbers that it printed."""

    def bounded() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit) + 5))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))

    began = time.time()
    with tempfile.TemporaryFile("w+") as printed, tempfile.TemporaryFile("w+") as said:
        streams: dict[str, Any] = {"stdout": printed, "stderr": said, "env": {**os.environ, BEGAN: str(began)}}
        process = subprocess.Popen([sys.executable, *command], preexec_fn=bounded, **streams)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        printed.seek(0)
        said.seek(0)
        if process.returncode != 0:
            print(f"{' '.join(command)}: status {process.returncode}: {said.read()[-500:]}", file=sys.stderr)
        whole = [usage.ru_utime + usage.ru_stime, time.time() - began, usage.ru_maxrss * 1024 / 1e9]
        words = printed.read().split()
        return ([] if process.returncode else whole), [float(word) for word in words if command[0] == "-c"]


def row_of(name: str, folder: Path, limit: float, rays: int) -> dict[str, Any]:
    """All that is measured in a scene."""
    place, xml, options = OF_SIONNA.get(name, STREET), "", ["--frequency", str(FREQUENCY)]
    kind, _, size = name.partition(" of ")
    if name in OF_SIONNA:
        file, xml = f"sionna:{name}", str(sionna_scene(f"sionna:{name}"))
    elif kind == "street":
        file = xml = str(write_street(folder, int(size)))
    else:
        file, place = str(write_scan(folder / "scan.ply", int(size))), ROOM
        options += ["--default-material", "concrete"]
    for option, value in place._asdict().items():
        options += [f"--{option.replace('_', '-')}", *map(str, value)]
    scene, data = str(folder / "scene" / "scene.yaml"), str(folder / "data")
    found: dict[str, list[float]] = {}
    found["import"], _ = took(limit, "-m", "bisplat", "scene", file, "-o", str(folder / "scene"), *options)
    row: dict[str, Any] = {}
    if found["import"]:
        read = load_scene(scene)
        row = {"triangles": read.triangles, "objects": len(read.objects)}
        for heading, function, more in (("first five", by_bisplat, data), ("Sionna", by_sionna, xml)):
            code = f"from {MODULE} import {function.__name__} as run; run({scene!r}, {more!r}, {rays})"
            _, found[heading] = took(limit, "-c", code)
    for heading in ("import", "first five", "Sionna"):
        for unit, value in zip_longest(UNITS[: 3 if heading == "import" else 4], found.get(heading, [])):
            row[f"{heading}, {unit}"] = NOT_DONE if value is None else round(value, 2)
    return row


def growth(rows: dict[str, dict[str, Any]], kind: str, column: str) -> float | None:
    """Exponent of a power law through the figures of a column over the sizes of streets or scans; None without two."""
    found = {int(name.split()[-1]): row[column] for name, row in rows.items() if name.startswith(kind)}
    done = [(size, value) for size, value in found.items() if value != NOT_DONE]
    return round(float(np.polyfit(*np.log(done).T, 1)[0]), 2) if len(done) > 1 else None


def main(
    scenes: tuple[str, ...] = EVERY,
    limit: float = 300,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Measure large scenes."""
    scenes = ("box", "street of 2", "street of 4") if smallest else scenes
    rows: dict[str, dict[str, Any]] = {}
    for name in scenes:
        with tempfile.TemporaryDirectory() as folder:
            rows[name] = row_of(name, Path(folder), limit, 10_000 if smallest else Propagation.rays)
        print(f"{name}: {rows[name]}", file=sys.stderr)
    figures: dict[str, Any] = dict(rows)
    for kind in ("street", "scan"):
        for heading in ("import", "first five", "Sionna"):
            figures[f"growth of {heading} with {kind}"] = growth(rows, kind, f"{heading}, {UNITS[0]}")
    print_figures(figures, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
