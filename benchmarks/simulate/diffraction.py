"""How far Sionna's diffraction is from the exact field beside a conducting half-plane, and why.

python -m benchmarks.simulate.diffraction --figure docs/generated/diffraction.png --json

A source is 8 m from the edge of a large metal sheet. The receivers lie on a half circle of 5 m on either side of the
sheet. The antennas are isotropic and polarised along the edge (V) or across it (H). The frequency is 915 MHz.

The error is the root mean square error of the field, relative to the root mean square of the field without the sheet.
It is measured for several angles of incidence in four regions: within 15° of the reflection boundary, within 15° of the
shadow boundary, between them, and beyond them. Four methods are compared: geometric optics alone, Sionna's diffraction
in the shadow only, Sionna's diffraction in the lit region too, and the latter with the coefficients of [luebbers1984]
(documentation: A defect of Sionna's diffraction).
"""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro

from benchmarks.ledger.exact_fields import half_plane_green
from benchmarks.ledger.printing import print_figures
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import SPEED_OF_LIGHT, Scene, SceneObject
from scenes.scene.materials import RadioMaterial
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet

FREQUENCY = 915e6
WAVELENGTH = SPEED_OF_LIGHT / FREQUENCY
SOURCE_DISTANCE, RECEIVER_DISTANCE = 8.0, 5.0
"""Metres from the edge."""

WIDTH = 15.0
"""Degrees on either side of a boundary that count as near it."""

SHADOW = {"diffraction": True, "edge_diffraction": True, "diffraction_lit_region": False}
EVERYWHERE = {**SHADOW, "diffraction_lit_region": True}
METHODS: dict[str, tuple[dict[str, bool], bool]] = {
    "geometric optics": ({"diffraction": False}, False),
    "diffraction in the shadow": (SHADOW, False),
    "diffraction": (EVERYWHERE, False),
    "diffraction, mended": (EVERYWHERE, True),
}
"""Arguments of ``PathSolver``, and whether Sionna is mended."""

MENDED = {
    # Sionna: R₀ (d1 − d4) + Rₙ (d2 − d3), with Rₙ = −1 for wide wedges; Luebbers: −(d1 + d2) + R₀ d4 + Rₙ d3.
    "d14 = d1 - d4": "d14 = d4",
    "d23 = d2 - d3": "d23 = d3; d12 = d1 + d2",
    "real = r_0_real_d14 + r_n_real_d23": "real = r_0_real_d14 + r_n_real_d23 - d12.real * mi.Matrix2f(1, 0, 0, 1)",
    "imag = r_0_imag_d14 + r_n_imag_d23": "imag = r_0_imag_d14 + r_n_imag_d23 - d12.imag * mi.Matrix2f(1, 0, 0, 1)",
    "wide_exterior = exterior_angle > dr.pi + phi_prime": "wide_exterior = mi.Bool(False)",
}
"""Lines of ``RadioMaterial._diffraction_matrix`` of sionna-rt 2.2.0, and what they should be."""


def half_plane() -> Scene:
    """The sheet x = 0, y < 0 of metal, so large that its other edges do not matter."""
    plate = SceneObject("plate", sheet((0, -60, -60), (0, 60, 0), (0, 0, 120)), "metal")
    gateway, region = Gateway((1, 1, 0), facing((-1, 0, 0))), Transmitter((-1, -1, -1), (1, 1, 1))
    return Scene("half-plane", FREQUENCY, gateway, region, (plate,), {"metal": RadioMaterial("metal", 1.0, 1e7, 0.002)})


def around_edge(radius: float, degrees: np.ndarray) -> np.ndarray:
    """Places [K, 3] around the edge, at angles from the sheet's illuminated side, which is x < 0."""
    angle = np.radians(degrees)
    return np.stack([-radius * np.sin(angle), -radius * np.cos(angle), np.zeros_like(angle)], axis=-1)


@contextmanager
def mended() -> Iterator[None]:
    """Sionna with the lines of ``MENDED``."""
    from sionna.rt.radio_materials import radio_material as module

    original = module.RadioMaterial._diffraction_matrix
    source = textwrap.dedent(inspect.getsource(original))
    for line, instead in MENDED.items():
        assert line in source, f"this version of sionna-rt has no line {line!r}"
        source = source.replace(line, instead)
    names = dict(vars(module))
    exec(source, names)
    module.RadioMaterial._diffraction_matrix = names["_diffraction_matrix"]
    try:
        yield
    finally:
        module.RadioMaterial._diffraction_matrix = original


