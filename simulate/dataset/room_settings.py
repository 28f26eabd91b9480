"""What the rooms of a folder have in common. The command line's help needs this module, so it imports little."""

from __future__ import annotations

from typing import Literal

Setting = Literal["same", "furniture", "layout"]
"""What differs from room to room: the transmitter's positions alone, the furniture too, or everything."""

Outline = Literal["rectangle", "l", "both"]
"""Outlines of rooms; of "both", every second room is L-shaped."""
