"""One dataset of each quantity, small enough that a comparison takes a second, with two of its methods."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

import bisplat
from learn.comparison.comparison import Comparison
from simulate.dataset.dataset_folder import read_dataset

ARRAY = bisplat.PlanarArray(2, 2)


@dataclass(frozen=True)
class Kind:
    """A dataset of a quantity. Of its methods, the second is better than the first one."""

    dataset: Any
    quantity: str
    methods: Sequence[str]
    score: str

    def compare(self, methods: Any = None, **options: Any) -> Comparison:
        chosen = list(self.methods) if methods is None else methods
        data = options.pop("dataset", self.dataset)
        return bisplat.compare(data, chosen, **{"quantity": self.quantity, "split": "random", **options})


@pytest.fixture(scope="session")
def wide(tmp_path_factory) -> bisplat.Dataset:
    """Responses over a band of a transmitter in free space that moves far from the array."""
    positions = np.random.default_rng(0).uniform(0, 0.3, (60, 3)) + np.array([6, 0, 0])
    frequencies = bisplat.Band(40e6, 8).frequencies(1e9)
    late = np.linalg.norm(positions[:, None] - 0.15 * ARRAY.positions, axis=2) / 299_792_458
    responses = np.exp(-2j * np.pi * frequencies * late[..., None]) / late[..., None]
    folder = tmp_path_factory.mktemp("band") / "wide"
    made = bisplat.write_dataset(folder, positions, responses, ARRAY, 1e9, bandwidth=40e6)
    return replace(made, train=np.arange(48), test=np.arange(48, 60))


@pytest.fixture(autouse=True)
def no_ceiling(monkeypatch):
    """The array's ceiling, whose search takes seconds, is the truth itself."""
    monkeypatch.setattr("learn.quantities.spectra.array_ceiling", lambda truth, beamformer, recorded: truth)


@pytest.fixture(params=["spectrum", "response", "power", "channel"])
def kind(request, tiny, wide, hall, links) -> Kind:
    return {
        "spectrum": lambda: Kind(read_dataset(tiny), "spectrum", ("mean-picture", "kriging"), "ssim_median"),
        "response": lambda: Kind(wide, "response", ("nearest", "kriging"), "snr_median_db"),
        "power": lambda: Kind(hall, "power", ("mean", "log-distance"), "error_median_db"),
        "channel": lambda: Kind(links, "channel", ("copy", "delays"), "snr_median_db"),
    }[request.param]()
