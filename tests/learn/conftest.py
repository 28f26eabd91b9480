"""Folders of received powers and of channels, and the command line, for tests of what learns from them."""

import sys

import numpy as np
import pytest

import bisplat
from bisplat.__main__ import main
from tests.folders import paths, write_hall, write_index, write_links

GATEWAYS = {"door": (0.0, 0, 2), "window": (9.0, 0, 2)}


@pytest.fixture(scope="session")
def hall(tmp_path_factory) -> bisplat.Dataset:
    """60 positions and two gateways; what lies below −61 dBm is not received."""
    folder = tmp_path_factory.mktemp("powers") / "hall"
    made = write_hall(folder, [(0, 0, 0), (9, 6, 2)], 60, GATEWAYS, floor_dbm=-61)
    assert 0.1 < np.isnan(made.powers).mean() < 0.6
    return made


@pytest.fixture(scope="session")
def links(tmp_path_factory) -> bisplat.Dataset:
    """60 rows, 4 antennas, 12 + 12 subcarriers, two paths each; neither positions nor the band are stated."""
    generator = np.random.default_rng(0)
    gains = generator.normal(size=(60, 2)) + 1j * generator.normal(size=(60, 2))
    channels = paths(generator.uniform(0, 0.08, (60, 2)), gains * [1, 0.3], 24)
    folder = tmp_path_factory.mktemp("channels") / "links"
    write_links(folder, channels.astype(np.complex64))
    return bisplat.read_dataset(folder)


@pytest.fixture(scope="session")
def placed(tmp_path_factory) -> bisplat.Dataset:
    """40 rows with positions, 3 antennas and 8 + 8 subcarriers over 16 MHz at 2.4 GHz; two paths each."""
    generator = np.random.default_rng(1)
    places = generator.uniform((0, 0, 1), (4, 3, 2), (40, 3))
    delays = np.linalg.norm(places[:, None] - [[0, 0, 2], [9, 0, 2]], axis=-1) / 300  # cycles per MHz
    channels = paths(delays, np.tile([1, 0.5], (40, 1)), 16, antennas=3)
    array = bisplat.PlanarArray(1, 3)
    folder = tmp_path_factory.mktemp("placed")
    wide = bisplat.write_dataset(folder / "wide", places, channels, array, "2.4 GHz", bandwidth="16 MHz")
    bisplat.export(wide, folder / "csi", "csi")
    write_index(folder / "csi", 40)
    return bisplat.read_dataset(folder / "csi")


@pytest.fixture
def bisplat_command(monkeypatch, capsys, tmp_path):
    """Function: arguments of ``bisplat``, in a new folder -> status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["bisplat", *map(str, arguments)])
        status = 0
        try:
            main()
        except SystemExit as ended:
            status = int(ended.code or 0)
        return status, *capsys.readouterr()

    return run
