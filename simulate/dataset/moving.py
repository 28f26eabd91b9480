"""Which end of the link is at a dataset's positions."""

from typing import Literal

Moving = Literal["transmitter", "receiver"]
"""What moves. The other end stands at the gateway's position. If the receiver moves, its array keeps the gateway's
orientation. "RX moving" is the name that SwiftWRF [liu2025] gives to such data."""
