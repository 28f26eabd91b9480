"""A run on the closet's full-wave field, and datasets of two gateways that received the same transmitters."""

from pathlib import Path

import numpy as np
import pytest

import bisplat
from learn.models.kriging import stacking, vecchia
from learn.training.run_folder import Run
from simulate.dataset.index_files import write_index
from simulate.dataset.picture_files import encode_picture
from simulate.dataset.responses_file import write_responses
from simulate.dataset.spectra_folder import write_gateway
from simulate.fullwave.stored_field import read_stored_field
from simulate.positions.positions import write_positions
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import picture

FIELD = Path(__file__).parents[2] / "data" / "closet" / "field.npz"


@pytest.fixture(scope="session")
def folder(tmp_path_factory) -> Path:
    """one/ and two/: 140 spectra each, with noise of their own; the second array hangs upside down."""
    root = tmp_path_factory.mktemp("located")
    field = read_stored_field(FIELD)
    low, high = field.origin, field.origin + field.spacing * (np.array(field.values.shape[1:]) - 1)
    middle, size = (low + high) / 2, np.minimum(0.5, (high - low) * 0.9)
    positions = middle + (np.random.default_rng(0).random((140, 3)) - 0.5) * size
    names = [f"{number:05d}" for number in range(1, len(positions) + 1)]
    for seed, name in enumerate(("one", "two")):
        responses = field.responses(positions)[:, :: -1 if name == "two" else 1]
        noise = np.random.default_rng(seed).normal(size=(*responses.shape, 2)) @ [1, 1j]
        responses = responses + 0.1 * np.abs(responses).mean() * noise
        (root / name / "spectrum").mkdir(parents=True)
        for each, image in zip(names, picture(Beamformer().spectrum(responses)), strict=True):
            (root / name / "spectrum" / f"{each}.png").write_bytes(encode_picture(image))
        write_positions(root / name / "tx_pos.csv", positions)
        write_gateway(root / name / "gateway_info.yml", name, (0, 0, 1), (0, 0, 0, 1))
        write_index(root / name / "train_index.txt", names[:110])
        write_index(root / name / "test_index.txt", names[110:])
        write_responses(root / name / "channels.npz", responses)
    return root


@pytest.fixture(scope="session")
def runs(folder) -> list[Run]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vecchia, "ITERATIONS", 15)
        patch.setattr(stacking, "FOLDS", 1)
        return [bisplat.train(folder / name, folder / f"run-{name}") for name in ("one", "two")]
