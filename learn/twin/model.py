"""The twin: ray tracing of a scene that the known spectra have corrected, and Helmholtz kriging of what it leaves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from jaxtyping import Complex, Float, Int
from torch import Tensor

from learn.models.base import SpectrumModel
from learn.models.kriged_field import KrigedField
from scenes.description import Scene
from scenes.errors import InputError, ParameterError
from scenes.scene_yaml import load_scene
from scenes.shapes import bounding_box
from scenes.tolerances import Tolerances
from scenes.unknowns import unknowns, varied
from simulate.beamformer import Beamformer
from simulate.dataset import Dataset
from simulate.evenly import evenly

if TYPE_CHECKING:
    from simulate.trace import Tracer

CALIBRATED_BY = 160
"""Largest number of known spectra that the scene is corrected by; all of them are kriged."""

SAME_FREQUENCY = 0.05
"""Relative: a dataset of another frequency than the scene's was not measured in it."""


class Twin(SpectrumModel):
    """Responses y(r) = f(r; θ) + e(r): traced in a corrected scene, and what that leaves, kriged.

    ``fit`` finds θ, what the scene's description has wrong (``learn.twin.calibrate``). e is interpolated by
    ``KrigedField`` from what the traced responses leave of the known ones; where these are found behind pictures, f
    tells their phases. Few spectra are enough for θ, and e takes over where many are known.

    Args:
        region: as for ``SpectrumModel``; this model does not use it.
        beamformer: the dataset's array and grid.
        wavelength: metres.
        scene: built-in name or YAML file of the scene as described.
        position: tolerance of the gateway's position, metres; this and the next as of ``Tolerances``.
        turn: of its orientation, degrees.
        objects: of the places of objects, metres.
        materials: of the properties of materials, relative.

    Attributes:
        values: θ, of ``scenes.unknowns.unknowns``.
        power: mean of |e|² over the known spectra and elements.
        rest: interpolates e.

    Raises:
        ParameterError: there is no scene.
        InputError: the scene cannot be read.
    """

    values: Tensor
    power: Tensor

    def __init__(
        self,
        region: Float[np.ndarray, "2 3"],
        beamformer: Beamformer,
        wavelength: float,
        scene: str = "",
        position: float = Tolerances.position,
        turn: float = Tolerances.turn,
        objects: float = Tolerances.objects,
        materials: float = Tolerances.materials,
    ):
        super().__init__(region, wavelength)
        if not scene:
            raise ParameterError("scene", "expected the scene that the twin traces, found none")
        self._described = load_scene(scene)
        self._tolerances = Tolerances(position, turn, objects, materials)
        self._which = unknowns(self._described, self._tolerances)
        self.register_buffer("values", torch.zeros(len(self._which), dtype=torch.float64))
        self.register_buffer("power", torch.zeros(()))
        self.rest = KrigedField(region, beamformer, wavelength, "responses")

    @property
    def has_responses(self) -> bool:
        """Always: the twin predicts responses."""
        return True

    @property
    def traces_rays(self) -> bool:
        """Always, in the corrected scene."""
        return True

    @property
    def beamforming(self) -> Any:  # type: ignore[override]
        """That of the kriged field."""
        return self.rest.beamforming

    @property
    def corrected(self) -> Scene:
        """The scene as corrected; before ``fit`` as described."""
        return varied(self._described, self._which, self.values.cpu().numpy())

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        """Predicted spectrum: that of the predicted responses."""
        return self.beamforming(self.responses(positions))

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses y (real, imaginary): traced, and what is interpolated of the rest after ``fit``."""
        traced = torch.view_as_real(torch.from_numpy(self._traced(positions.cpu().numpy()))).float()
        if not len(self.rest.places):
            return traced.to(positions.device)
        return traced.to(positions.device) + self.power.sqrt() * self.rest.responses(positions)

    def uncertainty(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, " B"]:
        """Kriging variance of the rest, relative to the rest's variance."""
        return self.rest.uncertainty(positions)

    def fit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> str:
        """Correct the scene by known spectra, and keep what it leaves of them.

        Args:
            dataset: a dataset, from whose responses or pictures the scene is corrected.
            known: indices of the spectra.

        Raises:
            InputError: the scene has another frequency or array than the dataset.

        Returns:
            How much of the power was and is unexplained, as a sentence for the user.
        """
        from learn.twin.measured import calibrate_by

        def report(sentence: str) -> None:
            self.report(f"calibration: {sentence}", 0, 1)

        if abs(self._described.wavelength / dataset.wavelength - 1) > SAME_FREQUENCY:
            raise InputError(
                f"{self._described.name}: expected a scene of the dataset's wavelength of {dataset.wavelength:.4g} m, "
                f"found {self._described.wavelength:.4g} m"
            )
        used = evenly(np.unique(known), CALIBRATED_BY)
        found = calibrate_by(self._described, dataset, used, self._tolerances, report=report)
        self.values = torch.from_numpy(found.values)
        self.__dict__.pop("_tracer", None)
        self.refit(dataset, known)
        return (
            f"corrected {len(self._which)} numbers of the scene: {found.misfit[1]:.1%} of the power of {len(used)} "
            f"spectra was unexplained, {found.misfit[0]:.1%} is"
        )

    def refit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """Krige what the corrected scene leaves of other known spectra.

        Args:
            dataset: as for ``fit``.
            known: indices of the spectra.
        """
        from learn.twin.calibrate import aligned_to
        from learn.twin.measured import measured_responses

        known = np.unique(known)
        traced = self._traced(dataset.positions[known])
        measured, phases_known = measured_responses(dataset, known)
        rest = aligned_to(measured, traced, phases_known)[0] - traced
        everywhere = np.zeros((len(dataset.positions), rest.shape[1]), np.complex64)
        everywhere[known] = rest
        self.power = torch.tensor(float((np.abs(rest) ** 2).mean()))
        self.rest.report = self.report  # type: ignore[method-assign]
        self.rest.fit(replace(dataset, responses=everywhere), known)

    @cached_property
    def _tracer(self) -> Tracer:
        """Traces the corrected scene."""
        from simulate.propagation import Propagation
        from simulate.trace import Tracer

        everywhere = bounding_box(np.concatenate([self.region.cpu().numpy(), self._described.transmitter.region]))
        return Tracer(self.corrected, Propagation(), everywhere)

    def _traced(self, positions: Float[np.ndarray, "B 3"]) -> Complex[np.ndarray, "B elements"]:
        return self._tracer.responses(np.asarray(positions, float))

    def load_state_dict(self, state_dict: Mapping[str, Any], strict: bool = True, assign: bool = False) -> Any:
        """As ``torch.nn.Module.load_state_dict``; the kriged field takes the number of spectra in the file."""
        self.__dict__.pop("_tracer", None)
        of_rest = {name.removeprefix("rest."): each for name, each in state_dict.items() if name.startswith("rest.")}
        self.rest.load_state_dict(of_rest, strict)
        return super().load_state_dict(state_dict, strict, assign)
