"""What do bands, several frequencies and moving receivers cost, and how right are they?

python -m benchmarks.simulate.quantities --json

Times are ratios to one frequency in the same run. Errors are root mean square differences over positions and elements,
relative to the truth, dB. A subcarrier's own simulation keeps the permittivity and the conductivity of the materials,
as a band does, and the array's size in metres. It follows the chains that were found at the carrier, as the band does,
or those of a search of its own. In full wave the band comes from one run, and a subcarrier's own simulation is a run at
that frequency. Several frequencies in full wave come from one run, too. A frequency's own run has the materials of that
frequency, and times are those of the processor. Rays and full wave are compared by the correlation over the elements,
at the median of 400 positions.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import tyro
from jaxtyping import Complex, Float

from benchmarks.ledger.one_run import closed_box, off_db, one_run_of
from benchmarks.ledger.printing import print_figures
from benchmarks.ledger.smallest_room import smallest_room
from scenes.scene.description import Scene, with_same_array
from scenes.storage.scene_yaml import load_scene
from simulate.generation.reciprocity import element_offsets, reciprocal
from simulate.spectra.band import Band

if TYPE_CHECKING:
    from simulate.rays.chain_solver import Found

BAND = Band(20e6, 64)
TEN = tuple(float(each) for each in np.linspace(0.902e9, 0.928e9, 10))
"""The American RFID band, at whose frequencies all materials of the table are known."""

COMPARED = Band(78e6, 13)
"""Frequencies at which rays and full wave are compared."""

NEAR = (0.905e9, 0.915e9, 0.925e9)
"""Frequencies that one run of full wave solves together, with the materials of the middle one."""

APART = (0.92, 1.1, 1.2)
"""Further frequencies of a run in a closed box, relative to that whose materials it has."""

COARSE = 0.03
"""Metres. Cells with which the times of full-wave runs are compared."""

ASIDE = -0.0137, -0.0211, 0.0073
"""How far the fixed antenna is moved to compare moving arrays with fixed ones, metres."""

POSITIONS, PAIRS = 100, 30


def at(scene: Scene, frequency: float) -> Scene:
    """The scene at another frequency, with the same values of its materials and the same array in metres."""
    spacing = scene.gateway.spacing * frequency / scene.frequency
    return replace(scene, frequency=float(frequency), gateway=replace(scene.gateway, spacing=spacing))


def seconds(job: Callable[[], Any], repeats: int) -> float:
    """Seconds of the fastest of some calls, after one that compiles."""
    job()
    best = np.inf
    for _ in range(repeats):
        began = time.perf_counter()
        job()
        best = min(best, time.perf_counter() - began)
    return best


def by_rays(scene: Scene, positions: Float[np.ndarray, "K 3"], repeats: int) -> dict[str, Any]:
    """Times and errors of a band and of several frequencies."""
    from simulate.rays.core.propagation import Propagation
    from simulate.rays.tracer import Tracer

    tracer = Tracer(scene, Propagation())
    others = [tracer.at_frequency(at(scene, frequency)) for frequency in TEN]
    one = seconds(lambda: tracer.responses(positions), repeats)
    band = seconds(lambda: tracer.band_responses(positions, BAND), repeats)
    ten = seconds(lambda: [each.responses(positions) for each in others], repeats)
    found = tracer.band_responses(positions, BAND)
    figures: dict[str, Any] = {
        "64 subcarriers over 20 MHz, time of one frequency": (band / one, "at most 1.5"),
        "ten frequencies, time of one": (ten / one, "at most 10"),
    }
    for number in (0, BAND.subcarriers - 1):
        own = at(scene, BAND.frequencies(scene.frequency)[number])
        name = f"subcarrier {number} of the band, error"
        same = off_db(found[..., number], tracer.at_frequency(own).responses(positions))
        searched = off_db(found[..., number], Tracer(own, Propagation()).responses(positions))
        figures[f"{name} (dB)"] = (same, "at most -40")
        figures[f"{name} against a search of its own (dB)"] = (searched, "")
    return figures


def reciprocity(scene: Scene, positions: Float[np.ndarray, "K 3"], diffraction: bool) -> dict[str, Any]:
    """How far a moving array's responses are from those of a fixed one at the same pairs of places."""
    from simulate.rays.core.propagation import Propagation
    from simulate.rays.tracer import Tracer

    # Built-in places have round numbers, so that some rays from their gateways meet an edge exactly.
    gateway = np.asarray(scene.gateway.position) + ASIDE
    scene = replace(scene, gateway=replace(scene.gateway, position=tuple(gateway.tolist())))
    offsets = element_offsets(scene.gateway, scene.wavelength)
    propagation = Propagation(diffraction=diffraction)
    moves = Tracer(reciprocal(scene, scene.gateway.position), propagation)
    found = from_target_to_source(moves.found)
    errors = []
    for place in positions:
        stands = Tracer(replace(scene, gateway=replace(scene.gateway, position=tuple(place))), propagation, found=found)
        expected = stands.responses(gateway[None])[0]
        moved = moves.responses(place + offsets)[:, 0]
        errors.append(float(np.linalg.norm(moved - expected) / np.linalg.norm(expected)))
    name = f"moving array against a fixed one{', with diffraction' if diffraction else ''}, error"
    return {
        f"{name}, median": (np.median(errors), "at most 1e-5"),
        f"{name}, largest": (np.max(errors), "at most 1e-5"),
    }


