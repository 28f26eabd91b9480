"""Transmitters are found from their spectra, nearer than by copying known positions."""

import csv
import json
import shutil
from functools import partial

import numpy as np
import pytest
from skimage.io import imsave

import bisplat
from bisplat.commands.evaluation_commands import evaluate as evaluate_command
from bisplat.commands.locate_command import locate as locate_command
from learn.localisation import picture_evidence
from learn.localisation import place_search as search_module
from learn.localisation.heard_pictures import observed_pictures, of_test_part
from learn.localisation.located_places import HEADER
from learn.localisation.picture_evidence import Fingerprints, PictureEvidence
from learn.training import run_folder
from learn.training.conformal_deviation import Deviation
from learn.training.run_files import TrainingFile
from scenes.files.errors import InputError
from simulate.dataset.spectra_folder import write_gateway
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import picture


@pytest.fixture(scope="module")
def found(runs):
    return [of_test_part(runs[:1]).answered(), of_test_part(runs).answered()]


@pytest.mark.slow
def test_errors_are_a_fraction_of_those_of_fingerprints(found):
    metrics = found[0].metrics()
    assert metrics["located"] == 30
    assert metrics["location_error_median_cm"] < 2
    assert metrics["location_error_median_cm"] < metrics["location_error_median_cm_fingerprint"] / 3
    assert metrics["within_90_percent_region"] > 0.75


@pytest.mark.slow
def test_two_gateways_locate_better_than_one(found):
    one, two = (each.metrics()["location_error_median_cm"] for each in found)
    assert two < 0.9 * one


@pytest.mark.parametrize(
    ("second", "spectra", "expected"),
    [(0.2, 10**6, (0.8, 0.2)), (0.12, 11, (0.5, 0.5)), (0.2, 0, (0.5, 0.5)), (None, 11, (0.5, 0.5))],
    ids=["told by many spectra", "by few", "by an unknown number", "not stated"],
)
def test_a_gateway_counts_by_the_deviation_that_its_run_states(runs, monkeypatch, second, spectra, expected):
    stated = {runs[0].folder: 0.1, runs[1].folder: second}

    def training(folder):
        constant = stated[folder]
        return TrainingFile(0, 0.0, None if constant is None else Deviation(constant, 0.0, spectra))

    for module in (picture_evidence, run_folder):
        monkeypatch.setattr(module, "read_training", training)
    pictures = np.random.default_rng(0).integers(0, 255, (1, 90, 360), np.uint8)
    together = PictureEvidence(runs, [pictures, pictures], np.zeros((2, 3)), np.zeros((1, 3))).heard[0]
    np.testing.assert_allclose([(half**2).sum() for half in np.split(together, 2)], expected, rtol=1e-4)


def test_command_writes_what_the_function_finds(folder, runs, tmp_path, monkeypatch):
    monkeypatch.setattr(search_module, "STEPS", 2)
    (tmp_path / "seen").mkdir()
    for number in (1, 2, 3):
        shutil.copy(folder / "one" / "spectrum" / f"{number:05d}.png", tmp_path / "seen")
    output, both = tmp_path / "places.csv", (runs[0].folder, tmp_path / "seen")
    locate_command(both, output)
    rows = list(csv.DictReader(output.open()))
    expected = bisplat.locate([runs[0]], [bisplat.read_dataset(folder / "one").pictures[:3]])
    assert {row["part"] for row in rows} == {"new"}
    rows = [row for row in rows if row["place"] == "1"]
    assert [row["name"] for row in rows] == ["00001", "00002", "00003"]
    for row, places in zip(rows, expected, strict=True):
        np.testing.assert_allclose([float(row[axis]) for axis in "xyz"], places[0].position, atol=1e-4)
    with pytest.raises(InputError, match="--force"):
        locate_command(both, output)


