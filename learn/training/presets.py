"""Published models with the number of steps that they are trained for here. This module does not import torch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

from scenes.files.errors import shown


class Preset(NamedTuple):
    """A model of the table of models, and how long it is trained."""

    model: str  # its name in the table
    steps: int  # number of steps after which its validation SSIM hardly rises (documentation, Reproduce the paper)


PresetName = Literal["paper", "paper-plus"]

PRESETS: dict[str, Preset] = {"paper": Preset("bisplat", 8000), "paper-plus": Preset("bisplat-plus", 8000)}
"""The presets of ``train`` by name."""


def in_words(preset: PresetName, steps: int, given: Mapping[str, Any], minutes: float) -> str:
    """What a preset trains, what the user changed, how long it takes, and where the documentation says how good it is.

    >>> in_words("paper", 8000, {"primitives": 250}, 12.34).partition(";")[0]
    'preset paper: bisplat with primitives=250, 8000 steps, about 12 minutes here'
    """
    changed = ", ".join(f"{name}={shown(value)}" for name, value in given.items() if name != "steps")
    model = PRESETS[preset].model + (f" with {changed}" if changed else "")
    time = f"about {minutes:.2g} minutes here" if minutes < 100 else f"about {minutes / 60:.2g} hours here"
    return f"preset {preset}: {model}, {steps} steps, {time}; how good that is: documentation, Reproduce the paper"
