"""Known channels of both links, and the delay that all paths of a row have in common."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Complex, Float

from learn.quantities.known import Known
from scenes.scene.description import SPEED_OF_LIGHT

FINER = 16  # Delays of the search for the strongest one, per subcarrier


def strongest_ramp(channels: Complex[np.ndarray, "*rows A S"]) -> Float[np.ndarray, "*rows"]:
    """Phase step per subcarrier of the strongest path of each row, radians; exact if it is the only one.

    The largest power of a finely sampled Fourier transform, summed over the antennas, gives it roughly. The mean phase
    between subcarriers that are half a band apart gives the rest.
    """
    count = channels.shape[-1]
    power = np.square(np.abs(np.fft.fft(channels, FINER * count))).sum(axis=-2)
    rough = np.angle(np.exp(2j * np.pi * power.argmax(axis=-1) / (FINER * count)))
    if count < 2:
        return rough
    level = without_ramp(channels, rough)
    apart = count // 2
    return rough + np.angle((level[..., apart:] * level[..., :-apart].conj()).sum(axis=(-2, -1))) / apart


def without_ramp(
    channels: Complex[np.ndarray, "*rows A N"], step: Float[np.ndarray, "*rows"], first: int = 0
) -> Complex[np.ndarray, "*rows A N"]:
    """Channels after a phase ramp is taken off."""
    return channels * np.exp(-1j * step[..., None, None] * (first + np.arange(channels.shape[-1])))


USUAL_WAVELENGTH = SPEED_OF_LIGHT / 2.4e9  # Metres; if no frequency is stated


@dataclass(frozen=True)
class KnownChannels:
    """Channels of n known rows, from which a method learns. The downlink's subcarriers follow the uplink's evenly."""

    uplink: Complex[np.ndarray, "n A S"]  # channels of the uplink
    downlink: Complex[np.ndarray, "n A S"]  # channels of the downlink
    # positions of the end that moves, metres, world frame. None: they are not known
    positions: Float[np.ndarray, "n 3"] | None = None
    seed: int = 0  # seed of everything that is random in a method
    # positions of the antennas, metres, in the same frame. None: they are not known
    antennas: Float[np.ndarray, "A 3"] | None = None
    wavelength: float = USUAL_WAVELENGTH  # metres

    @classmethod
    def of(cls, known: Known) -> KnownChannels:
        """The channels that a method of a comparison learns from."""
        dataset = known.dataset
        places = (known.positions, known.seed, dataset.gateway_positions, dataset.wavelength)
        assert known.given is not None
        return cls(known.given, known.values, *places)

    @cached_property
    def alike(self) -> Complex[np.ndarray, "n A 2S"]:
        """Both links, each row divided by their root mean square. Rows with a link of zeros are left out.

        So each row counts the same: a linear estimate does not depend on the level of a row.
        """
        up, down = (np.linalg.norm(link.reshape(len(link), -1), axis=1) for link in (self.uplink, self.downlink))
        heard = (up > 0) & (down > 0)
        both = np.concatenate([self.uplink, self.downlink], axis=-1)[heard].astype(complex)
        return both / np.sqrt(np.square(np.abs(both)).mean(axis=(1, 2), keepdims=True))

    def rows(self, aligned: bool) -> Complex[np.ndarray, "n A 2S"]:
        """``alike``, with the strongest delay of each row's uplink taken off if ``aligned``."""
        return without_ramp(self.alike, strongest_ramp(self.alike[..., : self.subcarriers])) if aligned else self.alike

    @property
    def subcarriers(self) -> int:
        """Number of subcarriers of each link."""
        return self.uplink.shape[2]