def test_of_the_runs_own_dataset_the_test_part_is_located(folder, runs, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(search_module, "STEPS", 1)
    data = bisplat.read_dataset(folder / "one")
    for number, heard in enumerate(((), (folder / "one",), (folder / "one" / "spectrum",))):
        locate_command((runs[0].folder, *heard), tmp_path / f"{number}.csv")
        rows = list(csv.DictReader((tmp_path / f"{number}.csv").open()))
        assert {row["name"] for row in rows} == {data.names[each] for each in runs[0].split(data).test}
        assert {row["part"] for row in rows} == {"test"} and "fingerprint, mean of 4" in capsys.readouterr().out


def test_a_black_picture_has_no_place(folder, runs, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(search_module, "STEPS", 1)
    pictures = tmp_path / "seen"
    pictures.mkdir()
    for number, one in enumerate((bisplat.read_dataset(folder / "one").pictures[0], np.zeros((90, 360))), start=1):
        imsave(pictures / f"{number:05d}.png", one.astype(np.uint8), check_contrast=False)
    locate_command((runs[0].folder, pictures), tmp_path / "places.csv")
    assert {row["name"] for row in csv.DictReader((tmp_path / "places.csv").open())} == {"00001"}
    assert "1 of which nothing was heard" in capsys.readouterr().out


def test_black_test_spectra_are_not_located(runs, monkeypatch):
    monkeypatch.setattr(search_module, "STEPS", 1)
    data = runs[0].dataset()
    test = runs[0].split(data).test
    pictures = data.pictures.copy()
    pictures[test[2:]] = 0
    monkeypatch.setattr(type(runs[0]), "dataset", lambda self: data.with_values(spectrum=pictures))
    assert of_test_part(runs[:1]).answered().metrics()["located"] == 2
    pictures[test] = 0
    with pytest.raises(InputError, match="found none in 30"):
        of_test_part(runs[:1]).answered()


def test_bad_input_is_refused(folder, runs, tmp_path):
    run, heard = runs[0].folder, folder / "one"
    for folders, output, message in (
        ((run, heard, run), "a.csv", "expected a folder, or pairs"),
        ((run, heard, run, heard), "a.csv", "found .* twice"),
        ((run, heard), "a.txt", ".csv"),
        ((run, tmp_path), "a.csv", "expected pictures 00001.png"),
        ((run, heard, runs[1].folder, tmp_path), "a.csv", "of all runs or of none"),
    ):
        with pytest.raises(InputError, match=message):
            locate_command(folders, tmp_path / output)
    assert not list(tmp_path.iterdir())


def change_metadata(folder, **content):
    (folder / "metadata.json").write_text(json.dumps(content))


def change_gateway(folder, position, orientation=(0, 0, 0, 1)):
    write_gateway(folder / "gateway_info.yml", "elsewhere", position, orientation)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (partial(change_metadata, array={"rows": 2, "columns": 8, "spacing": 0.5}), "metadata.json: .*found .* 2 × 8"),
        (partial(change_metadata, frequency_hz=2.4e9), "found 2400 MHz"),
        (partial(change_metadata, grid={"elevation_first_deg": 1.0}), "found .*elevation_first_deg=1"),
        (partial(change_gateway, position=(9, 9, 9)), "15 m away and turned by 0°"),
        (partial(change_gateway, position=(0, 0, 1), orientation=(0, 0, 0.6, 0.8)), "0 m away and turned by 73.7"),
        (lambda folder: (folder / "gateway_info.yml").write_text("x"), "gateway_info.yml: expected"),
    ],
)
def test_pictures_of_another_receiver_are_refused(change, words, folder, runs, tmp_path):
    """Each folder is valid alone."""
    heard = shutil.copytree(folder / "one", tmp_path / "heard")
    (heard / "channels.npz").unlink()
    change(heard)
    with pytest.raises(InputError, match=words):
        locate_command((runs[0].folder, heard), tmp_path / "places.csv")
    assert not (tmp_path / "places.csv").exists()


def test_pictures_of_an_array_that_moved_with_its_transmitter_are_refused(folder, runs, tmp_path):
    heard = shutil.copytree(folder / "one", tmp_path / "heard")
    (heard / "metadata.json").write_text('{"moving": "both"}')
    shutil.copy(heard / "tx_pos.csv", heard / "rx_pos.csv")
    with pytest.raises(InputError, match="expected pictures of a gateway that stands still"):
        observed_pictures(heard, runs[0])
    with pytest.raises(InputError, match="one end that stands still"):
        bisplat.evaluate(runs[0], heard)


def test_pictures_that_the_runs_array_does_not_explain_are_warned_of(runs, tmp_path, capsys):
    other = Beamformer(PlanarArray(4, 4, 0.35))
    (tmp_path / "seen").mkdir()
    responses = np.random.default_rng(0).normal(size=(3, 16, 2)) @ [1, 1j]
    for number, image in enumerate(picture(other.spectrum(responses)), start=1):
        imsave(tmp_path / "seen" / f"{number:05d}.png", image, check_contrast=False)
    observed_pictures(tmp_path / "seen", runs[0])
    said = capsys.readouterr().err
    assert "warning: " in said and "4 × 4 elements" in said


def test_a_run_that_learned_the_test_part_of_the_first_is_refused(folder, runs, tmp_path, monkeypatch):
    other = bisplat.train(bisplat.read_dataset(folder / "two"), tmp_path / "run", split="random", model="mlp", steps=1)
    monkeypatch.setattr("learn.evaluation.evaluate.evaluate", lambda *_: pytest.fail("scored"))
    with pytest.raises(InputError, match="not trained on test spectra"):
        evaluate_command(runs[0].folder, locate=True, further_gateways=(other.folder,))
    with pytest.raises(InputError, match="not trained on test spectra"):
        locate_command((runs[0].folder, folder / "one", other.folder, folder / "two"), tmp_path / "a.csv")


def test_fingerprints_do_not_depend_on_scale_and_offset():
    pictures = np.random.default_rng(0).integers(0, 100, (3, 90, 360), np.uint8)
    fingerprints = Fingerprints(Beamformer())
    np.testing.assert_allclose(
        fingerprints.of_pictures(pictures), fingerprints.of_pictures(2 * pictures + 40), atol=1e-5
    )
    np.testing.assert_allclose(np.linalg.norm(fingerprints.of_pictures(pictures), axis=1), 1, rtol=1e-5)


def test_evaluate_adds_the_locations_to_the_scores(runs, monkeypatch, capsys):
    monkeypatch.setattr(search_module, "STEPS", 1)
    evaluate_command(runs[0].folder, json=True, ceiling=False)
    scores = json.loads(capsys.readouterr().out)
    evaluate_command(runs[0].folder, locate=True, json=True, ceiling=False)
    both = json.loads(capsys.readouterr().out)
    locations, folder = both.pop("locations"), runs[0].folder / "evaluation"
    assert set(both) == set(scores)
    assert locations == json.loads((folder / "locations.json").read_text())
    rows = list(csv.DictReader((folder / "locations.csv").open()))
    assert tuple(rows[0]) == HEADER and len({row["name"] for row in rows}) == 30
    assert (folder / "location_errors.png").stat().st_size > 1000
