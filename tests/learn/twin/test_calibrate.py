"""Spectra, or received powers alone, correct a scene; they are refused where they were not measured there."""

import json
from dataclasses import replace

import numpy as np
import pytest

import bisplat
from learn.data.splits import split
from learn.twin import calibrate as calibrate_module
from learn.twin.calibrate import _by_spectra, calibrate, correct, of_gateways
from learn.twin.calibration import RECORD, Calibration, write_calibration
from learn.twin.described_gateways import alone, described_gateways
from learn.twin.power_residual import PowerFit, path_powers
from learn.twin.response_residual import ResponseFit
from scenes.files.errors import InputError, ParameterError
from scenes.scene.description import SceneObject
from scenes.scene.shapes import box
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import Unknown, unknowns, vary
from scenes.storage.scene_writing import write_scene
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset_folder import read_dataset
from simulate.generation.listening_gateways import read_gateways
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from simulate.spectra.array import PlanarArray
from simulate.spectra.band import Band
from tests.small_scene import CABINET, small_scene

OF_POSITION = [Unknown("position", "", axis, 0.02) for axis in range(3)]
COARSE = Propagation(max_depth=1, rays=20_000, diffraction=False)
FLAGS = ("--max-depth", "1", "--no-diffraction", "--rays", "20000")  # the same for a command
EXACT = Tolerances(position=0, rotation=0, objects=0, materials=0)


def calibration(scene, misfit, which=(), values=(), deviations=(), gain=1 + 0j):
    """By spectra."""
    fit = ResponseFit(0.0, misfit[0], gain, np.zeros((1, 16)))
    return Calibration(scene, {}, list(which), np.array(values), np.array(deviations), misfit, fit)


def received_in_the_small_scene(data):
    """A dataset as if its gateway were that of the small scene."""
    gateway = small_scene().gateway
    at, orientation = np.array(gateway.position), np.array(gateway.orientation)
    return replace(data, receiver=replace(data.receiver, position=at, orientation=orientation))


@pytest.mark.parametrize(
    ("of_scene", "array", "tolerances", "expected"),
    [
        ({"frequency": 2.4e9}, PlanarArray(), Tolerances(), "found 2400 MHz"),
        ({}, PlanarArray(2, 4), Tolerances(), "the scene's array, 4 × 4 elements .*, found those of 2 × 4"),
        ({}, PlanarArray(), Tolerances(), r"gateway_info\.yml: .* found one 0\.5 m away"),
        ({}, PlanarArray(), EXACT, "expected a tolerance above 0"),
    ],
)
def test_what_was_not_measured_there_is_refused(tiny, of_scene, array, tolerances, expected):
    data = read_dataset(tiny)
    identification = replace(data.identification, beamformer=replace(data.beamformer, array=array))
    data = replace(data, receiver=replace(data.receiver, identification=identification))
    with pytest.raises(InputError, match=expected):
        correct(replace(small_scene(CABINET), **of_scene), data, np.arange(3), tolerances)
    with pytest.raises(ParameterError, match="diffuse: expected no diffuse reflection"):
        correct(small_scene(CABINET), data, np.arange(3), propagation=Propagation(diffuse=True))


def test_spectra_without_power_are_refused(tiny):
    data = received_in_the_small_scene(read_dataset(tiny))
    black = data.with_values(response=None, spectrum=np.zeros_like(data.pictures))
    with pytest.raises(InputError, match="small: expected spectra of several grey levels"):
        correct(small_scene(CABINET), black, np.arange(3), propagation=COARSE)


def test_spectra_are_taken_evenly_from_those_that_are_not_held_out(tiny, monkeypatch):
    used = []

    def correct(place, data, known, *options):
        used.extend(known)
        return calibration(place, (0.1, 0.5))

    monkeypatch.setattr(calibrate_module, "correct", correct)
    known = split(read_dataset(tiny), "random", 3).known
    calibrate(small_scene(CABINET), tiny, 4, split="random", seed=3)
    assert len(used) == 4 and set(used) < set(known)
    assert {used[0], used[-1]} == {known[0], known[-1]}
    with pytest.raises(ParameterError, match="n: expected"):
        calibrate(small_scene(CABINET), tiny, 0)


