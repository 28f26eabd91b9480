"""The measured spectra of the NeRF² sample, where they lie: the figures that every table is read against."""

from pathlib import Path

import numpy as np
import pytest

from learn.data.metrics import ssim
from learn.data.neighbours import inverse_distance, nearest
from learn.data.split_distances import leakage
from learn.data.splits import split
from learn.models.kriging.helmholtz import HelmholtzField
from learn.training.prediction import predict
from simulate.dataset.dataset_folder import read_dataset
from simulate.spectra.spectrum import spectrum_of

FOLDER = Path(__file__).parents[3] / "shared" / "data" / "rfid-s23-160"

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"the measured spectra are not at {FOLDER}")


@pytest.fixture(scope="module")
def rfid():
    return read_dataset(FOLDER)


def mean_picture(places, known, positions):
    return np.broadcast_to(known.mean(axis=0), (len(positions), 90, 360))


def median_ssim(dataset, kind, baseline):
    parts = split(dataset, kind, seed=0)
    spectra, positions = dataset.spectra.astype(float), dataset.positions
    known = positions[parts.known], spectra[parts.known]
    return np.median(ssim(baseline(*known, positions[parts.test]), spectra[parts.test]))


@pytest.mark.parametrize(
    ("kind", "baseline", "expected"),
    [("files", nearest, 0.972), ("blocked", inverse_distance, 0.712), ("blocked", mean_picture, 0.627)],
)
def test_baselines_score_what_was_measured_before_the_start(rfid, kind, baseline, expected):
    assert median_ssim(rfid, kind, baseline) == pytest.approx(expected, abs=1e-3)


def test_folders_own_split_leaks(rfid):
    found = leakage(rfid)
    assert found.leaks
    assert found.ssim_median == pytest.approx(0.972, abs=1e-3)


def test_whole_folder_is_read(rfid):
    assert rfid.pictures.shape == (160, 90, 360)
    assert len(rfid.train) == 128 and len(rfid.test) == 32
    assert rfid.quantities == ["spectrum"] and rfid.metadata == {}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "baseline", "ahead"), [("files", nearest, 0.002), ("blocked", inverse_distance, 0.025)]
)
def test_helmholtz_is_ahead_of_copying_and_sees_the_place_change(rfid, kind, baseline, ahead):
    parts = split(rfid, kind, seed=0)
    field = HelmholtzField(np.zeros((2, 3)), rfid.beamformer, rfid.wavelength)
    field.fit(rfid, parts.known)
    prediction = predict(field, rfid.positions[parts.test]).spectra
    found = np.median(ssim(prediction, spectrum_of(rfid.pictures[parts.test])))
    assert found > median_ssim(rfid, kind, baseline) + ahead
    assert all(float(kriged.drift) < len(rfid.names) for kriged in field.fields.values())
