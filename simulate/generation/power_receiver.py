"""A receiver of powers (RSSI): transmit power, shadowing, floor and quantisation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from jaxtyping import Float
from tyro.conf import arg

from scenes.files.errors import require_seed, require_within
from scenes.files.options import check_kinds
from simulate.dataset.dataset_kinds import NOT_RECEIVED, STRONGEST

SHADOWING = 5  # Stream of random numbers. The errors of ``Measurement`` have the streams 1 to 4.


@dataclass(frozen=True)
class PowerReceiver:
    """What a gateway reports of the power that it receives.

    The received power is P = P_t + 20 log10 ``|y|`` + X in dBm, with the response y of the element and the shadowing X.
    A gateway receives nothing below its floor, and reports P in steps of its quantisation.

    Attributes:
        tx_power_dbm: transmit power P_t, dBm.
        floor_dbm: power below which a gateway receives nothing, dBm, from −100 on: the format marks by −100 that
            nothing was received.
        shadowing_db: standard deviation of X, dB. X is normal, and drawn for each position and gateway.
        quantisation_db: step of the reported powers, dB; 0 for none.

    Raises:
        ParameterError: a number is out of its range.
    """

    tx_power_dbm: Annotated[float, arg(aliases=["--tx-power"])] = 0.0
    floor_dbm: Annotated[float, arg(aliases=["--floor"])] = NOT_RECEIVED
    shadowing_db: Annotated[float, arg(aliases=["--shadowing"])] = 0.0
    quantisation_db: Annotated[float, arg(aliases=["--quantisation"])] = 1.0

    def __post_init__(self) -> None:
        check_kinds(self)
        require_within(-100, STRONGEST, "a power in dBm", tx_power_dbm=self.tx_power_dbm)
        require_within(NOT_RECEIVED, STRONGEST, "a power in dBm", floor_dbm=self.floor_dbm)
        require_within(0, 60, "a standard deviation in dB", shadowing_db=self.shadowing_db)
        require_within(0, 60, "a step in dB", quantisation_db=self.quantisation_db)

    def reported(self, gain_db: Float[np.ndarray, "K G"], seed: int) -> Float[np.ndarray, "K G"]:
        """The powers that the gateways report.

        Args:
            gain_db: path gains 20 log10 ``|y|``, dB; −∞ without a path.
            seed: seed of the shadowing.

        Returns:
            Powers, dBm; NaN where nothing is received.

        Example:
            >>> PowerReceiver(tx_power_dbm=10, floor_dbm=-90).reported(np.array([[-70.4, -100.2]]), seed=0).tolist()
            [[-60.0, nan]]
        """
        require_seed(seed=seed)
        power = self.tx_power_dbm + gain_db
        if self.shadowing_db:
            # A stream for each gateway, so that further ones leave the draws of the others unchanged.
            streams = [np.random.default_rng([seed, SHADOWING, number]) for number in range(power.shape[1])]
            draws = [stream.standard_normal(len(power)) for stream in streams]
            power = power + self.shadowing_db * np.stack(draws, axis=1)
        received = power >= self.floor_dbm
        if self.quantisation_db:
            power = np.round(power / self.quantisation_db) * self.quantisation_db
        return np.where(received & (power > NOT_RECEIVED), power, np.nan)
