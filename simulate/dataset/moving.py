"""Which end of the link is at a dataset's positions."""

from typing import Literal

Moving = Literal["transmitter", "receiver", "both"]
"""What moves. An end that does not move stands at the gateway's position. If the receiver moves, its array keeps the
gateway's orientation. "RX moving" is the name that SwiftWRF [liu2025] gives to data of a moving receiver. If both move,
the positions are the transmitters', and those of the array are stated beside them."""
