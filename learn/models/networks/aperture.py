"""Our BiSplat-aperture: planar Gaussian primitives, and an array that receives their field."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from learn.models.base import Cache, Region
from learn.models.encoding import PRIMITIVE_ORDER, EncodingKind, TransmitterEncoding, positional_encoding
from learn.models.networks.bisplat import SCALE_LEAST, SCALE_MOST, Primitives
from learn.models.networks.feed_forward import ResidualFFN
from learn.models.networks.response_network import PathDelays, ResponseNetwork
from learn.models.splatting.splat import Splats, blending_weights, conic_of, gaussian, pixel_grid, splat
from simulate.spectra.beamformer import Beamformer

STEP_DEG = 6
"""Distance between the directions at which the field is blended, degrees: finer than a 4 × 4 array can resolve."""


class BiSplatAperture(ResponseNetwork):
    """Predicts the responses of the array to the field of planar Gaussians, and the spectrum from these.

    As in the paper [zhang2026], primitives blend into ``F(ω) = Σ_i T_i(ω) α_i(ω) c_i``, with ``T_i = Π_{nearer j} (1 −
    α_j)``. Only the coefficients depend on the transmitter's position r, so that what element m with the manifold a_m
    receives is linear in them, and A is computed once for a batch::

        y_m = Σ_ω a_m(ω) F(ω) cosθ ΔΩ = Σ_i A_mi c_i,   c_i(r) = p_i · [t(r), 1]

    p_i are features of the primitive (a network of GS-PE), t those of the transmitter. If the receiver moves, c_i has
    the phase ``e^{jk u_i·(r − r₀)}`` of its direction u_i, too, and over a band that of a learned delay.
    """

    aperture: Tensor
    azimuths: Tensor
    elevations: Tensor

    def __init__(
        self,
        region: Region,
        beamformer: Beamformer,
        wavelength: float,
        *,
        primitives: int = 200,
        width: int = 256,
        encoding: EncodingKind = "waves",
        ordered: bool = True,
    ):
        super().__init__(region, beamformer, wavelength)
        self.ordered = ordered
        self._kept: dict[tuple[str, bool], Cache[Tensor]] = {}
        azimuths, elevations = np.arange(0.0, 360.0, STEP_DEG), np.arange(STEP_DEG / 2, 90.0, STEP_DEG)
        self.register_buffer("azimuths", torch.from_numpy(azimuths).float(), persistent=False)
        self.register_buffer("elevations", torch.from_numpy(elevations).float(), persistent=False)
        azimuth, elevation = np.radians(np.meshgrid(azimuths, elevations))
        solid_angle = np.cos(elevation) * np.radians(STEP_DEG) ** 2  # cosθ ΔφΔθ
        aperture = beamformer.array.manifold(azimuth, elevation) * solid_angle[..., None]
        aperture = torch.view_as_real(torch.from_numpy(aperture)).flatten(2).flatten(0, 1).float()
        self.register_buffer("aperture", aperture, persistent=False)
        self.primitives = Primitives(primitives)
        self.encoding = TransmitterEncoding(encoding)
        self.transmitter = ResidualFFN(self.encoding.size, width, width, 4)
        self.primitive = ResidualFFN(3 * (2 * PRIMITIVE_ORDER + 1), 2 * (width + 1), 128, 4)
        with torch.no_grad():  # at first, responses have a mean square magnitude of about 1 if t is about 1
            typical = self._response_of_features().square().mean().mul(2 * (width + 1)).sqrt()
            self.primitive.outward.weight.div_(typical)
            self.primitive.outward.bias.div_(typical)

    @property
    def paths(self) -> int:
        return len(self.primitives.rotation)

    def undecayed(self) -> list[nn.Parameter]:
        return [*super().undecayed(), *self.primitives.parameters()]

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses y (real, imaginary)."""
        return self._heard(None, positions)

    def over_band(self, band: PathDelays, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements subcarriers 2"]:
        return self._heard(band, positions).unflatten(1, (-1, len(band.turns)))

    def _heard(
        self, band: PathDelays | None, positions: Float[Tensor, "B 3"]
    ) -> Float[Tensor, "B elements*subcarriers 2"]:
        """Responses (real, imaginary) at all subcarriers of a band; without one, at the carrier."""
        if self.turn is not None:
            return _products("bi,im->bm", self._coefficients(positions), self._once(self._received, band))
        of_features = self._once(self._response_of_features, band)
        return (self._transmitter_features(positions) @ of_features).unflatten(-1, (-1, 2))

    def splats(self, positions: Float[Tensor, "B 3"]) -> Splats:
        coefficient = self._coefficients(positions)
        scale, rotation, opacity = (value.expand(len(positions), *value.shape) for value in self._shape())
        place = self.primitives.azimuth, self.primitives.elevation, self._depth()
        return Splats(*place, scale, rotation, opacity, coefficient)

    def field(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B H W 2"]:
        """The complex field F(φ, θ) of each transmitter position on a 6° grid (real, imaginary)."""
        return splat(self.splats(positions), self.azimuths, self.elevations)

    def _coefficients(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B N_p 2"]:
        """c_i (real, imaginary)."""
        found = torch.einsum("bf,ifc->bic", self._transmitter_features(positions), self._once(self._primitive_features))
        if self.turn is None:
            return found
        azimuth, elevation = self.primitives.azimuth.deg2rad(), self.primitives.elevation.deg2rad()
        across = elevation.cos()
        direction = torch.stack([across * azimuth.cos(), across * azimuth.sin(), elevation.sin()], dim=-1) @ self.turn.T
        phase = 2 * torch.pi / self.wavelength * (positions - self.region.mean(dim=0)) @ direction.T
        return _products("bi,bi->bi", found, torch.stack([phase.cos(), phase.sin()], dim=-1))

    def _once(self, compute: Callable[..., Tensor], *band: PathDelays | None) -> Tensor:
        """What depends on the weights alone: in inference mode, the last result as long as no weight has changed."""
        weights = list(self.parameters())
        # Weights made in inference mode do not tell whether they have changed.
        if not torch.is_inference_mode_enabled() or any(each.is_inference() for each in weights):
            return compute(*band)
        return self._kept.setdefault((compute.__name__, any(band)), Cache()).of(weights, lambda: compute(*band))

    def _depth(self) -> Float[Tensor, " N_p"]:
        return self.primitives.depth if self.ordered else torch.zeros_like(self.primitives.depth)

    def _shape(self) -> tuple[Float[Tensor, "N_p 2"], Float[Tensor, " N_p"], Float[Tensor, " N_p"]]:
        """Scales (degrees), rotation (radians) and opacity."""
        each = self.primitives
        return each.scale_raw.exp().clamp(SCALE_LEAST, SCALE_MOST), each.rotation, each.opacity_raw.sigmoid()

    def _response_of_features(self, band: PathDelays | None = None) -> Float[Tensor, "features elements*subcarriers*2"]:
        """Responses (real, imaginary) to each feature of the transmitter: Σ_i A_mi p_i."""
        return _products("im,if->fm", self._received(band), self._primitive_features()).flatten(1)

    def _received(self, band: PathDelays | None = None) -> Float[Tensor, "N_p elements*subcarriers 2"]:
        """A_mi (real, imaginary), over a band times e^{−j2π(f − f₀)τ_i}."""
        order = torch.argsort(self._depth(), stable=True)
        scale, rotation, opacity = (value[order] for value in self._shape())
        place = self.primitives.azimuth[order], self.primitives.elevation[order]
        pixels = pixel_grid(self.azimuths, self.elevations)
        alpha = opacity[:, None] * gaussian(*place, conic_of(scale, rotation), pixels)
        received = (blending_weights(alpha) @ self.aperture).unflatten(-1, (-1, 2))
        received = received[torch.argsort(order)]
        return received if band is None else _products("im,is->ims", received, band.factors()).flatten(1, 2)

    def _primitive_features(self) -> Float[Tensor, "N_p features 2"]:
        """p_i (real, imaginary)."""
        gs_pe = positional_encoding(self.primitives.coordinates, PRIMITIVE_ORDER)
        return self.primitive(gs_pe).unflatten(-1, (-1, 2))

    def _transmitter_features(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B features"]:
        """[t(r), 1]."""
        features = self.transmitter(self.encoding(positions, self.region, self.wavelength))
        return torch.cat([features, torch.ones_like(features[:, :1])], dim=-1)


def _products(indices: str, first: Float[Tensor, "*a 2"], second: Float[Tensor, "*b 2"]) -> Float[Tensor, "*c 2"]:
    """``torch.einsum`` of complex numbers as pairs (real, imaginary), since not every runtime of exported models has
    complex numbers."""
    given, result = indices.split("->")
    one, other = given.split(",")
    product = torch.einsum(f"{one}y,{other}z->yz{result}", first, second)
    return torch.stack([product[0, 0] - product[1, 1], product[0, 1] + product[1, 0]], dim=-1)
