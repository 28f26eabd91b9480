"""The method twin for received powers: rays in a scene that the known powers correct, and kriging of the remainder.

The ray tracer is imported when it fits.
"""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from jaxtyping import Float

from learn.powers.helmholtz_powers import ExplainedPowers
from learn.quantities.known_powers import KnownPowers
from learn.twin.described_gateways import scenes_with_gateways
from scenes.files.errors import require_instance
from scenes.files.long_work import doing
from scenes.files.optional_packages import require_extra
from scenes.files.plain_text import say
from scenes.scene.description import Scene
from scenes.scene.shapes import bounding_box
from scenes.scene.tolerances import Tolerances
from scenes.storage.scene_digest import scene_digest
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.rays.core.propagation import Propagation
from simulate.spectra.spectrum import evenly

if TYPE_CHECKING:
    from learn.twin.calibration import Calibration

FOLLOWED = Propagation(max_depth=2, rays=100_000)
"""Mechanisms that rays follow. A third interaction takes several times as long, and kriging makes up for most of it.
The scene is corrected without diffraction, which would take several times as long, too."""

NO_PATHS = -250.0  # dBm; a traced power below it is that of no path


class TwinPowers(ExplainedPowers):
    """Universal kriging in dB, whose trend is what rays predict in the corrected scene.

    T is the power of the traced field in dB, softened in its fades (``PowerFit.predicted``).

    Errors at known positions are smaller than elsewhere, since these corrected the scene. With γ corrections that the
    powers determine [mackay1992] and N independent powers, the intervals are wider by √((N + γ)/(N − γ)), as the
    prediction error of a linear fit is larger than what it leaves [akaike1970].
    """

    NAME: ClassVar[str] = "twin"
    TAKEN_BY: ClassVar[Literal["linear", "weibull"]] = "weibull"  # right on average even for a few errors

    def __init__(
        self,
        scene: Scene,
        dataset: Dataset,
        tolerances: Tolerances = Tolerances(),
        propagation: Propagation = FOLLOWED,
    ):
        require_extra("rays", "the method twin")
        scenes_with_gateways(scene, dataset)  # refuses what does not fit
        self._scene, self._tolerances, self._followed = scene, tolerances, propagation
        stated = f"{scene_digest(scene)} {tolerances} {propagation}"
        self.source = hashlib.sha256(stated.encode()).hexdigest()[:16]
        # without the powers, some of which are tested
        self._dataset = replace(dataset, names=[], values={}, places=None)

    @classmethod
    def of_scene(cls, scene: Scene | Path | str, dataset: Dataset) -> Callable[[], TwinPowers]:
        """A function that makes a new, unfitted one for the scene as described, which is read once."""
        require_instance(Scene, str, PathLike, scene=scene)
        twin = cls(scene if isinstance(scene, Scene) else load_scene(scene), dataset)
        return partial(copy.copy, twin)

    def _learn(self, known: KnownPowers) -> None:
        from learn.twin.calibrate import CALIBRATED_BY, correct
        from learn.twin.power_residual import PowerResidual, independence, path_powers

        names = [str(number) for number in range(len(known.positions))]
        taught = replace(self._dataset, names=names, values={"power": known.powers}, places=known.positions)
        coarse = replace(self._followed, diffraction=False)
        used = evenly(np.arange(len(known.positions)), CALIBRATED_BY)
        say(f"twin: the powers at {len(used)} positions correct {self._scene.name}, which takes minutes")
        found = correct(self._scene, taught, used, self._tolerances, coarse, report=doing)
        after, before = found.misfit
        say(f"twin: the median error of rays there is {before:.2f} dB as described and {after:.2f} dB as corrected")
        self.calibration: Calibration = found
        self.found = f"rays in {self._scene.name}, corrected"
        box = bounding_box(np.vstack([self._scene.transmitter.region, known.positions]))
        self._tracers = found.tracers(box, self._followed)
        counts = independence(known.positions[used], self._scene.wavelength)
        gains, scales = path_powers(self._tracers, known.positions[used])
        self._fit = PowerResidual(known.powers[used], known.floor, scales, counts).best(gains)
        traced = self._gains(known.positions)
        least = np.where(traced > NO_PATHS, traced, np.inf).min(axis=0)
        self._least = np.where(np.isfinite(least), least, 0.0)
        self._of_known = np.maximum(traced, self._least)
        self._wider = _widening(found, float(counts @ (~np.isnan(known.powers[used])).sum(axis=1)))
        super()._learn(known)

    def _spread(self, stated: Float[np.ndarray, " errors"]) -> Float[np.ndarray, " 3"]:
        low, middle, high = super()._spread(stated)
        return np.array([middle + self._wider * (low - middle), middle, middle + self._wider * (high - middle)])

    def _gains(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K G"]:
        """Power of the traced field, dB, softened in its fades."""
        return self._fit.predicted(self._tracers, positions)

    def _explained(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K G"]:
        return np.maximum(self._gains(positions), self._least)  # where no path leads, as little as is known to come


def _widening(found: Calibration, powers: float) -> float:
    """Factor of the intervals that makes up for corrections by the same powers, which count as so many."""
    tolerances = np.array([each.tolerance for each in found.which])
    determined = float(np.sum(1 - (found.deviations / tolerances) ** 2))
    return float(np.sqrt((powers + determined) / max(powers - determined, 1.0)))
