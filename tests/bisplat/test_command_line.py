"""The command line's contract: what comes on stdout, what on stderr, the exit status, and the files left behind."""

import json
import os
import re
import signal
import sys
from dataclasses import replace

import numpy as np
import pytest

from bisplat.__main__ import main
from learn.fitted.runs import load_run
from learn.training import validation_part as epochs
from learn.training.gradient_steps import Training
from scenes.storage.scene_writing import write_scene
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset_folder import read_dataset
from simulate.positions.positions import write_positions

pytestmark = pytest.mark.usefixtures("small_models")


def assert_one_sentence(err, *parts):
    assert err.startswith("bisplat: ") and err.endswith("\n") and err.count("\n") == 1, err
    for part in parts:
        assert str(part) in err


# check


def test_check_of_a_good_folder(command, tiny):
    status, out, err = command("check", tiny, "--json")
    assert status == 0 and err == ""
    found = json.loads(out)
    assert found["array"] == {"rows": 4, "columns": 4, "spacing": 0.5, "source": "fitted"}
    assert found["frequency"] == {"hertz": 915e6, "source": "metadata"} and found["fit_residual_grey_levels"] < 0.5
    assert found["valid"] is True and found["spectra"] == 24 and found["problems"] == []

    status, out, _ = command("check", tiny)
    assert status == 0 and "24" in out and "problem" not in out


def test_check_of_a_bad_folder_names_every_problem_and_exits_1(command, write_folder, tmp_path):
    folder = write_folder(tmp_path / "bad", count=8)
    (folder / "spectrum" / "00003.png").write_bytes(b"not a picture")
    (folder / "tx_pos.csv").unlink()
    status, out, _ = command("check", folder, "--json")
    found = json.loads(out)
    assert status == 1 and found["valid"] is False and found["spectra"] == 0
    assert len(found["problems"]) == 2
    status, out, _ = command("check", folder)
    assert status == 1 and out.count("problem: ") == 2 and "00003.png" in out and "tx_pos.csv" in out

    status, out, _ = command("check", tmp_path / "nowhere", "--json")
    assert status == 1 and "nowhere" in json.loads(out)["problems"][0]


# train, evaluate, predict


@pytest.mark.usefixtures("quick_fits")
@pytest.mark.usefixtures("no_ceiling")
def test_train_evaluate_predict(command, tiny, tmp_path):
    run = tmp_path / "run"
    training = ("train", tiny, "-o", run, "--model", "bisplat-aperture", "--steps", "6", "--batch-size", "5")
    status, out, err = command(*training)
    assert status == 0 and str(run) in out and "training" in err and "training" not in out
    before = (run / "weights.safetensors").stat().st_mtime_ns
    assert command(*training)[0] == 0
    assert (run / "weights.safetensors").stat().st_mtime_ns == before

    status, out, _ = command("evaluate", run, "--json")
    found = json.loads(out)
    assert status == 0 and found == json.loads((run / "evaluation" / "metrics.json").read_text())
    assert found["test_spectra"] == 5 and found["baselines"].keys() >= {"mean_picture", "nearest"}

    points = read_dataset(tiny).positions[:3] + 0.01
    write_positions(tmp_path / "points.csv", points)
    status, out, _ = command("predict", run, "--positions", tmp_path / "points.csv", "-o", tmp_path / "out.npz")
    assert status == 0 and "3 spectra" in out
    with np.load(tmp_path / "out.npz") as archive:
        assert set(archive) == {"spectra", "channels"}
        spectra, responses = archive["spectra"], archive["channels"]
    assert (spectra.shape, spectra.dtype) == ((3, 90, 360), np.float32)
    assert (responses.shape, responses.dtype) == ((3, 16), np.complex64)
    np.testing.assert_array_equal(spectra, load_run(run).predict(points).spectra)


def test_model_without_an_aperture_predicts_spectra_alone(command, tiny, tmp_path, monkeypatch):
    monkeypatch.setattr(epochs, "STEPS_PER_VALIDATION", 1)
    run = tmp_path / "run"
    assert command("train", tiny, "-o", run, "--model", "bisplat", "--steps", 1, "--batch-size", 17)[0] == 0
    assert command("predict", run, "--positions", tiny / "tx_pos.csv", "-o", tmp_path / "out.npz")[0] == 0
    with np.load(tmp_path / "out.npz") as archive:
        assert set(archive) == {"spectra"} and archive["spectra"].shape == (24, 90, 360)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_training_says_so_and_exits_130(command, tiny, tmp_path, monkeypatch, number):
    whole = Training.training_step

    def training_step(self, *arguments):
        if self.trainer.global_step == 1:
            signal.raise_signal(number)
        return whole(self, *arguments)

    monkeypatch.setattr(Training, "training_step", training_step)
    status, out, err = command(
        "train", tiny, "-o", tmp_path / "run", "--model", "bisplat-aperture", "--steps", 6, "--batch-size", 5
    )
    assert status == 130 and "run: " not in out
    assert err.splitlines()[-1].startswith("bisplat: interrupted")


