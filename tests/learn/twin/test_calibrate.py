"""What corrects a scene is refused where it was not measured there, and what was corrected is written down."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest

import bisplat
from bisplat.__main__ import main
from learn.data.splits import split
from learn.twin import calibrate as calibrate_module
from learn.twin.calibrate import RECORD, calibrate, calibrate_by, rows_of, write_calibration
from learn.twin.gauss_newton import Calibration
from scenes.files.errors import InputError, ParameterError
from scenes.scene.description import SceneObject
from scenes.scene.shapes import box
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import Unknown, unknowns, vary
from scenes.storage.scene_writing import write_scene
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset_folder import read_dataset
from simulate.rays.core.propagation import Propagation
from simulate.spectra.array import PlanarArray
from simulate.spectra.band import Band
from tests.small_scene import CABINET, small_scene

OF_POSITION = [Unknown("position", "", axis, 0.02) for axis in range(3)]
EXACT = Tolerances(position=0, rotation=0, objects=0, materials=0)


@pytest.mark.parametrize(
    ("of_scene", "array", "tolerances", "expected"),
    [
        (
            {"frequency": 2.4e9},
            PlanarArray(),
            Tolerances(),
            "scene of the dataset's wavelength of 0.3276 m, found 0.1249",
        ),
        ({}, PlanarArray(spacing=0.4), Tolerances(), "4 × 4 elements 0.5 λ apart, found those of 4 × 4 elements 0.4"),
        ({}, PlanarArray(2, 4), Tolerances(), "the scene's array, 4 × 4 elements 0.5 λ apart, found those of 2 × 4"),
        (
            {},
            PlanarArray(),
            Tolerances(),
            r"gateway_info\.yml: expected the gateway of small, at .*, found one 0\.5 m away",
        ),
        ({}, PlanarArray(), EXACT, "expected a tolerance above 0, found nothing that may be wrong"),
    ],
)
def test_what_was_not_measured_there_is_refused(tiny, of_scene, array, tolerances, expected):
    data = read_dataset(tiny)
    identification = replace(data.identification, beamformer=replace(data.beamformer, array=array))
    data = replace(data, identification=identification)
    with pytest.raises(InputError, match=expected):
        calibrate_by(replace(small_scene(CABINET), **of_scene), data, np.arange(3), tolerances)


def test_spectra_are_taken_evenly_from_those_that_are_not_held_out(tiny, monkeypatch):
    used = []

    def calibrate_by(place, data, known, *options):
        used.extend(known)
        return Calibration(place, [], np.zeros(0), np.zeros(0), 1, (0.1, 0.5))

    monkeypatch.setattr(calibrate_module, "calibrate_by", calibrate_by)
    known = split(read_dataset(tiny), "random", 3).known
    calibrate(small_scene(CABINET), tiny, 4, split="random", seed=3)
    assert len(used) == 4 and set(used) < set(known)
    assert {used[0], used[-1]} == {known[0], known[-1]}
    with pytest.raises(ParameterError, match="n: expected"):
        calibrate(small_scene(CABINET), tiny, 0)


def of_small_scene(folder):
    """A dataset as of the small scene's gateway."""
    gateway = small_scene().gateway
    at, orientation = np.array(gateway.position), np.array(gateway.orientation)
    return replace(read_dataset(folder), gateway_position=at, gateway_orientation=orientation)


def test_a_band_is_used_at_four_subcarriers(tiny, monkeypatch):
    data, used = of_small_scene(tiny), {}
    band = Band(20e6, 16)
    carrier = np.arange(1, 16 * len(data) + 1).reshape(-1, 16) * 1j
    responses = carrier[..., None] * np.exp(1j * np.arange(16))
    data = replace(data, responses=carrier, band=band, band_responses=responses)

    def most_likely(scene, which, propagation, positions, measured, phases_known, report, ratios):
        used.update(measured=measured, ratios=ratios, phases_known=phases_known)

    monkeypatch.setattr(calibrate_module, "most_likely", most_likely)
    calibrate_by(small_scene(CABINET), data, np.arange(3))
    chosen = [0, 5, 10, 15]
    np.testing.assert_allclose(used["ratios"], band.frequencies(915e6)[chosen] / 915e6)
    np.testing.assert_allclose(used["measured"].reshape(3, 4, -1)[:, 2], responses[:3, :, chosen[2]])
    assert used["phases_known"]


