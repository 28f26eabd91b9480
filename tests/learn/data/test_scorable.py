"""Spectra that show no direction are said and not scored: constant ones, and those of one or two elements."""

from dataclasses import replace

import numpy as np
import pytest

from learn.data.metrics import scorable
from learn.evaluation.crossvalidate import crossvalidate
from learn.evaluation.evaluate import evaluate
from learn.evaluation.picture_checks import picture_doubts
from learn.fitted.runs import load_run
from scenes.files.errors import InputError
from scenes.places.built_in import lab
from scenes.scene.antennas import Transmitter
from simulate.dataset.dataset_folder import read_dataset
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import Identification
from tests.simulate.engines.told import Told

pytestmark = pytest.mark.usefixtures("small_models", "no_ceiling")


@pytest.fixture
def blackened(tiny):
    """Function: the dataset ``tiny`` in which some pictures are of one level."""

    def made(indices, level=0):
        dataset = read_dataset(tiny)
        pictures = dataset.pictures.copy()
        pictures[indices] = level
        return dataset.with_values(spectrum=pictures)

    return made


def of_array(dataset, rows, columns):
    known = Identification(Beamformer(PlanarArray(rows, columns)), source="metadata")
    return replace(dataset, receiver=replace(dataset.receiver, identification=known))


@pytest.mark.parametrize("level", [0, 120])
def test_constant_pictures_are_left_out_and_counted(blackened, level, capsys):
    dataset = blackened([3, 7], level)
    np.testing.assert_array_equal(scorable(dataset, np.array([2, 3, 7, 8])), [2, 8])
    assert "2 of 4 test spectra are constant" in capsys.readouterr().err
    np.testing.assert_array_equal(scorable(dataset, np.array([2, 8])), [2, 8])
    assert not capsys.readouterr().err
    with pytest.raises(InputError, match="expected test spectra that show a direction, found 2 constant ones"):
        scorable(dataset, np.array([3, 7]))


def test_evaluation_leaves_them_out_of_all_scores(finished_run, tiny, blackened):
    run = load_run(finished_run)
    shown = evaluate(run, blackened([3, 7]))
    assert len(shown) == 22 and not {3, 7} & set(shown.test)
    # A little lighter in one place: another dataset, of which all are scored.
    changed = read_dataset(tiny).pictures.copy()
    changed[0, 0, 0] ^= 1
    full = evaluate(run, read_dataset(tiny).with_values(spectrum=changed))
    for name, scores in shown.scores.items():
        assert len(scores.ssim) == 22
        np.testing.assert_allclose(scores.ssim, np.delete(full.scores[name].ssim, [3, 7]), atol=1e-3)
    with pytest.raises(InputError, match="found 24 constant ones"):
        evaluate(run, blackened(slice(None)))


def test_cross_validation_leaves_out_where_nothing_is_received(finished_run, capsys):
    class Deaf:
        def responses(self, positions):
            received = np.ones((len(positions), 16), np.complex64)
            received[::3] = 0
            return received

    gateway = replace(lab().gateway, position=(0.0, 0.0, 1.0), orientation=(0.0, 0.0, 0.0, 1.0))
    hall = replace(lab(), gateway=gateway, transmitter=Transmitter((0, 0, 0.5), (4, 1, 1.5)))
    fresh = crossvalidate(finished_run, hall, 12, 5, Told(Deaf()))
    assert (
        len(fresh) == len(fresh.positions) == len(fresh.truth) == len(fresh.prediction) == len(fresh.scores.ssim) == 8
    )
    assert fresh.metrics()["positions"] == 8 and len(fresh.correlation) == 8 and np.ptp(fresh.truth[0]) > 0
    assert "4 of 12 test spectra are constant" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("rows", "columns", "why"),
    [(1, 1, "the same at every position"), (1, 2, "single fringes"), (2, 1, "fringes")],
)
def test_one_or_two_elements_are_refused_by_evaluation_and_doubted_by_check(finished_run, tiny, rows, columns, why):
    dataset = of_array(read_dataset(tiny), rows, columns)
    with pytest.raises(InputError, match=f"at least 3 elements to score spectra, found {rows} × {columns}: .*{why}"):
        evaluate(finished_run, dataset)
    (doubt,) = picture_doubts(dataset)
    assert why in doubt and doubt.endswith("so they are not scored")


def test_three_elements_are_scored(finished_run, tiny):
    assert len(evaluate(finished_run, of_array(read_dataset(tiny), 1, 3))) == 5