# Files


@pytest.mark.parametrize("failing", ["fsync", "replace"])
def test_predict_that_cannot_write_leaves_the_old_file_as_it_was(
    command, finished_run, tiny, tmp_path, monkeypatch, failing
):
    def full(*_):
        raise OSError(28, "No space left on device")

    output = tmp_path / "out.npz"
    output.write_bytes(b"old")
    with monkeypatch.context() as patch:
        patch.setattr(os, failing, full)
        status, out, err = command("predict", finished_run, "--positions", tiny / "tx_pos.csv", "-o", output, "--force")
    assert status == 1 and out == ""
    assert_one_sentence(err, output, "No space left on device")
    assert [path.name for path in tmp_path.iterdir()] == ["out.npz"] and output.read_bytes() == b"old"


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("out.npz", ("predict", "RUN", "--positions", "nowhere.csv", "-o", "FILE")),
        ("out.onnx", ("export", "RUN", "-o", "FILE")),
        ("out.h5", ("export", "RUN", "--hdf5", "FILE")),
        ("lab.png", ("scene", "lab")),
        ("drawing.png", ("scene", "lab", "-o", "FILE")),
    ],
)
def test_file_that_is_there_is_refused_before_any_work(command, finished_run, tmp_path, monkeypatch, name, arguments):
    monkeypatch.chdir(tmp_path)
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)
    file.write_text("precious")
    places = {"RUN": finished_run, "FILE": file, "FOLDER": file.parent}
    status, out, err = command(*(places.get(argument, argument) for argument in arguments))
    assert status == 1 and out == ""
    assert_one_sentence(err, file.name, "expected no such file yet, found one; --force replaces it")
    assert file.read_text() == "precious" and [path for path in tmp_path.rglob("*") if path.is_file()] == [file]