def test_of_a_band_with_a_phase_for_each_position_the_carrier_is_used(tiny, monkeypatch):
    data, used = of_small_scene(tiny), []
    recorded = np.arange(1, 16 * len(data) + 1).reshape(-1, 16) * 1j
    data = replace(
        data, band=Band(20e6, 16), band_responses=recorded[..., None].repeat(16, 2), retrieved=recorded, responses=None
    )
    monkeypatch.setattr(calibrate_module, "most_likely", lambda *arguments: used.extend(arguments))
    calibrate_by(small_scene(CABINET), data, np.arange(3))
    assert used[4].shape == recorded[:3].shape and used[5] is False


def test_spectra_of_another_place_are_warned_of(tiny, monkeypatch, capsys):
    """The positions of ``tiny`` reach to x = 4 m, those of this scene end at 3 m, and nothing explains the power."""
    outdoors = replace(small_scene(CABINET), objects=(SceneObject("block", box((0, 0, 0), (1, 1, 1)), "concrete"),))
    found = Calibration(outdoors, [], np.zeros(0), np.zeros(0), 1, (0.93, 0.99))
    monkeypatch.setattr(calibrate_module, "calibrate_by", lambda *arguments: found)
    assert calibrate(outdoors, tiny) is found
    said = " ".join(capsys.readouterr().err.split())
    assert "positions are far outside the box around the scene" in said and "measured there, in its frame?" in said
    assert "warning: 93% of the measured power is unexplained by the corrected scene (99% before)" in said


def test_random_phases_are_refused(tiny):
    with pytest.raises(ParameterError, match="diffuse: expected no diffuse reflection"):
        calibrate_by(small_scene(CABINET), read_dataset(tiny), np.arange(3), propagation=Propagation(diffuse=True))


def test_changes_are_written_down(tmp_path):
    namesake = SceneObject("gateway", box((1.0, 1.5, 0.5), (3.0, 2.0, 2.0)), "metal")  # so is an unknown's kind
    scene = small_scene(namesake)
    which = unknowns(scene, Tolerances(position=0.01, rotation=1.0, objects=0.02, materials=0.1))
    values, deviations = np.linspace(-0.01, 0.01, len(which)), np.full(len(which), 0.005)
    found = Calibration(scene, which, values, deviations, 2j, (0.1, 0.5))
    write_calibration(found, tmp_path)
    assert load_scene(tmp_path / "scene.yaml").gateway == scene.gateway
    record = json.loads((tmp_path / RECORD).read_text())
    assert [each["change"] for each in record["changes"]] == values.tolist()
    assert record["unexplained_power"] == {"described": 0.5, "corrected": 0.1} and record["gain"] == [0, 2]
    rows = {row["what"]: row for row in rows_of(found.which, found.values, found.deviations)[:6]}
    assert rows["gateway x"]["changed by"] == "-10.0 mm" and rows["gateway x"]["± before"] == "10.0 mm"
    assert rows["gateway rotation about z"]["±"] == "0.29°"


@pytest.mark.slow
def test_command_writes_the_corrected_scene(tmp_path, monkeypatch, capsys):
    """Its gateway is where the spectra were received, and not where it is described."""
    coarse = ("--max-depth", "1", "--no-diffraction", "--rays", "20000")
    followed = Propagation(max_depth=1, rays=20_000, diffraction=False)
    data = bisplat.simulate(small_scene(CABINET), tmp_path / "data", n=12, propagation=followed)
    wrong = vary(small_scene(CABINET), OF_POSITION, np.array([0.03, -0.02, 0.02]))
    described = write_scene(wrong, tmp_path / "described")
    only_pose = ("--objects", "0", "--materials", "0", "--rotation", "1")
    arguments = ["calibrate", described, data.folder, "-o", tmp_path / "corrected", "-n", "9", *only_pose, *coarse]
    monkeypatch.setattr(sys, "argv", ["bisplat", *map(str, arguments)])
    main()
    found = load_scene(tmp_path / "corrected" / "scene.yaml")
    np.testing.assert_allclose(found.gateway.position, small_scene().gateway.position, atol=0.002)
    out = capsys.readouterr().out
    assert "gateway x" in out and "unexplained share of the measured power: " in out
    with pytest.raises(SystemExit):
        main()
    assert "expected a new folder, found other files; --force" in capsys.readouterr().err
