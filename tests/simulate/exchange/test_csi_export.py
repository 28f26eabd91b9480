"""The CSI folder of NeRF² and GSRF, as their loaders read it."""

import numpy as np
import pytest
import yaml

from scenes.checks.occupancy import element_positions
from scenes.files.errors import InputError
from simulate.exchange.csi_export import export_csi
from simulate.generation.simulation import simulate
from simulate.rays.core.propagation import Propagation
from tests.small_scene import small_scene


@pytest.fixture(scope="module")
def wide(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wide") / "data"
    return simulate(small_scene(), folder, 5, propagation=Propagation(max_depth=0), bandwidth=20e6, subcarriers=52)


def test_folder_is_what_the_loaders_read(wide, tmp_path, capsys):
    export_csi(wide.folder, tmp_path / "csi")
    csi = np.load(tmp_path / "csi/csidata.npy")
    np.testing.assert_array_equal(csi, wide.band_responses)
    assert csi.shape == (5, 16, 52) and csi.dtype == np.complex64
    stations = yaml.safe_load((tmp_path / "csi/base-station.yml").read_text())["base_station"]
    scene = small_scene()
    np.testing.assert_allclose(stations, element_positions(scene.gateway, scene.wavelength), atol=1e-6)
    parts = [np.loadtxt(tmp_path / f"csi/{part}_index.txt", dtype=int, ndmin=1) for part in ("train", "test")]
    assert sorted(np.concatenate(parts)) == list(range(5))
    assert "warning" not in capsys.readouterr().err


def test_other_numbers_of_subcarriers(tmp_path, capsys):
    propagation = Propagation(max_depth=0)
    few = simulate(small_scene(), tmp_path / "few", 4, propagation=propagation, bandwidth=20e6, subcarriers=8)
    export_csi(few, tmp_path / "csi")
    assert (
        "take 26 subcarriers for the uplink and 26 for the downlink, and the dataset has 8" in capsys.readouterr().err
    )
    odd = simulate(small_scene(), tmp_path / "odd", 4, propagation=propagation, bandwidth=20e6, subcarriers=7)
    with pytest.raises(InputError, match="expected an even number of subcarriers, half of each link, found 7"):
        export_csi(odd, tmp_path / "csi2")


def test_dataset_without_a_band_is_refused(tmp_path):
    narrow = simulate(small_scene(), tmp_path / "narrow", 4, propagation=Propagation(max_depth=0))
    with pytest.raises(InputError, match="expected responses over a band, found those of the carrier alone"):
        export_csi(narrow, tmp_path / "csi")
    assert not (tmp_path / "csi").exists()


def test_receiver_that_moves_is_refused(tmp_path):
    moving = simulate(
        small_scene(),
        tmp_path / "moving",
        4,
        propagation=Propagation(max_depth=0),
        bandwidth=20e6,
        subcarriers=52,
        moving="receiver",
    )
    with pytest.raises(InputError, match="whose transmitter moves, for a base station that stands still"):
        export_csi(moving, tmp_path / "csi")
