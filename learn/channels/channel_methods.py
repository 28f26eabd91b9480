"""The methods that predict the downlink's channels, by name."""

from __future__ import annotations

from collections.abc import Callable

from learn.channels.channel_baselines import Copy, Nearest, Ramp
from learn.channels.delay_profile import Delays
from learn.channels.joint_channels import JointChannels
from learn.channels.known_channels import ChannelMethod
from learn.channels.nerf_channels import NerfChannels
from learn.channels.placed_channels import PlacedChannels

CHANNEL_METHODS: dict[str, Callable[[], ChannelMethod]] = {
    "copy": Copy,
    "ramp": Ramp,
    "nearest": Nearest,
    "delays": Delays,
    "helmholtz": JointChannels,
    "nerf2": NerfChannels,
    "helmholtz-positions": PlacedChannels,
}
"""Functions that make new, unfitted methods."""

BASELINES = ("copy", "ramp", "nearest")
"""Methods that the report of another one shows beside it."""
