"""An exported HDF5 file holds what the dataset folder holds, and is written whole or not at all."""

import errno
import json
import resource
from dataclasses import replace

import h5py
import numpy as np
import pytest

from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_frequency import Frequency
from simulate.exchange.hdf5_export import export_hdf5
from simulate.generation.simulation import simulate
from simulate.rays.core.propagation import Propagation
from tests.small_scene import small_scene


@pytest.fixture(scope="module")
def dataset(tmp_path_factory) -> Dataset:
    """Five spectra of the small scene."""
    return simulate(small_scene(), tmp_path_factory.mktemp("hdf5") / "data", 5, propagation=Propagation(max_depth=0))


def test_every_array_and_number_of_a_simulated_dataset_is_there(dataset, tmp_path):
    export_hdf5(dataset.folder, tmp_path / "data.h5")
    with h5py.File(tmp_path / "data.h5") as file:
        assert file["spectra"].dtype == np.uint8 and (file["spectra"][:] == dataset.pictures).all()
        assert file["spectra"].chunks == (1, 90, 360) and file["spectra"].compression == "gzip"
        assert file["responses"].dtype == np.complex64 and (file["responses"][:] == dataset.responses).all()
        assert file["responses"].id.get_type().get_class() == h5py.h5t.COMPOUND  # MATLAB reads it as two fields
        assert (file["positions_m"][:] == dataset.positions).all()
        assert file["names"].asstr()[:].tolist() == dataset.names
        assert file["train_index"][:].tolist() == dataset.train.tolist()
        assert file["test_index"][:].tolist() == dataset.test.tolist()
        assert json.loads(file["metadata_json"][()]) == dataset.metadata
        assert "retrieved_responses" not in file
        found = dict(file.attrs)
    assert found.pop("gateway_position_m").tolist() == [0, 0, 1.5]
    assert found.pop("gateway_orientation_xyzw") == pytest.approx(dataset.gateway_orientation)
    assert found == {
        "frequency_hz": 915e6,
        "frequency_source": "metadata",
        "array_rows": 4,
        "array_columns": 4,
        "moving": "transmitter",
        "array_spacing_wavelengths": 0.5,
        "array_source": "metadata",
        "elevation_first_deg": 0.0,
        "elevation_step_deg": 1.0,
        "azimuth_step_deg": 1.0,
    }
    assert [path.name for path in tmp_path.iterdir()] == ["data.h5"]


def test_a_band_and_the_places_of_a_moving_receiver_are_there(tmp_path):
    kind = {"moving": "both", "transmitters": 2, "bandwidth": "20 MHz", "subcarriers": 6}
    made = simulate(small_scene(), tmp_path / "data", 4, propagation=Propagation(max_depth=0), **kind)
    export_hdf5(made.folder, tmp_path / "data.h5")
    with h5py.File(tmp_path / "data.h5") as file:
        assert (file.attrs["bandwidth_hz"], file.attrs["moving"]) == (20e6, "both")
        assert (file["band_responses"][:] == made.band_responses).all() and file["band_responses"].shape[2] == 6
        assert (file["receivers_m"][:] == made.receivers).all() and (file["positions_m"][:] == made.positions).all()


def test_measured_dataset_has_no_responses_but_those_that_were_retrieved(dataset, tmp_path):
    measured = replace(
        dataset.with_values(response=None),
        metadata={},
        frequency=Frequency(),
        train=np.zeros(0, int),
        test=np.zeros(0, int),
    )
    export_hdf5(measured, tmp_path / "measured.h5")
    export_hdf5(measured.with_values(retrieved=dataset.responses), tmp_path / "retrieved.h5")
    with h5py.File(tmp_path / "measured.h5") as file:
        assert "responses" not in file and "retrieved_responses" not in file
        assert file.attrs["frequency_source"] == "assumed" and len(file["train_index"]) == 0
    with h5py.File(tmp_path / "retrieved.h5") as file:
        assert "responses" not in file and (file["retrieved_responses"][:] == dataset.responses).all()


@pytest.mark.parametrize("room", [1000, 30_000])
def test_full_disk_leaves_the_old_file_as_it_was(dataset, tmp_path, room):
    """HDF5 itself would crash the process at its end."""
    (tmp_path / "data.h5").write_bytes(b"old")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    try:
        with pytest.raises(OSError) as error:
            export_hdf5(dataset, tmp_path / "data.h5")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert error.value.errno == errno.EFBIG and error.value.filename == str(tmp_path / "data.h5")
    assert [path.name for path in tmp_path.iterdir()] == ["data.h5"]
    assert (tmp_path / "data.h5").read_bytes() == b"old"
