"""Rays against a full-wave dataset: their responses at its positions, and their error on a plane, which is drawn.

python -m benchmarks.ledger.rays_against_full_wave runs/fullwave/closet -o runs/engines --no-diffraction
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from jaxtyping import Complex, Float, Int
from matplotlib.figure import Figure

from learn.data.metrics import Scores, score
from learn.quantities.complex_scores import correlation
from learn.reports.paper import PAGE, at_paper_size, save
from learn.reports.plots import MAGNITUDE
from learn.reports.provenance import Provenance
from scenes.scene.description import Scene
from scenes.storage.scene_yaml import read_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.rooms_folder import at_its_frequency
from simulate.engines.engine import Setting
from simulate.engines.fullwave_engine import FullWave
from simulate.rays.core.propagation import Propagation
from simulate.spectra.spectrum import evenly, picture, spectrum_of

SEED = 1

POINTS_PER_WAVELENGTH = 12
"""Number of points of the plane per wavelength, along x and along y."""

LOWEST, HIGHEST = -20.0, 5.0
"""Ends of the colour scale of levels and errors on the plane, dB."""


@dataclass(frozen=True)
class EngineComparison:
    """Responses by rays and by full wave at the same K positions."""

    rays: Complex[np.ndarray, "K elements"]
    full_wave: Complex[np.ndarray, "K elements"]
    scores: Scores  # scores of the rays' spectra against those of the full wave

    def metrics(self) -> dict[str, float]:
        """Medians over the positions, and the correlation over all elements and positions together.

        The latter also counts phase errors that differ from position to position.
        """
        power = np.linalg.norm(self.rays, axis=1) / np.maximum(np.linalg.norm(self.full_wave, axis=1), 1e-30)
        together = correlation(self.rays.reshape(1, -1), self.full_wave.reshape(1, -1))[0]
        return {
            "correlation_rays": float(np.median(correlation(self.rays, self.full_wave))),
            "correlation_rays_together": float(together),
            "ssim_rays": float(np.median(self.scores.ssim)),
            "level_bias_db": float(np.median(20 * np.log10(np.maximum(power, 1e-15)))),
        }


def compare_engines(folder: Path, propagation: Propagation, positions: int) -> EngineComparison:
    """Trace the positions of a full-wave dataset by rays, between short dipoles as in full wave."""
    from simulate.rays.tracer import Tracer

    dataset = read_dataset(folder)
    chosen = evenly(np.arange(len(dataset.names)), positions)
    tracer = Tracer(scene_for_rays(dataset), propagation, None, SEED)
    return compare_responses(dataset, chosen, tracer.responses(dataset.positions[chosen]))


def compare_responses(
    dataset: Dataset, chosen: Int[np.ndarray, " K"], rays: Complex[np.ndarray, "K elements"]
) -> EngineComparison:
    """Compare responses by rays with those of a full-wave dataset."""
    traced = spectrum_of(picture(dataset.beamformer.spectrum(rays)))
    scores = score(traced, spectrum_of(dataset.pictures[chosen]), dataset.grid, dataset.array)
    return EngineComparison(rays, dataset.responses[chosen], scores)


def scene_for_rays(dataset: Dataset) -> Scene:
    """The scene in which a full-wave dataset was simulated, with short dipoles as antennas."""
    assert dataset.metadata.get("engine") == "fullwave"
    scene = at_its_frequency(read_scene(dataset.folder / dataset.metadata["scene_file"]), dataset)
    return replace(
        scene,
        gateway=replace(scene.gateway, pattern="dipole"),
        transmitter=replace(scene.transmitter, pattern="dipole"),
    )


@dataclass(frozen=True)
class EnginePlane:
    """Levels and errors on a horizontal plane through the middle of the transmitter region."""

    name: str  # name of the full-wave dataset's folder
    x: Float[np.ndarray, " nx"]  # x of the points' columns, metres
    y: Float[np.ndarray, " ny"]  # y of the points' rows, metres
    z: float  # height of the plane, metres
    level_db: Float[np.ndarray, "ny nx"]  # power of the full wave's responses, relative to its mean over the plane, dB
    # ``|rays − full wave|²`` relative to the same mean, dB, by the largest number of interactions on a path
    errors_db: dict[int, Float[np.ndarray, "ny nx"]]
    # number of paths with at most one interaction to the element nearest the array's centre. Where it changes, a
    # direct or reflected path ends: there is a shadow boundary or a reflection boundary of geometrical optics.
    paths: Int[np.ndarray, "ny nx"]


def compare_on_plane(folder: Path, propagation: Propagation) -> EnginePlane:
    """Compare rays with a full-wave dataset's stored field at the points of a plane.

    The rays follow the direct path alone, then at most one interaction, then as many as ``propagation`` allows.
    """
    from simulate.rays.tracer import Tracer

    dataset = read_dataset(folder)
    scene = scene_for_rays(dataset)
    (x_low, y_low, z_low), (x_high, y_high, z_high) = scene.transmitter.region
    step = scene.wavelength / POINTS_PER_WAVELENGTH
    x, y = (
        np.linspace(low, high, 1 + int(np.ceil((high - low) / step)))
        for low, high in ((x_low, x_high), (y_low, y_high))
    )
    z = (z_low + z_high) / 2
    columns, rows = np.meshgrid(x, y)
    points = np.stack([columns.ravel(), rows.ravel(), np.full(columns.size, z)], axis=1)
    full_wave = FullWave.kept(Setting(scene, scene.transmitter.region, SEED), dataset.folder).responses(points)
    mean = float((np.abs(full_wave) ** 2).sum(axis=1).mean())

    def decibels(responses: Complex[np.ndarray, "K elements"]) -> Float[np.ndarray, "ny nx"]:
        power = (np.abs(responses) ** 2).sum(axis=1) / mean
        return 10 * np.log10(np.maximum(power, 1e-12)).reshape(columns.shape)

    depth = min(1, propagation.max_depth)
    geometric = replace(propagation, max_depth=depth, diffuse=False, diffraction=False, sionna=False)
    followed = {depth: replace(propagation, max_depth=depth) for depth in sorted({0, depth, propagation.max_depth})}
    tracers = {each: Tracer(scene, each, None, SEED) for each in {*followed.values(), geometric}}
    return EnginePlane(
        name=folder.resolve().name,
        x=x,
        y=y,
        z=z,
        level_db=decibels(full_wave),
        errors_db={depth: decibels(tracers[each].responses(points) - full_wave) for depth, each in followed.items()},
        paths=np.count_nonzero(tracers[geometric].middle_by_chain(points), axis=1).reshape(columns.shape),
    )


@at_paper_size()
def draw_plane(plane: EnginePlane, folder: Path) -> None:
    """Draw the full wave's level and the rays' errors as engines_plane, PNG and PDF.

    White lines show where direct or once reflected paths to the array's middle element end.
    """
    errors = {f"error of rays, depth {depth}": values for depth, values in plane.errors_db.items()}
    panels = {"full wave": plane.level_db, **errors}
    figure = Figure(figsize=(PAGE, 2.6), layout="constrained")
    axes = figure.subplots(1, len(panels), sharey=True)
    for axis, (title, values) in zip(axes, panels.items(), strict=True):
        image = axis.pcolormesh(plane.x, plane.y, values, vmin=LOWEST, vmax=HIGHEST, cmap=MAGNITUDE, shading="nearest")
        borders = np.arange(plane.paths.min(), plane.paths.max()) + 0.5
        if len(borders) and min(plane.paths.shape) > 1:  # a region can be a line
            axis.contour(plane.x, plane.y, plane.paths, levels=borders, colors="white", linewidths=1)
        axis.set(title=title, xlabel="x (m)", aspect="equal")
    axes[0].set_ylabel("y (m)")
    figure.colorbar(image, ax=axes, label=f"dB over full wave's mean at z = {plane.z:g} m", extend="both")
    title = f"Rays against the full wave of {plane.name} at z = {plane.z:g} m"
    save(figure, folder / "engines_plane.png", Provenance(title, "rays", plane.name))


def main(
    dataset: tyro.conf.Positional[Path],
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])],
    max_depth: int = Propagation.max_depth,
    diffraction: bool = Propagation.diffraction,
) -> None:
    """Draw the rays' error on a plane of a full-wave dataset."""
    output.mkdir(parents=True, exist_ok=True)
    draw_plane(compare_on_plane(dataset, Propagation(max_depth=max_depth, diffraction=diffraction)), output)


if __name__ == "__main__":
    tyro.cli(main)
