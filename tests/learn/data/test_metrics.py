"""Scores, baselines, leakage and the array's ceiling against hand values and closed forms."""

import numpy as np
import pytest
from skimage.metrics import structural_similarity

from learn.data.metrics import aoa_error, score, ssim
from learn.data.neighbours import inverse_distance, nearest
from learn.data.split_distances import leakage
from learn.quantities.array_ceiling import array_ceiling
from scenes.files.errors import InputError
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.index_files import write_index
from simulate.spectra.angular_grid import AngularGrid, direction
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import normalise

GRID = AngularGrid()

# Scores


@pytest.fixture
def pictures():
    generator = np.random.default_rng(0)
    y = generator.normal(size=(3, 16)) + 1j * generator.normal(size=(3, 16))
    truth = normalise(Beamformer().spectrum(y))
    return np.clip(truth + 0.1 * generator.normal(size=truth.shape), 0, 1), truth


def test_ssim_is_scikit_images_with_a_data_range_of_1(pictures):
    expected = [structural_similarity(p, t, data_range=1) for p, t in zip(*pictures, strict=True)]
    np.testing.assert_array_equal(ssim(*pictures), expected)
    np.testing.assert_array_equal(score(*pictures, GRID).ssim, expected)
    assert ssim(pictures[1], pictures[1]) == pytest.approx(1)


def test_psnr_and_mean_absolute_error_by_hand():
    truth = np.zeros((3, 90, 360))
    prediction = truth.copy()
    prediction[0] += 0.1  # squared error 0.01: 20 dB
    prediction[1, :45] += 0.2  # half of the pixels: 0.02
    scores = score(prediction, truth, GRID)
    np.testing.assert_allclose(scores.psnr, [20, -10 * np.log10(0.02), 100])  # a perfect one is cut off at 100 dB
    np.testing.assert_allclose(scores.mae, [0.1, 0.1, 0])


def test_summary_is_of_the_test_spectra(pictures):
    scores = score(*pictures, GRID)
    summary = scores.summary()
    assert summary["ssim_median"] == sorted(scores.ssim)[1]
    assert summary["ssim_mean"] == pytest.approx(sum(scores.ssim) / 3)
    assert summary["ssim_p05"] == pytest.approx(
        np.sort(scores.ssim) @ [0.9, 0.1, 0]
    )  # a tenth of the way to the second
    assert summary["psnr_mean"] == pytest.approx(sum(scores.psnr) / 3)
    assert summary["mae_mean"] == pytest.approx(sum(scores.mae) / 3)
    assert summary["aoa_error_median_deg"] == sorted(scores.aoa_error)[1]


def bright(azimuth, elevation):
    """A picture whose maximum is at a whole degree of azimuth and elevation."""
    picture = np.zeros((1, 90, 360))
    picture[0, elevation - 1, azimuth] = 1  # on the grid that reaches boresight
    return picture


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        ((120, 40), (120, 40), 0.0),
        ((120, 40), (120, 55), 15.0),  # along a meridian
        ((359, 1), (1, 1), 2 * np.degrees(np.arcsin(np.cos(np.radians(1)) * np.sin(np.radians(1))))),  # about 2°
        ((0, 60), (180, 60), 60.0),  # over the zenith, not half a turn
        ((10, 90), (250, 90), 0.0),  # at boresight azimuth means nothing
        ((10, 89), (190, 89), 2.0),
        ((0, 45), (90, 45), 60.0),  # (1, 0, 1) · (0, 1, 1) / 2 = 1/2
    ],
)
def test_angle_of_arrival_error_of_known_directions(one, other, expected):
    for pair in ((one, other), (other, one)):
        assert aoa_error(*(bright(*where) for where in pair), AngularGrid(1.0))[0] == pytest.approx(expected, abs=1e-5)


def test_angle_of_arrival_error_of_plane_waves_across_the_seam(plane_waves):
    spectra = Beamformer().spectrum(np.array([plane_waves((1, azimuth, 30)) for azimuth in (359, 1)]))
    assert aoa_error(spectra[:1], spectra[1:], GRID)[0] == pytest.approx(2 * np.cos(np.radians(30)), abs=1e-3)


# Baselines


@pytest.fixture
def known():
    positions = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 4], [9, 9, 9]])
    return positions, np.random.default_rng(0).uniform(0, 1, (5, 90, 360))


def test_nearest_copies_the_picture_of_the_nearest_position(known):
    found = nearest(*known, np.array([[0.6, 0, 0], [0.4, 0, 0], [0, 0, 3.5], [100, 100, 100]]))
    np.testing.assert_array_equal(found, known[1][[1, 0, 3, 4]])


def test_inverse_distance_weighs_the_four_nearest_pictures(known):
    # at distances 1, 2, 1 and 5 from (0, 0, 0), (1, 0, 0)… : from (-1, 0, 0): 1, 2, √5, √17
    found = inverse_distance(*known, np.array([[-1.0, 0, 0]]))[0]
    weights = np.array([1, 1 / 2, 5**-0.5, 17**-0.5])
    expected = sum(w * p for w, p in zip(weights / weights.sum(), known[1][:4], strict=True))
    np.testing.assert_allclose(found, expected)


