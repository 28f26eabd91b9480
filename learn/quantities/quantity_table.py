"""The table of quantities, and the one that a dataset is compared by if none is named."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal

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


def quantity_of(dataset: Any) -> str:
    """The name of the quantity that a dataset mainly holds."""
    from simulate.csi.csi_dataset import CsiDataset
    from simulate.rssi.rssi_dataset import RssiDataset

    if isinstance(dataset, RssiDataset):
        return "power"
    return "channel" if isinstance(dataset, CsiDataset) else "spectrum"