@pytest.mark.parametrize("recorded", [True, False])
def test_a_band_is_used_at_four_subcarriers_unless_each_position_has_a_phase_of_its_own(tiny, recorded):
    data, band = received_in_the_small_scene(read_dataset(tiny)), Band(20e6, 16)
    carrier = np.arange(1, 16 * len(data) + 1).reshape(-1, 16) * 1j
    responses = carrier[..., None] * np.exp(1j * (np.arange(16) - 8))
    values = {"response": responses} if recorded else {"response": None, "retrieved": responses}
    data = replace(data.with_values(**values), band=band)
    search = _by_spectra(small_scene(CABINET), data, np.arange(3), Tolerances(), COARSE, print)
    measured = search.stages[-1].measured
    assert search.stages[-1].phases_known == recorded and len(search.stages) == 1 + recorded
    if not recorded:
        np.testing.assert_array_equal(measured, carrier[:3])
        assert search.ratios == (1.0,)
        return
    chosen = [0, 5, 10, 15]
    np.testing.assert_allclose(search.ratios, band.frequencies(915e6)[chosen] / 915e6)
    np.testing.assert_allclose(measured.reshape(3, 4, -1)[:, 2], responses[:3, :, chosen[2]])


def test_spectra_of_another_place_are_warned_of(tiny, monkeypatch, capsys):
    """The positions of ``tiny`` reach to x = 4 m, those of this scene end at 3 m, and nothing explains the power."""
    outdoors = replace(small_scene(CABINET), objects=(SceneObject("block", box((0, 0, 0), (1, 1, 1)), "concrete"),))
    found = calibration(outdoors, (0.93, 0.99))
    monkeypatch.setattr(calibrate_module, "correct", lambda *arguments: found)
    assert calibrate(outdoors, tiny) is found
    said = " ".join(capsys.readouterr().err.split())
    assert "positions are far outside the box around the scene" in said
    assert "93% of the measured power is unexplained by the corrected scene (99% before)" in said


def test_changes_are_written_down(tmp_path):
    namesake = SceneObject("gateway", box((1.0, 1.5, 0.5), (3.0, 2.0, 2.0)), "metal")  # so is an unknown's kind
    scene = small_scene(namesake)
    which = unknowns(scene, Tolerances(position=0.01, rotation=1.0, objects=0.02, materials=0.1))
    values, deviations = np.linspace(-0.01, 0.01, len(which)), np.full(len(which), 0.005)
    found = calibration(scene, (0.1, 0.5), which, values, deviations, 2j)
    write_calibration(found, tmp_path)
    assert load_scene(tmp_path / "scene.yaml").gateway == scene.gateway
    record = json.loads((tmp_path / RECORD).read_text())
    assert [each["change"] for each in record["changes"]] == values.tolist()
    assert record["unexplained_power"] == {"described": 0.5, "corrected": 0.1} and record["gain"] == [0, 2]
    rows = {row["what"]: row for row in found.rows()[:6]}
    assert rows["gateway x"]["changed by"] == "-10.0 mm" and rows["gateway x"]["± before"] == "10.0 mm"
    assert rows["gateway rotation about z"]["±"] == "0.29°"


@pytest.mark.slow
def test_command_writes_the_corrected_scene(tmp_path, bisplat_command):
    """Its gateway is where the spectra were received, and not where it is described."""
    data = bisplat.simulate(small_scene(CABINET), tmp_path / "data", n=12, propagation=COARSE)
    wrong = vary(small_scene(CABINET), OF_POSITION, np.array([0.03, -0.02, 0.02]))
    described = write_scene(wrong, tmp_path / "described")
    only_pose = ("--objects", "0", "--materials", "0", "--rotation", "1")
    arguments = ["calibrate", described, data.folder, "-o", tmp_path / "corrected", "-n", "9", *only_pose, *FLAGS]
    status, out, _ = bisplat_command(*arguments)
    assert status == 0 and "gateway x" in out and "unexplained share of the measured power: " in out
    found = load_scene(tmp_path / "corrected" / "scene.yaml")
    np.testing.assert_allclose(found.gateway.position, small_scene().gateway.position, atol=0.002)
    status, _, err = bisplat_command(*arguments)
    assert status == 1 and "--force" in err


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
    return bisplat.write_dataset(
        folder, heard.positions, powers=heard.powers, gateways=places, frequency=915e6, floor_dbm=heard.floor_dbm
    )


def error(scene, gateways, data):
    """Median error of traced powers at the positions that were not used, dB."""
    tracers = [Tracer(each, COARSE) for each in alone(scene, gateways).values()]
    off = data.powers - 10 * np.log10(path_powers(tracers, data.positions)[0])
    return np.median(np.abs(off - np.median(off[:50], axis=0))[50:])


