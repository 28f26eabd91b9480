"""Small folders of received powers (RSSI) and of channels (CSI), and what is in a folder, to be compared."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

import bisplat


def contents(folder: Path) -> dict[str, bytes]:
    """Every file's bytes, by its path in the folder; a folder counts too."""
    return {str(path.relative_to(folder)): b"" if path.is_dir() else path.read_bytes() for path in folder.rglob("*")}


def write_hall(
    folder: Path, corners: ArrayLike, count: int, gateways: dict[str, tuple[float, float, float]], floor_dbm: float
) -> bisplat.Dataset:
    """Powers at random places that follow a law of distance, with 2 dB of noise; none is received below the floor."""
    generator = np.random.default_rng(0)
    places = generator.uniform(*corners, (count, 3))
    distances = np.linalg.norm(places[:, None] - list(gateways.values()), axis=-1)
    powers = -40 - 25 * np.log10(distances) + generator.normal(0, 2, distances.shape)
    powers[powers < floor_dbm] = np.nan
    return bisplat.write_dataset(
        folder, places, powers=powers, gateways=gateways, frequency="2.4 GHz", floor_dbm=floor_dbm
    )


def write_links(folder: Path, channels: np.ndarray) -> None:
    """Write a folder as NeRF²'s MIMO data have it, with every fifth row for testing."""
    folder.mkdir()
    np.save(folder / "csidata.npy", channels)
    antennas = "".join(f"  - [0.0, {0.06 * number:.2f}, 2.0]\n" for number in range(channels.shape[1]))
    (folder / "base-station.yml").write_text("base_station:\n" + antennas)
    write_index(folder, len(channels))


def write_index(folder: Path, count: int) -> None:
    """Write index files of rows, with every fifth one for testing."""
    rows = range(count)
    for name, part in {"train": [n for n in rows if n % 5], "test": [n for n in rows if n % 5 == 0]}.items():
        (folder / f"{name}_index.txt").write_text("".join(f"{row}\n" for row in part))


def paths(
    delays: np.ndarray,
    gains: np.ndarray,
    subcarriers: int = 52,
    directions: np.ndarray | None = None,
    antennas: int = 4,
) -> np.ndarray:
    """Channels of a line of antennas: Σ gain exp(−i 2π (n delay + antenna direction))."""
    steps = np.zeros(delays.shape) if directions is None else directions
    phase = delays[:, None, None] * np.arange(subcarriers)[:, None]
    phase = phase + steps[:, None, None] * np.arange(antennas)[:, None, None]
    return (gains[:, None, None] * np.exp(-2j * np.pi * phase)).sum(axis=-1)
