"""What the demo shows in its first minute: a drawing of the scene, and six spectra traced in a hurry."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float

from learn.reports.figures import draw_spectra
from scenes.scene.description import Scene
from simulate.dataset.dataset import Dataset
from simulate.rays.core.propagation import Propagation
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import array_of
from simulate.spectra.spectrum import picture, spectrum_of

SHOWN = 6
"""Number of spectra to show."""

QUICK = Propagation(max_depth=1, rays=20_000)
"""At most one reflection or diffraction. The search for such paths takes seconds, that for all paths a minute."""


def draw_first_look(scene: Scene, positions: Float[np.ndarray, "K 3"], seed: int, folder: Path) -> None:
    """Trace the spectra of the first positions in a hurry, and draw them as first_look.png.

    Args:
        scene: the scene.
        positions: transmitter positions, of which the first six are shown, metres, world frame.
        seed: seed of the rays.
        folder: folder to write to.

    Raises:
        InputError: libLLVM, which the ray tracer needs, is missing or too old.
    """
    from simulate.rays.tracer import Tracer

    shown = positions[:SHOWN]
    beamformer = Beamformer(array_of(scene.gateway, scene.frequency), AngularGrid())
    responses = Tracer(scene, QUICK, seed=seed).responses(shown)
    spectra = spectrum_of(picture(beamformer.spectrum(responses)))
    draw_spectra(spectra, shown, beamformer.grid, folder / "first_look.png")


def draw_first_spectra(dataset: Dataset, folder: Path) -> None:
    """Draw the first spectra of a dataset as spectra.png.

    Args:
        dataset: the dataset.
        folder: folder to write to.
    """
    draw_spectra(dataset.spectra[:SHOWN], dataset.positions[:SHOWN], dataset.grid, folder / "spectra.png")