@pytest.mark.slow
def test_gateways_and_materials_are_found(heard, tmp_path):
    allowed = Tolerances(position=0.06, objects=0, materials=0.2)
    place, rng = small_scene(CABINET), np.random.default_rng(3)
    off = rng.normal(size=(3, 3)) * 0.06
    data = described(heard, tmp_path / "wrong", off)
    materials = of_gateways(place, [], allowed)
    wrong = vary(place, materials, np.array([0.25, -0.2, 0.0][: len(materials)]))
    found = correct(wrong, data, np.arange(50), allowed, COARSE)
    left = np.array([found.gateways[name].position for name in TRUE]) - list(TRUE.values())
    before, after = (np.linalg.norm(each, axis=1) for each in (off, left))
    assert after.mean() < 0.4 * before.mean()
    assert found.misfit[0] < 0.7 * found.misfit[1]
    assert error(found.scene, found.gateways, data) < 0.7 * error(wrong, described_gateways(data), data)
    predicted = found.predict(data.positions[50:])
    assert np.median(np.abs(predicted - data.powers[50:])) < 1
    assert (found.deviations <= [1.001 * each.tolerance for each in found.which]).all()
    assert found.which[3].label == "gateway desk x"


@pytest.mark.slow
def test_a_tolerance_of_zero_keeps_the_places(heard):
    found = correct(small_scene(CABINET), heard, np.arange(20), Tolerances(position=0, objects=0), COARSE)
    assert {each.kind for each in found.which} <= {"relative_permittivity", "conductivity", "thickness"}
    assert {name: each.position for name, each in found.gateways.items()} == TRUE


def test_powers_that_do_not_fit_are_refused(heard):
    place, known = small_scene(CABINET), np.arange(5)
    silent = heard.with_values(power=np.full_like(heard.powers, np.nan))
    with pytest.raises(InputError, match="small: expected 915 MHz"):
        correct(replace(place, frequency=2.4e9), heard, known, ONLY_PLACES, COARSE)
    with pytest.raises(InputError, match="expected received powers at the known positions"):
        correct(place, silent, known, ONLY_PLACES, COARSE)
    with pytest.raises(ParameterError, match="carrier: "):
        correct(place, heard, known, Tolerances(carrier=0.1))


def test_the_simulated_antennas_are_those_of_the_gateways(tmp_path):
    gateways = {"desk": bisplat.Gateway((0.5, -1.2, 1.2), bisplat.facing((0, 1, 0)), pattern="dipole")}
    data = bisplat.simulate_rssi(small_scene(CABINET), tmp_path / "data", gateways, n=3, propagation=COARSE)
    found = described_gateways(data)["desk"]
    assert found.pattern == "dipole" and found.count == 1
    np.testing.assert_allclose(found.boresight, [0, 1, 0], atol=1e-9)


def test_changes_by_powers_and_gateways_are_written_down(heard, tmp_path):
    which = of_gateways(small_scene(CABINET), list(TRUE), ONLY_PLACES)
    gateways = described_gateways(heard)
    nothing = np.zeros((1, 3))
    fit = PowerFit(nothing[0], nothing, nothing, nothing, nothing, np.array([1.0, 2, 3]), 0.1, 1.5)
    found = Calibration(small_scene(CABINET), gateways, which, np.full(9, 0.01), np.full(9, 0.002), (1.5, 4.0), fit)
    write_calibration(found, tmp_path)
    assert read_gateways(tmp_path / "gateways.yml") == gateways
    assert load_scene(tmp_path / "scene.yaml").gateway == small_scene().gateway
    record = json.loads((tmp_path / "calibration.json").read_text())
    assert record["median_error_db"] == {"described": 4.0, "corrected": 1.5}
    assert record["levels_dbm"] == {"door": 1.0, "desk": 2.0, "wall": 3.0}
    assert record["changes"][3]["what"] == "gateway desk x"


@pytest.mark.slow
def test_command_writes_gateways_for_the_next_simulation(heard, tmp_path, bisplat_command):
    data = described(heard, tmp_path / "wrong", np.array([0.04, -0.03, 0.02]))
    place = bisplat.write_scene(small_scene(CABINET), tmp_path / "described")
    only = ("--position", "0.03", "--objects", "0", "--materials", "0", "--split", "random")
    arguments = ["calibrate", place, data.folder, "-o", tmp_path / "corrected", *only, *FLAGS]
    status, out, _ = bisplat_command(*arguments)
    assert status == 0 and "median error of the received powers: " in out
    found = read_gateways(tmp_path / "corrected" / "gateways.yml")
    assert list(found) == list(read_dataset(data.folder).gateway_names)
