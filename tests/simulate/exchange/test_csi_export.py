"""The CSI folder of NeRF² and GSRF, as their loaders read it."""

import numpy as np
import pytest
import yaml

from scenes.checks.occupancy import element_positions
from scenes.files.errors import InputError
from simulate.dataset.written_dataset import write_dataset
from simulate.exchange.csi_export import export_csi
from simulate.generation.simulation import simulate
from simulate.rays.core.propagation import Propagation
from simulate.spectra.array import PlanarArray
from tests.small_scene import small_scene


def test_folder_is_what_the_loaders_read(tmp_path, capsys):
    sight, scene = Propagation(max_depth=0), small_scene()
    wide = simulate(scene, tmp_path / "wide", 5, propagation=sight, bandwidth=20e6, subcarriers=52)
    export_csi(wide.folder, tmp_path / "csi")
    csi = np.load(tmp_path / "csi/csidata.npy")
    np.testing.assert_array_equal(csi, wide.band_responses)
    assert csi.shape == (5, 16, 52) and csi.dtype == np.complex64
    stations = yaml.safe_load((tmp_path / "csi/base-station.yml").read_text())["base_station"]
    np.testing.assert_allclose(stations, element_positions(scene.gateway, scene.wavelength), atol=1e-6)
    parts = [np.loadtxt(tmp_path / f"csi/{part}_index.txt", dtype=int, ndmin=1) for part in ("train", "test")]
    assert sorted(np.concatenate(parts)) == list(range(5))
    assert "warning" not in capsys.readouterr().err


def given(folder, subcarriers: int = 0, **options):
    """A dataset over so many subcarriers; 0: of the carrier alone."""
    responses = np.full((4, 4, subcarriers) if subcarriers else (4, 4), 1 + 1j)
    band = {"bandwidth": 20e6} if subcarriers else {}
    return write_dataset(folder, 3 + np.eye(4, 3), responses, PlanarArray(2, 2), 2.4e9, **band, **options)


def test_another_number_of_subcarriers_is_warned_of(tmp_path, capsys):
    export_csi(given(tmp_path / "few", 8), tmp_path / "csi")
    assert "the dataset has 8" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "found"),
    [
        ({"subcarriers": 7}, "found 7"),
        ({}, "expected responses over a band"),
        ({"subcarriers": 52, "moving": "receiver"}, "whose transmitter moves"),
    ],
)
def test_what_the_format_cannot_hold_is_refused(options, found, tmp_path):
    with pytest.raises(InputError, match=found):
        export_csi(given(tmp_path / "data", **options), tmp_path / "csi")
    assert not (tmp_path / "csi").exists()
