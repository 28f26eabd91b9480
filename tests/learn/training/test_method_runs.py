"""Runs of received powers, channels and responses over a band: fitted, kept in a folder, and loaded again."""

import numpy as np
import pytest

import bisplat
from learn.training.run_folder import load_spectra
from scenes.files.errors import InputError

ROWS = np.random.default_rng(0)
PLACES = ROWS.uniform(0, 3, (30, 3))
OF_POWERS = {"powers": ROWS.normal(-60, 4, (30, 2)), "gateways": {"a": (0, 0, 2), "b": (3, 0, 2)}}


@pytest.fixture
def powers(tmp_path):
    return bisplat.write_dataset(tmp_path / "powers", PLACES, **OF_POWERS, frequency="2.4 GHz")


@pytest.mark.parametrize("settings", [{"model": "helmholtz"}, {"model": "nerf2", "steps": 2}], ids=["closed", "steps"])
def test_a_loaded_run_predicts_the_same(powers, tmp_path, settings):
    run = bisplat.train(powers, tmp_path / "run", split="random", **settings)
    again = bisplat.load_run(tmp_path / "run")
    expected = run.predict(PLACES[:3]).value
    np.testing.assert_allclose(again.predict(PLACES[:3]).value, expected, rtol=1e-6)
    np.testing.assert_array_equal(bisplat.train(powers, tmp_path / "run", split="random", **settings).fitted.known,
                                  run.split(powers).known)  # fmt: skip
    assert expected.shape == (3, 2) and again.dataset().folder == powers.folder


def test_channels_are_predicted_from_uplinks(tmp_path):
    channels = ROWS.normal(size=(30, 2, 8, 2)) @ [1, 1j]
    data = bisplat.write_dataset(
        tmp_path / "links", None, channels=channels, antennas=np.zeros((2, 3)), frequency="2.4 GHz"
    )
    run = bisplat.train(data, tmp_path / "run", model="nearest", split="random")
    uplink = run.fitted.quantity.given(data, run.fitted.known[:2])
    np.testing.assert_allclose(run.predict(None, uplink).value, run.fitted.quantity.of(data, run.fitted.known[:2]))
    with pytest.raises(InputError, match="given: expected"):
        run.predict(None)


def test_what_is_not_its_own_is_refused(powers, tmp_path):
    run = bisplat.train(powers, tmp_path / "run", model="mean", split="random")
    with pytest.raises(InputError, match="expected a run of spectra"):
        load_spectra(run)
    with pytest.raises(InputError, match="model: expected"):
        bisplat.train(powers, tmp_path / "other", model="bisplat", split="random")
    assert not (tmp_path / "other").exists()
    (powers.folder / "gateway_rssi.csv").write_text(
        (powers.folder / "gateway_rssi.csv").read_text().replace("-6", "-5")
    )
    with pytest.raises(InputError, match="was trained on"):
        bisplat.load_run(tmp_path / "run")
