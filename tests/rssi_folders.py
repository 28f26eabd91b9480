"""Small folders of received powers (RSSI)."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

import bisplat


def write_hall(
    folder: Path, corners: ArrayLike, count: int, gateways: dict[str, tuple[float, float, float]], floor_dbm: float
) -> bisplat.RssiDataset:
    """Powers at random places that follow a law of distance, with 2 dB of noise; none is received below the floor."""
    generator = np.random.default_rng(0)
    places = generator.uniform(*corners, (count, 3))
    distances = np.linalg.norm(places[:, None] - list(gateways.values()), axis=-1)
    powers = -40 - 25 * np.log10(distances) + generator.normal(0, 2, distances.shape)
    powers[powers < floor_dbm] = np.nan
    return bisplat.write_rssi(folder, places, powers, gateways, "2.4 GHz", floor_dbm=floor_dbm)
