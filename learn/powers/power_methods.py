"""The methods that predict received powers, by name."""

from __future__ import annotations

from collections.abc import Callable

from learn.powers.known_powers import PowerMethod
from learn.powers.nerf_powers import NerfPowers
from learn.powers.power_baselines import InverseDistance, Kriging, LogDistance, Mean, Mri, Nearest
from learn.powers.power_field import PowerField

POWER_METHODS: dict[str, Callable[[], PowerMethod]] = {
    "mean": Mean,
    "nearest": Nearest,
    "inverse-distance": InverseDistance,
    "log-distance": LogDistance,
    "mri": Mri,
    "kriging": Kriging,
    "helmholtz": PowerField,
    "nerf2": NerfPowers,
}
"""Functions that make new, unfitted methods."""

BASELINES = ("mean", "nearest", "inverse-distance", "log-distance")
"""Methods that the report of another one shows beside it."""
