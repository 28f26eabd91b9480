"""The command line's contracts: JSON keys, exit statuses, one sentence per error."""

import json
import shutil
import sys

import numpy as np
import pytest

import bisplat

METRICS = {"ssim_median", "ssim_mean", "psnr_mean", "mae_mean", "aoa_error_median_deg", "test_spectra", "baselines"}


@pytest.fixture
def command(monkeypatch, capsys):
    """Function: runs bisplat with arguments; returns exit status, stdout, stderr."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["bisplat", *map(str, arguments)])
        status = 0
        try:
            bisplat.main()
        except SystemExit as stop:
            status = stop.code or 0
        return status, *capsys.readouterr()

    return run


def test_check_of_a_good_folder(command, tiny):
    status, out, _ = command("check", tiny, "--json")
    assert status == 0
    result = json.loads(out)
    assert set(result) == {"valid", "spectra", "problems", "warnings"}
    assert (result["valid"], result["spectra"], result["problems"]) == (True, 24, [])
    status, out, _ = command("check", tiny)
    assert status == 0 and "gateway looks along" in out


def test_check_of_a_bad_folder(command, tiny, tmp_path):
    bad = shutil.copytree(tiny, tmp_path / "bad")
    (bad / "gateway_info.yml").unlink()
    status, out, _ = command("check", bad, "--json")
    result = json.loads(out)
    assert status == 1
    assert result["valid"] is False and len(result["problems"]) == 1 and "gateway_info.yml" in result["problems"][0]


@pytest.mark.usefixtures("small_models")
def test_train_evaluate_predict(command, tiny, tmp_path):
    run = tmp_path / "run"
    status, out, _ = command("train", tiny, "-o", run, "--steps", 6, "--batch-size", 5)
    assert status == 0 and str(run) in out
    status, out, _ = command("evaluate", run, "--json")
    assert status == 0
    metrics = json.loads(out)
    assert METRICS <= set(metrics)
    assert metrics["test_spectra"] == 5
    assert {"nearest", "mean_picture", "array_ceiling"} <= set(metrics["baselines"])

    places = tmp_path / "places.csv"
    places.write_text("x,y,z\n0.5,0.1,1.0\n1.5,0.9,1.0\n2.5,0.9,1.0\n")
    status, _, _ = command("predict", run, "--positions", places, "-o", tmp_path / "out.npz")
    assert status == 0
    with np.load(tmp_path / "out.npz") as arrays:
        assert arrays["spectra"].shape == (3, 90, 360) and arrays["spectra"].dtype == np.float32
        assert arrays["channels"].shape == (3, 16) and arrays["channels"].dtype == np.complex64
    assert not list(tmp_path.glob("*.tmp"))


@pytest.mark.parametrize("arguments", [["nonsense"], ["train"], ["check", "here", "--colour"], ["simulate", "lab"]])
def test_wrong_usage_is_status_2(command, arguments):
    assert command(*arguments)[0] == 2


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["train", "no-such-folder", "-o", "RUN"], "expected a dataset folder"),
        (["evaluate", "no-such-run"], "expected a run folder"),
        (["predict", "no-such-run", "--positions", "x.csv", "-o", "OUT"], "expected a run folder"),
        (["scene", "lba"], 'did you mean "lab"'),
        (["simulate", "lab", "-o", "OUT", "-n", "0"], "--spectra: expected at least 2, found 0"),
        (["train", "DATA", "-o", "RUN", "--steps", "0"], "--steps: expected a positive number, found 0"),
        (["scene", "room.glb"], "importing a mesh needs --output"),
    ],
)
def test_a_users_mistake_is_one_sentence_and_status_1(command, tiny, tmp_path, monkeypatch, arguments, sentence):
    monkeypatch.chdir(tmp_path)
    status, _, err = command(*(str(tiny) if argument == "DATA" else argument for argument in arguments))
    lines = err.strip().splitlines()
    assert status == 1
    assert len(lines) == 1 and lines[0].startswith("bisplat: ") and sentence in lines[0]
    assert list(tmp_path.iterdir()) == []