def from_target_to_source(found: Found) -> Found:
    """The same chains, followed from their targets to their sources."""
    from simulate.rays.core.shooting import reversed_sequences

    assert found.reflected is not None
    reflected, diffracted = np.ascontiguousarray(reversed_sequences(found.reflected)), found.diffracted
    if diffracted is None:
        return found._replace(reflected=reflected)
    links = diffracted.links
    diffracted = replace(
        diffracted,
        near=diffracted.far,
        far=diffracted.near,
        pairs=np.ascontiguousarray(diffracted.pairs[:, ::-1]),
        links=replace(links, edges=links.edges[:, ::-1].copy(), faces=links.faces[:, ::-1].copy()),
    )
    return found._replace(reflected=reflected, diffracted=diffracted)


def in_full_wave(scene: Scene, positions: Float[np.ndarray, "K 3"], cell: float) -> dict[str, Any]:
    """Time and error of a band from one run of one element."""
    from simulate.fullwave.cells import edge_materials
    from simulate.fullwave.element_fields import element_fields
    from simulate.fullwave.run_plan import plan

    def run(place: Scene, band: Band | None) -> tuple[Any, float]:
        planned = plan(place, scene.transmitter.region, cell, band)
        materials = edge_materials(place, planned.grid)
        began = time.perf_counter()
        field = element_fields(planned, [0], materials)[0]
        return field, time.perf_counter() - began

    run(scene, None)  # compiles
    (alone, one), (field, whole) = run(scene, None), run(scene, BAND)
    found = field.band_responses(positions, BAND)
    figures: dict[str, Any] = {
        "full wave of 64 subcarriers, time of one frequency": (whole / one, "at most 1.3"),
        "full wave, carrier of the band, error (dB)": (
            off_db(found[..., BAND.carrier], alone.responses(positions)),
            "",
        ),
    }
    for number in (0, BAND.subcarriers - 1):
        own, _ = run(at(scene, BAND.frequencies(scene.frequency)[number]), None)
        error = off_db(found[..., number], own.responses(positions))
        figures[f"full wave, subcarrier {number} of the band, error (dB)"] = (error, "")
    return figures