@pytest.mark.parametrize(
    "arguments",
    [
        ("predict", "RUN", "--positions", "nowhere.csv", "-o", "file/out.npz"),
        ("export", "nowhere", "-o", "file/out.onnx"),
        ("export", "nowhere", "--hdf5", "file/out.h5"),
        ("export", "nowhere", "--deepmimo", "file/out"),
        ("scene", "lab", "-o", "file/out.png"),
        ("locate", "nowhere", "nowhere", "-o", "file/out.csv"),
        ("plan", "nowhere", "-o", "file/out.csv"),
        ("calibrate", "nowhere", "nowhere", "-o", "file/out"),
        ("dataset", ".", "-o", "file/out"),
        ("simulate", "nowhere", "--gateways", "nowhere.yml", "-o", "file/out"),
        ("dataset", "nowhere.npy", "--frequency", "1e9", "--array", "4x4@0.5", "-o", "file/out"),
        ("evaluate", "file"),
        ("crossvalidate", "file", "--scene", "nowhere"),
    ],
    ids=" ".join,
)
def test_what_can_never_be_written_is_found_out_before_any_work(
    command, finished_run, tmp_path, monkeypatch, arguments
):
    """Each command has another fault, too, which it would find later."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("precious")
    status, out, err = command(*(finished_run if argument == "RUN" else argument for argument in arguments))
    assert status == 1 and out == ""
    assert re.fullmatch(r"bisplat: file(/out)?: expected a folder.*, found a file.*\n", err), err
    assert (tmp_path / "file").read_text() == "precious" and [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize(("taken", "option"), [("report.html", ()), ("locations.csv", ("--locate",))])
def test_evaluate_finds_out_before_any_work_that_it_cannot_write(command, tmp_path, taken, option):
    (tmp_path / "evaluation" / taken).mkdir(parents=True)
    status, _, err = command("evaluate", tmp_path, *option)
    assert status == 1
    assert_one_sentence(err, f"{tmp_path / 'evaluation' / taken}: expected the name of a file to write, found a folder")


@pytest.mark.parametrize("name", ["/dev/null", "pipe.npz"])
def test_a_device_or_a_pipe_is_not_replaced(command, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe.npz")
    status, _, err = command("scene", "closet", "--force", "-o", name)
    assert status == 1
    assert_one_sentence(err, f"{name}: expected the name of a file to write, found a ")


def test_demo_takes_no_folder_of_other_files_and_no_other_demo(command, tmp_path):
    (tmp_path / "report.html").write_text("precious")
    status, _, err = command("demo", "-o", tmp_path)
    assert status == 1
    assert_one_sentence(err, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    (tmp_path / "demo.json").write_text('{"spectra": 11, "steps": null}')
    status, _, err = command("demo", "-o", tmp_path, "-n", 12)
    assert status == 1
    assert_one_sentence(err, "with spectra 12, found one with spectra 11")


def test_force_replaces_a_file_but_no_folder(command, finished_run, tiny, tmp_path, monkeypatch):
    (tmp_path / "out.npz").write_text("old")
    given = ("predict", finished_run, "--positions", tiny / "tx_pos.csv", "--force", "-o")
    assert command(*given, tmp_path / "out.npz")[0] == 0
    assert np.load(tmp_path / "out.npz")["spectra"].shape == (24, 90, 360)
    (tmp_path / "folder.npz").mkdir()
    status, _, err = command(*given, tmp_path / "folder.npz")
    assert status == 1
    assert_one_sentence(err, tmp_path / "folder.npz", "found a folder")


def test_predict_counts_the_positions_far_outside_the_training_box(command, finished_run, tiny, tmp_path):
    low, high = load_run(finished_run).model.region.cpu().numpy()
    far = np.linalg.norm(high - low) * np.array([0, 0.09, 0.11, 1])
    points = tmp_path / "points.csv"
    write_positions(points, [high + np.array([0, each, 0]) for each in far])
    status, _, err = command("predict", finished_run, "--positions", points, "-o", tmp_path / "o.npz")
    assert status == 0
    assert_one_sentence(err, f"{points}: 2 of 4 positions are far outside", "the farthest, number 4")
    status, _, err = command("predict", finished_run, "--positions", tiny / "tx_pos.csv", "-o", tmp_path / "p.npz")
    assert status == 0 and err == ""


# Errors


def test_the_traceback_behind_a_sentence_is_shown_when_asked_for(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(sys, "argv", ["bisplat", "evaluate", str(tmp_path / "nowhere")])
    for asked, wanted in (("0", False), ("1", True)):
        monkeypatch.setenv("BISPLAT_TRACEBACK", asked)
        with pytest.raises(SystemExit) as leaving:
            main()
        err = capsys.readouterr().err
        assert leaving.value.code == 1
        assert ("Traceback" in err and "read_config" in err) == wanted
        assert err.splitlines()[-1].startswith(f"bisplat: {tmp_path / 'nowhere'}: expected a run folder")
        assert "BISPLAT_TRACEBACK" not in err  # it would tell no more than the sentence


def test_the_traceback_is_offered_for_an_error_of_a_class_of_the_users(command, tiny, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text("class Mine:\n    def fit(self, task):\n        task.no\n    predict = fit\n")
    status, _, err = command("compare", str(tiny), "-o", "out", "--models", "mine:Mine")
    assert status == 1 and err.splitlines()[-1].endswith("(BISPLAT_TRACEBACK=1 shows the traceback)")
    assert "no attribute 'no'" in err and "mine.py, line 3" in err
    status, _, err = command("compare", str(tiny), "-o", "out", "--models", "mean-pictures")
    assert status == 1 and "BISPLAT_TRACEBACK" not in err


def test_a_command_says_a_warning_once(command, tmp_path):
    scene = load_scene("closet")
    old = replace(scene.materials["brick"], conductivity=0.04, frequency=2.4e9)
    write_scene(replace(scene, materials={**scene.materials, "brick": old}), tmp_path / "room")
    for number in range(2):
        words = ("-n", "2", "--max-depth", "0", "-o", tmp_path / f"out{number}")
        status, _, err = command("simulate", tmp_path / "room" / "scene.yaml", *words)
        assert status == 0 and err.count("its values are for 2400 MHz") == 1, err


def test_a_baseline_is_added_to_an_experiment_with_its_training_time(command, tiny, tmp_path):
    words = ["compare", tiny, "-o", tmp_path / "out", "--budget", "0.001", "--models"]
    assert command(*words, "mlp")[0] == 0
    assert command(*words, "nearest")[0] == 0
    lines = (tmp_path / "out" / "results.jsonl").read_text().splitlines()
    assert {"mlp", "nearest", "array's ceiling"} < {json.loads(line)["label"] for line in lines}