def traced(
    source: np.ndarray, places: np.ndarray, polarisation: str, rays: int, options: dict[str, bool]
) -> np.ndarray:
    """Responses [K] by ``PathSolver``."""
    from simulate.rays.core.ray_tracer import mi, rt
    from simulate.rays.core.sionna_scene import build_scene

    scene = build_scene(half_plane())
    scene.tx_array = scene.rx_array = rt.PlanarArray(num_rows=1, num_cols=1, pattern="iso", polarization=polarisation)
    scene.add(rt.Transmitter("source", mi.Point3f(*map(float, source)), mi.Point3f(0, 0, 0)))
    for number, place in enumerate(places):
        scene.add(rt.Receiver(f"receiver-{number}", mi.Point3f(*map(float, place)), mi.Point3f(0, 0, 0)))
    paths = rt.PathSolver()(
        scene,
        max_depth=1,
        samples_per_src=rays,
        max_num_paths_per_src=1_000_000,
        synthetic_array=False,
        refraction=False,
        **options,
    )
    real, imaginary = (part.numpy().astype(np.float64) for part in paths.a)
    delay = np.maximum(paths.tau.numpy().astype(np.float64), 0)
    turned = (real + 1j * imaginary) * np.exp(-2j * np.pi * FREQUENCY * delay)
    return turned.sum(axis=-1).reshape(len(places))


def exact(source: np.ndarray, places: np.ndarray, polarisation: str) -> np.ndarray:
    """λ G [K] of the scalar wave: the electric field along the edge (V), or the magnetic field along it (H).

    In H the unit vectors φ of the antennas at both ends of a path are opposite, hence the minus sign.
    """
    image: Literal[-1, 1] = -1 if polarisation == "V" else 1
    return -image * WAVELENGTH * half_plane_green(source, places, 2 * np.pi / WAVELENGTH, image)


def draw(degrees: np.ndarray, fields: dict[str, np.ndarray], incidence: float, path: Path) -> None:
    """Draw the level of all fields, and of the exact one, against the angle."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(9, 4.5), layout="constrained")
    for name, style in (
        ("exact", "k-"),
        ("geometric optics", "C7:"),
        ("diffraction", "C3--"),
        ("diffraction, mended", "C0--"),
    ):
        axes.plot(
            degrees,
            20 * np.log10(np.maximum(np.abs(fields[name]), 1e-9)),
            style,
            label=name,
            linewidth=2.5 if name == "exact" else 1.5,
        )
    for boundary, name in ((180 - incidence, "reflection boundary"), (180 + incidence, "shadow boundary")):
        axes.axvline(boundary, color="0.8", zorder=0)
        axes.text(boundary + 1, -84, name, color="0.4")
    axes.set(xlabel="angle around the edge (°)", ylabel="channel gain (dB)", ylim=(-85, -42))
    axes.legend(loc="lower left")
    figure.savefig(path, dpi=120)


def main(
    incidences: tuple[float, ...] = (30.0, 60.0, 84.0),
    rays: int = 300_000,
    figure: Path | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare Sionna's field beside a half-plane with the exact one."""
    degrees = np.arange(3.0, 358.0, 40.0 if smallest else 2.0)
    incidences = incidences[:2] if smallest else incidences
    places = around_edge(RECEIVER_DISTANCE, degrees)
    result: dict[str, Any] = {}
    for incidence in incidences:
        source = around_edge(SOURCE_DISTANCE, np.array([incidence]))[0]
        reflection, shadow = np.abs(degrees - (180 - incidence)), np.abs(degrees - (180 + incidence))
        regions = {
            "reflection boundary": reflection <= WIDTH,
            "between": (degrees > 180 - incidence + WIDTH) & (degrees < 180 + incidence - WIDTH),
            "shadow boundary": shadow <= WIDTH,
            "shadow": degrees > 180 + incidence + WIDTH,
            "reflected": degrees < 180 - incidence - WIDTH,
        }
        free = WAVELENGTH / (4 * np.pi * np.linalg.norm(places - source, axis=1))
        for polarisation in "VH":
            fields = {"exact": exact(source, places, polarisation)}
            for name, (options, to_mend) in METHODS.items():
                with mended() if to_mend else nullcontext():
                    fields[name] = traced(source, places, polarisation, rays, options)
                error = np.abs(fields[name] - fields["exact"])
                result[f"{incidence:g}°, {polarisation}, {name}"] = {
                    region: round(float(np.sqrt((error[where] ** 2).mean() / (free[where] ** 2).mean())), 3)
                    if where.any()
                    else None
                    for region, where in regions.items()
                }
            if figure is not None and polarisation == "V" and incidence == incidences[1]:
                draw(degrees, fields, incidence, figure)
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