def test_inverse_distance_at_a_known_position_is_its_picture(known):
    np.testing.assert_allclose(inverse_distance(*known, known[0]), known[1], atol=1e-7)


def test_inverse_distance_does_with_fewer_than_four_pictures(known):
    positions, pictures = known[0][:2], known[1][:2]
    found = inverse_distance(positions, pictures, np.array([[0.25, 0, 0]]))[0]
    np.testing.assert_allclose(found, 0.75 * pictures[0] + 0.25 * pictures[1])


# Leakage


def test_leak_is_found_in_a_split_that_interleaves_a_path_and_not_in_one_that_cuts_it(tmp_path, write_folder):
    folder = write_folder(tmp_path / "path", count=60)
    found = leakage(read_dataset(folder))
    assert found.leaks and "blocked" in found.warning()
    dataset = read_dataset(folder)
    step = np.linalg.norm(np.diff(dataset.positions, axis=0), axis=1)
    assert step.min() <= np.median(found.distance) <= step.max()

    names = dataset.names
    write_index(folder / "train_index.txt", names[:40])
    write_index(folder / "test_index.txt", names[40:])
    cut = leakage(read_dataset(folder))
    assert not cut.leaks and "blocked" not in cut.facts()
    # nearest of all is the last training position, for every test position
    copied = ssim(np.stack([dataset.spectra[39]] * 20).astype(float), dataset.spectra[40:].astype(float))
    assert cut.ssim_median == pytest.approx(np.median(copied), abs=1e-6)


# The array's ceiling


def test_picture_that_the_array_can_make_is_under_its_ceiling(plane_waves):
    generator = np.random.default_rng(1)
    y = np.stack(
        [plane_waves((1, 200, 40), (0.6j, 60, 25)), generator.normal(size=16) + 1j * generator.normal(size=16)]
    )
    truth = normalise(Beamformer().spectrum(y))
    assert ssim(array_ceiling(truth, Beamformer()), truth).min() > 0.99


def test_picture_that_the_array_cannot_make_is_above_its_ceiling():
    """A beam of 5°, far narrower than a half-wavelength 4 × 4 array's 26°."""
    azimuth, elevation = np.meshgrid(np.arange(360), np.arange(1, 91))
    truth = np.exp(-((azimuth - 180) ** 2 + (elevation - 45) ** 2) / (2 * 2.5**2))[None]
    fitted = array_ceiling(truth, Beamformer())
    assert fitted.shape == truth.shape and ssim(fitted, truth)[0] < 0.9


# What users call


def test_ssim_and_angle_of_one_pair_are_numbers_and_of_a_stack_those_of_each(pictures):
    prediction, truth = pictures
    for metric in (ssim, aoa_error):
        each = metric(prediction, truth)
        assert [float(metric(p, t)) for p, t in zip(prediction, truth, strict=True)] == each.tolist()
        stacked = metric(prediction.reshape(3, 1, 90, 360), truth.reshape(3, 1, 90, 360))
        assert stacked.shape == (3, 1) and stacked.ravel().tolist() == each.tolist()


def test_ssim_of_single_precision_is_the_reported_figure(pictures):
    prediction, truth = (x.astype(np.float32) for x in pictures)
    assert ssim(prediction, truth).tolist() == score(prediction, truth, GRID).ssim.tolist()


@pytest.mark.parametrize("metric", [ssim, aoa_error])
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: np.round(255 * p).astype(np.uint8), "prediction: expected numbers from 0 to 1"),
        (lambda p: p[..., :180], "prediction: expected spectra of 90 x 360, found shape"),
        (lambda p: p[:2], "prediction: expected the shape of truth"),
    ],
)
def test_grey_levels_and_other_shapes_are_refused(pictures, metric, change, words):
    with pytest.raises(InputError, match=words):
        metric(change(pictures[0]), pictures[1])


@pytest.mark.parametrize("size", [(1, 8), (8, 1)])
def test_a_line_of_elements_is_scored_by_the_angle_to_the_line(size):
    """Its spectrum is the same all along a cone, so that the place of the maximum on the cone is chance."""
    array = PlanarArray(*size)
    azimuth, elevation = np.radians([[50.0, 130.0], [20.0, 70.0]])  # of two plane waves
    u = direction(azimuth, elevation)
    spectra = normalise(Beamformer(array).spectrum(array.manifold(azimuth, elevation)))
    axis = 0 if size[0] == 1 else 1
    true_angle = np.degrees(np.abs(np.diff(np.arccos(u[:, axis]))))[0]
    assert aoa_error(spectra[0], spectra[1], array=array) == pytest.approx(true_angle, abs=1.5)  # whole degrees
    noisy = np.clip(spectra[0] + 3e-3 * np.random.default_rng(0).normal(size=(90, 360)), 0, 1)
    assert aoa_error(noisy, spectra[0]) > 5 > aoa_error(noisy, spectra[0], array=array)
    assert score(noisy, spectra[0], array=array).aoa_error[0] == aoa_error(noisy, spectra[0], array=array)
