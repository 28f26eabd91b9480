"""A described place and received powers alone correct gateways and materials."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest

import bisplat
from bisplat.__main__ import main
from learn.twin.calibrate_powers import (
    PowerCalibration,
    calibrate_powers_by,
    of_gateways,
    traced_powers,
    write_power_calibration,
)
from learn.twin.described_gateways import described_gateways
from learn.twin.power_likelihood import PowerFit
from scenes.files.errors import InputError, ParameterError
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import vary
from scenes.storage.scene_yaml import load_scene
from simulate.rays.core.propagation import Propagation
from simulate.rssi.rssi_dataset import read_rssi
from simulate.rssi.rssi_files import read_gateways
from tests.small_scene import CABINET, small_scene

COARSE = Propagation(max_depth=1, rays=20_000, diffraction=False)
TRUE = {"door": (0.0, 0.0, 1.5), "desk": (0.5, -1.2, 1.2), "wall": (2.5, -2.0, 1.4)}
ONLY_PLACES = Tolerances(objects=0, materials=0)


@pytest.fixture(scope="module")
def heard(tmp_path_factory):
    """Powers in steps of 1 dB at 80 positions, and where the gateways truly are."""
    folder = tmp_path_factory.mktemp("powers") / "true"
    return bisplat.simulate_rssi(small_scene(CABINET), folder, TRUE, n=80, propagation=COARSE)


def described(heard, folder, off):
    """The same powers, of gateways that are described to be elsewhere."""
    places = dict(zip(TRUE, (heard.gateway_positions + off).tolist(), strict=True))
    return bisplat.write_rssi(folder, heard.positions, heard.rssi_dbm, places, 915e6, floor_dbm=heard.floor_dbm)


def error(scene, gateways, data):
    """Median error of traced powers at the positions that were not used, dB."""
    off = data.rssi_dbm - 10 * np.log10(traced_powers(scene, gateways, data.positions, COARSE)[0])
    return np.median(np.abs(off - np.median(off[:50], axis=0))[50:])


@pytest.mark.slow
def test_gateways_and_materials_are_found(heard, tmp_path):
    allowed = Tolerances(position=0.06, objects=0, materials=0.2)
    place, rng = small_scene(CABINET), np.random.default_rng(3)
    off = rng.normal(size=(3, 3)) * 0.06
    data = described(heard, tmp_path / "wrong", off)
    materials = of_gateways(place, [], allowed)
    wrong = vary(place, materials, np.array([0.25, -0.2, 0.0][: len(materials)]))
    found = calibrate_powers_by(wrong, data, np.arange(50), allowed, COARSE)
    left = np.array([found.gateways[name].position for name in TRUE]) - list(TRUE.values())
    before, after = (np.linalg.norm(each, axis=1) for each in (off, left))
    assert after.mean() < 0.4 * before.mean()
    assert found.error[0] < 0.7 * found.error[1]
    assert error(found.scene, found.gateways, data) < 0.7 * error(wrong, described_gateways(data), data)
    predicted = found.predict(data.positions[50:])
    assert np.median(np.abs(predicted - data.rssi_dbm[50:])) < 1
    assert (found.deviations <= [1.001 * each.tolerance for each in found.which]).all()
    assert found.which[3].label == "gateway desk x"


@pytest.mark.slow
def test_a_tolerance_of_zero_keeps_the_places(heard):
    found = calibrate_powers_by(small_scene(CABINET), heard, np.arange(20), Tolerances(position=0, objects=0), COARSE)
    assert {each.kind for each in found.which} <= {"relative_permittivity", "conductivity", "thickness"}
    assert {name: each.position for name, each in found.gateways.items()} == TRUE


@pytest.mark.parametrize(
    ("changes", "tolerances", "expected"),
    [
        ({"frequency": 2.4e9}, ONLY_PLACES, "small: expected a scene of the dataset's wavelength of 0.3276 m, found"),
        ({}, Tolerances(position=0, objects=0, materials=0), "small: expected a tolerance above 0, found nothing"),
    ],
)
def test_what_does_not_fit_is_refused(heard, changes, tolerances, expected):
    with pytest.raises(InputError, match=expected):
        calibrate_powers_by(replace(small_scene(CABINET), **changes), heard, np.arange(5), tolerances, COARSE)


def test_silence_and_random_phases_are_refused(heard):
    silent = replace(heard, rssi_dbm=np.full_like(heard.rssi_dbm, np.nan))
    with pytest.raises(InputError, match="expected received powers at the known positions, found none"):
        calibrate_powers_by(small_scene(CABINET), silent, np.arange(5), ONLY_PLACES, COARSE)
    with pytest.raises(ParameterError, match="diffuse: expected no diffuse reflection"):
        calibrate_powers_by(small_scene(CABINET), heard, np.arange(5), propagation=Propagation(diffuse=True))
    with pytest.raises(ParameterError, match=r"carrier: expected 0, since powers do not tell it, found 0\.1"):
        calibrate_powers_by(small_scene(CABINET), heard, np.arange(5), Tolerances(carrier=0.1))


def test_the_simulated_antennas_are_those_of_the_gateways(tmp_path):
    gateways = {"desk": bisplat.Gateway((0.5, -1.2, 1.2), bisplat.facing((0, 1, 0)), pattern="dipole")}
    data = bisplat.simulate_rssi(small_scene(CABINET), tmp_path / "data", gateways, n=3, propagation=COARSE)
    found = described_gateways(data)["desk"]
    assert found.pattern == "dipole" and found.count == 1
    np.testing.assert_allclose(found.boresight, [0, 1, 0], atol=1e-9)


def test_changes_and_gateways_are_written_down(heard, tmp_path):
    which = of_gateways(small_scene(CABINET), list(TRUE), ONLY_PLACES)
    gateways = described_gateways(heard)
    nothing = np.zeros((1, 3))
    fit = PowerFit(nothing[0], nothing, nothing, nothing, nothing, np.array([1.0, 2, 3]), 0.1)
    found = PowerCalibration(
        small_scene(CABINET), gateways, which, np.full(9, 0.01), np.full(9, 0.002), (1.5, 4.0), fit
    )
    write_power_calibration(found, tmp_path)
    assert read_gateways(tmp_path / "gateways.yml") == gateways
    assert load_scene(tmp_path / "scene.yaml").gateway == small_scene().gateway
    record = json.loads((tmp_path / "calibration.json").read_text())
    assert record["median_error_db"] == {"described": 4.0, "corrected": 1.5}
    assert record["levels_dbm"] == {"door": 1.0, "desk": 2.0, "wall": 3.0}
    assert record["changes"][3]["what"] == "gateway desk x"


@pytest.mark.slow
def test_the_command_writes_gateways_for_the_next_simulation(heard, tmp_path, monkeypatch, capsys):
    data = described(heard, tmp_path / "wrong", np.array([0.04, -0.03, 0.02]))
    place = bisplat.write_scene(small_scene(CABINET), tmp_path / "described")
    coarse = ("--max-depth", "1", "--no-diffraction", "--rays", "20000")
    only = ("--position", "0.03", "--objects", "0", "--materials", "0", "--split", "random")
    arguments = ["calibrate", place, data.folder, "-o", tmp_path / "corrected", *only, *coarse]
    monkeypatch.setattr(sys, "argv", ["bisplat", *map(str, arguments)])
    main()
    found = read_gateways(tmp_path / "corrected" / "gateways.yml")
    assert list(found) == list(read_rssi(data.folder).gateway_names)
    assert "median error of the received powers: " in capsys.readouterr().out
