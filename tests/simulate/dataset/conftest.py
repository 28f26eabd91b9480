"""A small valid dataset folder, to be read, changed and spoilt."""

from pathlib import Path

import numpy as np
import pytest

from simulate.dataset.index_files import write_index
from simulate.dataset.metadata import write_metadata
from simulate.dataset.picture_files import encode_picture
from simulate.dataset.responses_file import write_responses
from simulate.dataset.spectra_folder import write_gateway
from simulate.positions.positions import write_positions
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import picture

COUNT = 5
NAMES = [f"{number:05d}" for number in range(1, COUNT + 1)]
TRAIN, TEST = ["00001", "00003", "00004", "00005"], ["00002"]
GENERATOR = np.random.default_rng(6)
RESPONSES = (GENERATOR.normal(size=(COUNT, 16, 2)) @ [1, 1j]).astype(np.complex64)
POSITIONS = GENERATOR.uniform(-3, 3, (COUNT, 3)).round(6)
PICTURES = picture(Beamformer().spectrum(RESPONSES))
METADATA = {
    "array": {"rows": 4, "columns": 4, "spacing": 0.5},
    "grid": {"elevation_first_deg": 0.0, "elevation_step_deg": 1.0, "azimuth_step_deg": 1.0},
}
ORIENTATION = [0.5, -0.5, -0.5, 0.5]


@pytest.fixture
def folder(tmp_path) -> Path:
    """A valid dataset of five spectra, with all that we add to NeRF²'s format."""
    (tmp_path / "spectrum").mkdir()
    for name, image in zip(NAMES, PICTURES, strict=True):
        (tmp_path / "spectrum" / f"{name}.png").write_bytes(encode_picture(image))
    write_positions(tmp_path / "tx_pos.csv", POSITIONS)
    write_gateway(tmp_path / "gateway_info.yml", "tiny", [1.0, 2.0, 1.5], ORIENTATION)
    write_index(tmp_path / "train_index.txt", TRAIN)
    write_index(tmp_path / "test_index.txt", TEST)
    write_responses(tmp_path / "channels.npz", RESPONSES)
    write_metadata(tmp_path / "metadata.json", METADATA)
    return tmp_path