def frequencies_in_full_wave(scene: Scene, smallest: bool) -> dict[str, Any]:
    """Time and errors of several frequencies from one run, in a scene and in a closed box."""
    generator = np.random.default_rng(1)
    figures: dict[str, Any] = {}
    scenes = [with_same_array(scene, each) for each in NEAR]
    low, high = scene.transmitter.region
    positions = generator.uniform(low, high, (POSITIONS, 3))
    whole, errors = one_run_of(scenes, 1, positions, COARSE)
    figures["full wave of three frequencies, time of one"] = (whole, "at most 1.3")
    for frequency, _, error in errors:
        figures[f"full wave, {frequency / 1e6:.0f} MHz of three, error (dB)"] = (error, "at most -40")
    if smallest:
        return figures
    box = closed_box(1e9)
    scenes = [box, *(with_same_array(box, share * 1e9) for share in APART)]
    low, high = box.transmitter.region
    positions = generator.uniform(low, high, (POSITIONS, 3))
    for frequency, difference, error in one_run_of(scenes, 0, positions, 0.02)[1]:
        name = f"box, {frequency / 1e6:.0f} MHz from a run with the materials of 1 GHz"
        figures[f"{name}, difference of a refractive index (%)"] = (100 * difference, "")
        figures[f"{name}, error (dB)"] = (error, "")
    return figures


def rays_and_full_wave(
    scene: Scene, positions: Float[np.ndarray, "K 3"], cell: float | None, folder: Path
) -> dict[str, Any]:
    """The correlation of rays with full wave at several frequencies, of which full wave needs one run."""
    from simulate.engines.fullwave_engine import FullWave
    from simulate.generation.simulation import simulate
    from simulate.rays.core.propagation import Propagation
    from simulate.rays.tracer import Tracer

    solved = simulate(
        scene,
        folder,
        positions=positions,
        engine=FullWave(cell=cell),
        bandwidth=COMPARED.bandwidth,
        subcarriers=COMPARED.subcarriers,
    )
    truth = solved.band_responses
    assert truth is not None
    # Rays between the antennas of full wave, which are short dipoles.
    dipoles = replace(
        scene,
        gateway=replace(scene.gateway, pattern="dipole"),
        transmitter=replace(scene.transmitter, pattern="dipole"),
    )
    traced = Tracer(dipoles, Propagation()).band_responses(solved.positions, COMPARED)
    return {
        f"rays and full wave at {frequency / 1e6:.0f} MHz, correlation": (
            np.median(_correlation(traced[..., number], truth[..., number])),
            "at least 0.984",
        )
        for number, frequency in enumerate(COMPARED.frequencies(scene.frequency))
        if (number - COMPARED.carrier) % 3 == 0
    }


def _correlation(
    found: Complex[np.ndarray, "K elements"], truth: Complex[np.ndarray, "K elements"]
) -> Float[np.ndarray, " K"]:
    norms = np.linalg.norm(found, axis=1) * np.linalg.norm(truth, axis=1)
    return np.abs((found.conj() * truth).sum(axis=1)) / norms


def main(
    folder: Path = Path("runs/quantities"),
    cell: float | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Measure bands, several frequencies and moving receivers."""
    from simulate.positions.placement import place

    generator = np.random.default_rng(0)
    if smallest:
        room = smallest_room()
        rooms, few = {"lab": room, "closet": room}, 3
    else:
        rooms, few = {name: load_scene(name) for name in ("lab", "closet")}, None
    closet = rooms["closet"]
    cell = COARSE if smallest else cell
    figures: dict[str, Any] = {}
    for name, scene in rooms.items():
        low, high = scene.transmitter.region
        positions = generator.uniform(low, high, (few or POSITIONS, 3))
        measured = by_rays(scene, positions, 1 if smallest else 5)
        for diffraction in (False, True):
            measured |= reciprocity(scene, positions[: few or PAIRS], diffraction)
        figures |= {f"{name}, {label}": each for label, each in measured.items()}
    low, high = closet.transmitter.region
    positions = generator.uniform(low, high, (few or POSITIONS, 3))
    figures |= in_full_wave(closet, positions, COARSE) | frequencies_in_full_wave(closet, smallest)
    with tempfile.TemporaryDirectory() as temporary:
        kept = Path(temporary) / "closet" if smallest else folder
        positions = place(closet, "uniform", few or 400, 1)
        figures |= rays_and_full_wave(closet, positions, cell, kept)
    table = {
        name: {"measured": float(f"{float(value):.4g}"), "wanted": wanted} for name, (value, wanted) in figures.items()
    }
    print_figures(table, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
