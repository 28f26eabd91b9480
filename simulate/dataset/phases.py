"""Whether the phases of a dataset's responses can be compared from position to position."""

from __future__ import annotations

from typing import Literal

Phases = Literal["common", "per-position"]
"""common: they can, as with a transmitter that is synchronised with the receiver, or a tag that answers its reader.
per-position: each position has an unknown phase of its own."""
