"""Published models with the number of steps that they are trained for here. This module does not import torch."""

from __future__ import annotations

from typing import Literal, NamedTuple


class Preset(NamedTuple):
    """A model of the table of models, and how long it is trained.

    Attributes:
        model: its name in the table.
        steps: number of steps after which its validation SSIM hardly rises (documentation, Reproduce the paper).
    """

    model: str
    steps: int


PresetName = Literal["paper", "paper-plus"]

PRESETS: dict[str, Preset] = {"paper": Preset("bisplat", 8000), "paper-plus": Preset("bisplat-plus", 8000)}
"""The presets of ``train`` by name."""
