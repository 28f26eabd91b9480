"""Base class of the models, which map transmitter positions to spectra, and the beamforming layer."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

import numpy as np
import torch
from jaxtyping import Complex, Float, Int
from torch import Tensor, nn

from learn.models.quadrature import Quadrature, coarse_loss
from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.beamformer import Beamformer

if TYPE_CHECKING:
    from simulate.dataset.dataset import Dataset
    from simulate.spectra.compiled_beamformer import CompiledBeamformer


Region = Float[np.ndarray, "2 3"]  # corners (min, max) of the box of training positions, metres, world frame
Report = Callable[[str, int, int], None]  # takes a phase of a fit, the number of its steps done, and the largest number


class Beamformed(NamedTuple):
    """Predictions that are the spectra of predicted responses, or weighted means of these and others."""

    responses: Callable[[Tensor], Tensor]  # from positions [B, 3] to [B, elements, 2] (real, imaginary)
    beamforming: BeamformingLayer
    weight: float = 1.0  # of the responses' spectra
    add_others: Callable[[Tensor, np.ndarray], None] | None = None  # adds the others, weighted, to [B, 90, 360]


class SpectrumModel(nn.Module):
    """Base class of the models, which map transmitter positions to spectra.

    A subclass is built with ``(region, beamformer, wavelength)`` and keyword options, and needs only ``forward``, which
    takes positions [B, 3] in metres and returns spectra [B, 90, 360], 0…1. "module:Class" then names it for ``train``,
    ``compare`` and ``load_run``.

    What else a model can do depends on its methods. For example, ``isinstance(model, bisplat.PredictsResponses)`` says
    whether it predicts element responses.

    Args:
        region: [2, 3] corners (min, max) of the box of training positions, metres, world frame.
        wavelength: wavelength, metres.

    Attributes:
        region: the argument as a float32 buffer, which is saved with the weights.
        wavelength: the argument as a float32 buffer.

    Example:
        >>> import bisplat
        >>> class Level(bisplat.SpectrumModel):
        ...     def __init__(self, region, beamformer, wavelength):
        ...         super().__init__(region, wavelength)
        ...         self.level = torch.nn.Parameter(torch.tensor(0.25))
        ...
        ...     def forward(self, positions):
        ...         return self.level.expand(positions.shape[0], 90, 360)
        >>> Level(np.array([[0, 0, 0], [4, 3, 2]]), bisplat.Beamformer(), 0.33)(torch.zeros(2, 3)).shape
        torch.Size([2, 90, 360])
    """

    region: Tensor
    wavelength: Tensor

    report: Report = staticmethod(lambda phase, done, total: None)
    """Function that ``fit`` calls with a phase, the number of its steps done, and the largest number of them."""

    def __init__(self, region: Float[np.ndarray, "2 3"], wavelength: float):
        super().__init__()
        self.register_buffer("region", torch.tensor(region, dtype=torch.float32))
        self.register_buffer("wavelength", torch.tensor(wavelength, dtype=torch.float32))

    def predict(
        self, positions: Float[Tensor, "B 3"]
    ) -> tuple[Float[Tensor, "B 90 360"], Float[Tensor, "B elements 2"] | None]:
        """Predict at positions, metres, world frame: spectra, 0…1, and the responses (real, imaginary) behind them."""
        return self(positions), None

    def beamformed(self) -> Beamformed | None:
        """How the predicted spectra come from responses, for a quick prediction. None: they are something else."""
        return None

    def uncertainty(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, " B"] | None:
        """Variances of predictions at positions, relative to the field's variance, 0…1. None: it knows none.

        Runs scale them to a standard deviation of spectra (``learn.training.conformal_deviation``).
        """
        return None

    def band_responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements subcarriers 2"] | None:
        """Responses over the band, up to one common factor of all positions. None: it predicts none."""
        return None

    @classmethod
    def unsuited(cls, dataset: Dataset) -> str | None:
        """Why a model cannot be fitted to a dataset: what was expected and what was found. None: it can be."""
        return None

    def adapt_to(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """Take over from a dataset what an untrained model needs of it, if anything."""

    def undecayed(self) -> list[nn.Parameter]:
        """Parameters without weight decay: places and shapes of primitives, and delays. By default there are none."""
        return []

    def groups(self, weight_decay: float) -> list[dict[str, Any]]:
        """Groups of parameters for an optimiser: those with weight decay, and those without."""
        placed = self.undecayed()
        others = [each for each in self.parameters() if all(each is not place for place in placed)]
        return [{"params": others, "weight_decay": weight_decay}, {"params": placed, "weight_decay": 0.0}]

    def coarse(self, positions: Float[Tensor, "B 3"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        """Predict spectra at a few pixels. A model that can compute these alone overrides the method."""
        return self(positions)[:, pixels.rows][:, :, pixels.columns]

    def coarse_loss(
        self, positions: Float[Tensor, "B 3"], spectra: Float[Tensor, "B H W"], pixels: Quadrature
    ) -> Float[Tensor, ""]:
        """Loss of a training step that uses only a few pixels, of which the true spectra are given."""
        return coarse_loss(self.coarse(positions, pixels), spectra, pixels)


class SplatModel(SpectrumModel):
    """Base class of the models that draw Gaussians, to which its parameters belong, on the dataset's grid."""

    azimuths: Tensor  # those of the grid's columns, degrees
    elevations: Tensor  # those of its rows, degrees

    def __init__(self, region: Float[np.ndarray, "2 3"], beamformer: Beamformer, wavelength: float):
        super().__init__(region, wavelength)
        self.register_buffer("azimuths", torch.tensor(beamformer.grid.azimuths_deg).float(), persistent=False)
        self.register_buffer("elevations", torch.tensor(beamformer.grid.elevations_deg).float(), persistent=False)

    @abstractmethod
    def drawn(
        self, positions: Float[Tensor, "B 3"], azimuths: Float[Tensor, " W"], elevations: Float[Tensor, " H"]
    ) -> Float[Tensor, "B H W"]:
        """The spectra in these directions, degrees."""

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        return self.drawn(positions, self.azimuths, self.elevations)

    def coarse(self, positions: Float[Tensor, "B 3"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        return self.drawn(positions, self.azimuths[pixels.columns], self.elevations[pixels.rows])

    def undecayed(self) -> list[nn.Parameter]:
        return list(self.parameters(recurse=False))


class BeamformingLayer(nn.Module):
    """Spectra ``|A y|``, min–max normalised, of element responses y, with the steering vectors A of array and grid."""

    steering: Tensor  # [2·elements, 2·90·360], multiplies flattened (real, imaginary) pairs as A does complex numbers

    def __init__(self, beamformer: Beamformer):
        super().__init__()
        steering = beamformer.steering.reshape(-1, beamformer.array.elements)
        self.register_buffer("steering", on_pairs(steering.T), persistent=False)
        self.elements = beamformer.array.elements
        self._beamformer = beamformer

    def forward(self, responses: Float[Tensor, "B elements 2"]) -> Float[Tensor, "B 90 360"]:
        """Spectra, 0…1; neither scale nor common phase of the responses matter, and zero gives a black spectrum."""
        quick = self.quick(responses)
        if quick is None:
            return self._received(responses, self.steering).unflatten(-1, (ROWS, COLUMNS))
        spectra = np.empty((len(responses), ROWS, COLUMNS), np.float32)
        quick.write(as_complex(responses), spectra)
        return torch.from_numpy(spectra)

    def quick(self, numbers: Tensor) -> CompiledBeamformer | None:
        """What computes the spectra quickly, if no gradient with respect to these numbers is needed; None: nothing."""
        if not runs_compiled(numbers):
            return None
        from simulate.spectra.compiled_beamformer import compiled_beamformer  # compiles, which training does not need

        return compiled_beamformer(self._beamformer)

    def coarse(self, responses: Float[Tensor, "B elements 2"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        """The spectra at a few pixels, min–max normalised over these."""
        steering = self.steering.unflatten(1, (ROWS, COLUMNS, 2))[:, pixels.rows][:, :, pixels.columns]
        return self._received(responses, steering.flatten(1)).unflatten(-1, (len(pixels.rows), len(pixels.columns)))

    def _received(
        self, responses: Float[Tensor, "B elements 2"], steering: Float[Tensor, "2*elements 2*P"]
    ) -> Float[Tensor, "B P"]:
        numbers = responses.flatten(1)
        # Without this scaling, the least power below would darken the spectra of weak links.
        largest = numbers.detach().abs().amax(1, keepdim=True)
        field = (numbers / torch.where(largest > 0, largest, 1) @ steering).unflatten(-1, (-1, 2))
        return normalised(power(field).clamp_min(1e-12).sqrt())


def part_of(state_dict: Mapping[str, Tensor], prefix: str) -> dict[str, Tensor]:
    """The numbers of one part of a model, by their names in the part."""
    return {name.removeprefix(prefix): each for name, each in state_dict.items() if name.startswith(prefix)}


def runs_compiled(numbers: Tensor) -> bool:
    """Whether compiled loops, which know no gradient, can compute on: in inference mode, on the CPU, of float32."""
    return torch.is_inference_mode_enabled() and numbers.device.type == "cpu" and numbers.dtype == torch.float32


def as_complex(pairs: Float[Tensor, "*shape 2"]) -> Complex[np.ndarray, "*shape"]:
    """The complex numbers of pairs (real, imaginary), complex64."""
    return torch.view_as_complex(pairs.float().contiguous()).cpu().numpy()


def normalised(spectra: Float[Tensor, "B P"]) -> Float[Tensor, "B P"]:
    """Spectra scaled to 0…1, from the smallest to the largest of their pixels."""
    low = spectra.amin(-1, keepdim=True)
    return (spectra - low) / (spectra.amax(-1, keepdim=True) - low).clamp_min(1e-6)


def power(field: Float[Tensor, "*shape 2"]) -> Float[Tensor, "*shape"]:
    """Power ``|F|²`` of complex numbers F given as pairs (real, imaginary)."""
    real, imaginary = field.unbind(-1)
    return real**2 + imaginary**2


def on_pairs(matrix: np.ndarray) -> Float[Tensor, "2*n 2*m"]:
    """The real matrix that multiplies flattened (real, imaginary) pairs as a complex one multiplies complex numbers."""
    pairs = np.stack([matrix, 1j * matrix], axis=1)[..., None]
    return torch.from_numpy(np.concatenate([pairs.real, pairs.imag], axis=-1)).float().flatten(2).flatten(0, 1)


T = TypeVar("T")


class Cache(Generic[T]):
    """Keeps what was last made of some tensors, until these are replaced or changed in place. A copy is empty."""

    def __init__(self) -> None:
        self._made: tuple[list[Tensor], list[Any], T] | None = None

    def of(self, tensors: Sequence[Tensor], make: Callable[[], T]) -> T:
        """What ``make`` returns, which is called only if other tensors are given than the last time."""
        states = [(0 if each.is_inference() else each._version, each.device, each.dtype) for each in tensors]
        if self._made is not None:
            of, before, made = self._made
            if states == before and all(one is other for one, other in zip(tensors, of, strict=True)):
                return made
        self._made = list(tensors), states, make()
        return self._made[2]

    def __reduce__(self) -> Any:
        return Cache, ()
