"""Models, losses and scores of arrays of given element positions."""

import numpy as np
import pytest

import bisplat
from learn.data.same_receiver import other_array
from learn.evaluation.picture_checks import picture_doubts
from learn.models.quadrature import quadrature
from scenes.scene.description import SPEED_OF_LIGHT
from simulate.dataset.written_dataset import write_dataset
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import ElementArray

pytestmark = pytest.mark.usefixtures("quick_fits")

FREQUENCY = 2.4e9
WAVELENGTH = SPEED_OF_LIGHT / FREQUENCY
CLOUD = ElementArray(np.random.default_rng(3).uniform(-0.06, 0.06, (12, 3)), FREQUENCY)
PLANAR = PlanarArray(3, 3)
SAME = ElementArray(PLANAR.positions * WAVELENGTH)


def of_a_source(folder, array, count=60, phases="common"):
    """The field of a source in free space, behind which the array's pictures are."""
    places = np.random.default_rng(1).uniform((1, -0.3, 1), (1.6, 0.3, 1.4), (count, 3))
    elements = array.positions if isinstance(array, PlanarArray) else array.at(FREQUENCY).positions
    distance = np.linalg.norm(places[:, None] / WAVELENGTH - elements, axis=-1)
    own = np.exp(2j * np.pi * np.random.default_rng(2).uniform(size=(count, 1))) if phases != "common" else 1
    return write_dataset(
        folder, places, own * np.exp(-2j * np.pi * distance) / distance, array, FREQUENCY, phases=phases
    )


def test_a_planar_array_in_metres_has_the_same_pixels_and_is_the_same_receiver():
    found, expected = quadrature(Beamformer(SAME.at(FREQUENCY))), quadrature(Beamformer(PLANAR))
    assert np.array_equal(found.rows, expected.rows) and np.array_equal(found.columns, expected.columns)
    np.testing.assert_allclose(found.weights, expected.weights, atol=1e-6)
    assert not other_array(PLANAR, SAME.at(FREQUENCY)) and not other_array(SAME.at(FREQUENCY), SAME.at(2.45e9))
    assert other_array(PLANAR, CLOUD) and other_array(SAME.at(FREQUENCY), SAME.at(3.6e9))


@pytest.mark.parametrize("model", ["helmholtz", "mlp-responses"])
def test_models_of_a_planar_array_in_metres_are_those_of_the_planar_array(model, tmp_path):
    options = {} if model == "helmholtz" else {"steps": 4}
    predicted = []
    for name, array in (("planar", PLANAR), ("metres", SAME)):
        dataset = of_a_source(tmp_path / name, array)
        run = bisplat.train(dataset, tmp_path / f"run-{name}", model=model, split="random", **options)
        predicted.append(bisplat.load_run(tmp_path / f"run-{name}").predict(dataset.positions[:5]).spectra)
        assert run.beamformer.array == dataset.array
    np.testing.assert_allclose(predicted[1], predicted[0], atol=1e-4)


def test_a_dataset_of_elements_is_trained_evaluated_and_checked(tmp_path):
    dataset = of_a_source(tmp_path / "cloud", CLOUD)
    run = bisplat.train(dataset, tmp_path / "run", model="helmholtz", split="random")
    evaluation = bisplat.evaluate(run)
    assert evaluation.metrics()["ssim_median"] > 0.9
    assert bisplat.check(tmp_path / "cloud", "random").valid and picture_doubts(dataset) == []


def test_phases_are_not_looked_for_behind_pictures_of_elements(tmp_path, capsys):
    pictures_alone = of_a_source(tmp_path / "cloud", CLOUD).with_values(response=None)
    bisplat.train(pictures_alone, tmp_path / "run", model="helmholtz", split="random")
    assert "no responses are looked for" in capsys.readouterr().err


def test_responses_of_a_phase_each_are_synchronised_without_flips(tmp_path):
    dataset = of_a_source(tmp_path / "cloud", CLOUD, phases="per-position")
    run = bisplat.train(dataset, tmp_path / "run", model="helmholtz", split="random")
    assert bisplat.evaluate(run, ceiling=False).metrics()["ssim_median"] > 0.9
