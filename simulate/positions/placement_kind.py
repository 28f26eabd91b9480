"""The ways to place transmitters; apart from ``placement``, so that the command line's help stays light."""

from typing import Literal

Placement = Literal["uniform", "grid", "path"]
"""``uniform``: at random in the region; ``grid``: evenly; ``path``: along a smooth curve, as measurements are."""
