"""``bisplat simulate``: several gateways, a receiver's errors, a folder made once more."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scenes.scene.orientation import facing
from scenes.storage.scene_writing import write_scene
from simulate.dataset.dataset_folder import read_dataset
from tests.folders import contents
from tests.small_scene import small_scene

DIRECT = ("--max-depth", "0")


@pytest.fixture
def simulate(command):
    """Function: words after ``bisplat simulate``, the output's second -> stderr; it must end with this status."""

    def run(scene, output, *options, status=0):
        ended, _, err = command("simulate", scene, "-o", output, *options)
        assert ended == status, err
        return err

    return run


@pytest.fixture(scope="module")
def two_gateways(tmp_path_factory) -> Path:
    """A scene YAML of two gateways over a floor."""
    scene = small_scene()
    second = replace(scene.gateway, position=(5.0, 0.0, 1.5), orientation=facing((-1, 0, 0)), rows=2)
    return write_scene(replace(scene, further_gateways={"east": second}), tmp_path_factory.mktemp("scene"))


def test_each_gateway_gets_a_folder_of_the_same_positions(simulate, two_gateways, tmp_path):
    simulate(two_gateways, tmp_path, "-n", 5, *DIRECT)
    first, second = read_dataset(tmp_path / "gateway1"), read_dataset(tmp_path / "east")
    assert (first.positions == second.positions).all()
    assert (first.responses.shape, second.responses.shape) == ((5, 16), (5, 8))
    np.testing.assert_allclose(second.gateway_position, [5, 0, 1.5])


def test_folder_of_the_last_gateway_is_looked_at_before_the_work_for_the_first(simulate, two_gateways, tmp_path):
    (tmp_path / "east").mkdir()
    (tmp_path / "east" / "thesis.tex").write_text("precious")
    err = simulate(two_gateways, tmp_path, "-n", 5, *DIRECT, status=1)
    assert f"{tmp_path / 'east'}: expected a new folder" in err
    assert contents(tmp_path) == {"east": b"", "east/thesis.tex": b"precious"}


def test_receivers_errors_are_as_large_as_asked_for_and_each_arrays_own(simulate, two_gateways, tmp_path):
    simulate(two_gateways, tmp_path / "ideal", "-n", 5, *DIRECT)
    simulate(two_gateways, tmp_path / "real", "-n", 5, *DIRECT, "--phase-error-deg", 10)
    errors = []
    for name in ("gateway1", "east"):
        ideal, real = (read_dataset(tmp_path / kind / name).responses for kind in ("ideal", "real"))
        errors.append(np.angle(real / ideal, deg=True))
        assert np.ptp(errors[-1], axis=0).max() < 1e-3  # the same in every spectrum
        assert 4 < errors[-1][0].std() < 20
    assert np.abs(errors[0][0, :8] - errors[1][0]).max() > 1


def test_folder_made_once_more_is_the_same_with_its_own_settings(simulate, two_gateways, tmp_path):
    simulate(two_gateways, tmp_path / "a", "-n", 5, "--seed", 4, *DIRECT, "--snr-db", 10, "--power-db")
    simulate(tmp_path / "a" / "east", tmp_path / "again")
    assert contents(tmp_path / "again") == contents(tmp_path / "a" / "east")
    assert (tmp_path / "again" / "power_db" / "00005.tif").exists()


def test_old_and_new_spellings_of_the_options_are_the_same(simulate, two_gateways, tmp_path):
    common = ["--max-depth", "1", "--no-diffraction", "--no-specular", "--rays", "500"]
    old = "-n 3 --snr 12 --gain-error 1 --phase-error 2 --phase-noise 3".split()
    new = "--spectra 3 --snr-db 12 --gain-error-db 1 --phase-error-deg 2 --phase-noise-deg 3".split()
    for name, options in (("old", old), ("new", new)):
        simulate(two_gateways, tmp_path / name, *common, *options)
    assert contents(tmp_path / "old") == contents(tmp_path / "new")
