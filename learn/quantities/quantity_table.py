"""The table of quantities."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Literal

from learn.quantities.quantity import Quantity
from scenes.files.errors import require_word

QUANTITIES: dict[str, str] = {
    "spectrum": "learn.quantities.spectra:Spectra",
    "response": "learn.quantities.responses:Responses",
    "power": "learn.quantities.powers:Powers",
    "channel": "learn.quantities.channels:Channels",
}
"""The class of each quantity by its name."""

if TYPE_CHECKING:
    QuantityName = str
else:
    QuantityName = Literal[tuple(QUANTITIES)]  # the choices of the command line


def quantity_named(name: str) -> Quantity:
    """The quantity of a name."""
    require_word(tuple(QUANTITIES), quantity=name)
    module, _, attribute = QUANTITIES[name].partition(":")
    return getattr(import_module(module), attribute)()
