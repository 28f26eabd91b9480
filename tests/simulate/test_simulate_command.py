"""``bisplat simulate`` as a user types it: several gateways, a receiver's errors, a folder made once more."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bisplat
from scenes.description import facing
from scenes.errors import InputError
from scenes.scene_yaml import write_scene
from simulate.command import MeasurementOptions
from simulate.dataset import read_dataset
from simulate.propagation import Propagation

DIRECT = Propagation(max_depth=0)


@pytest.fixture(scope="module")
def two_gateways(make_scene, floor, tmp_path_factory) -> Path:
    """A scene YAML of two gateways over a floor."""
    scene = make_scene(floor)
    second = replace(scene.gateway, position=(-7.0, 0.0, 1.5), orientation=facing((1, 0, 0)), rows=2)
    return write_scene(replace(scene, further_gateways={"west": second}), tmp_path_factory.mktemp("scene"))


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_each_gateway_gets_a_folder_of_the_same_positions(two_gateways, tmp_path):
    bisplat.simulate(str(two_gateways), tmp_path, spectra=5, propagation=DIRECT)
    first, second = read_dataset(tmp_path / "gateway1"), read_dataset(tmp_path / "west")
    assert (first.positions == second.positions).all()
    assert first.responses is not None and second.responses is not None
    assert first.responses.shape == (5, 16)
    assert second.responses.shape == (5, 8)
    np.testing.assert_allclose(second.gateway_position, [-7, 0, 1.5])


def test_receivers_errors_are_as_large_as_asked_for_and_each_arrays_own(two_gateways, tmp_path):
    bisplat.simulate(str(two_gateways), tmp_path / "ideal", spectra=5, propagation=DIRECT)
    bisplat.simulate(
        str(two_gateways),
        tmp_path / "real",
        spectra=5,
        propagation=DIRECT,
        measurement=MeasurementOptions(phase_error_deg=10.0),
    )
    errors = []
    for name in ("gateway1", "west"):
        ideal, real = (read_dataset(tmp_path / kind / name).responses for kind in ("ideal", "real"))
        errors.append(np.angle(real / ideal, deg=True))
        assert np.ptp(errors[-1], axis=0).max() < 1e-3  # the same in every spectrum
        assert 4 < errors[-1][0].std() < 20
    assert np.abs(errors[0][0, :8] - errors[1][0]).max() > 1


def test_folder_made_once_more_is_the_same_with_its_own_settings(two_gateways, tmp_path):
    noisy = MeasurementOptions(snr_db=10.0)
    bisplat.simulate(str(two_gateways), tmp_path / "a", 5, seed=4, propagation=DIRECT, measurement=noisy, power_db=True)
    bisplat.simulate(str(tmp_path / "a" / "west"), tmp_path / "again")
    assert contents(tmp_path / "again") == contents(tmp_path / "a" / "west")
    assert (tmp_path / "again" / "power_db" / "00005.tif").exists()


def test_no_workers_is_wrong(two_gateways, tmp_path):
    with pytest.raises(InputError, match="workers: expected at least 1, found 0"):
        bisplat.simulate(str(two_gateways), tmp_path / "out", workers=0)
