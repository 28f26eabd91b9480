"""Numbers on the command line: absurd ones are refused in one sentence that names the option, before any work."""

from __future__ import annotations

import sys

import pytest

from bisplat.__main__ import main

SIMULATE = "simulate lab -o out"
TRAIN = "train nowhere -o out --model mlp"
OWN = TRAIN.split()[:-1]
COMPARE, SWEEP = "compare nowhere -o out", "sweep nowhere -o out --sizes 5"
ABLATE, CROSSVALIDATE = "ablate nowhere -o out", "crossvalidate nowhere --scene lab"
CALIBRATE = "calibrate closet nowhere -o out"
PLAN = "plan nowhere -o out"
CONVERT = "convert nowhere -o out"

WHOLE = ("0", "-1", str(10**15), "9" * 4000)
SEEDS = ("-1", str(2**32), str(2**63), "9" * 4000)
NUMBERS = ("nan", "inf", "-inf", "-1", "1e300")

REFUSED: dict[tuple[str, str], tuple[str, ...]] = {
    ("demo -o out", "-n"): WHOLE,
    ("demo -o out", "--steps"): WHOLE,
    (SIMULATE, "-n"): WHOLE,
    (SIMULATE, "--seed"): SEEDS,
    (SIMULATE, "--workers"): WHOLE,
    (SIMULATE, "--max-depth"): ("-1", str(10**9)),
    (SIMULATE, "--rays"): WHOLE,
    (SIMULATE, "--patches"): WHOLE,
    (SIMULATE, "--snr-db"): ("nan", "inf", "1e300", "-1e300"),
    (SIMULATE, "--gain-error-db"): NUMBERS,
    (SIMULATE, "--phase-error-deg"): NUMBERS,
    (SIMULATE, "--phase-noise-deg"): NUMBERS,
    (f"{SIMULATE} --engine fullwave", "--cell"): (*NUMBERS, "0", "1e-300"),
    (TRAIN, "--seed"): SEEDS,
    (TRAIN, "--steps"): WHOLE,
    (TRAIN, "--batch-size"): WHOLE,
    (TRAIN, "--learning-rate"): (*NUMBERS, "0"),
    (TRAIN, "--weight-decay"): NUMBERS,
    (TRAIN, "--full-resolution"): (*NUMBERS, "1.01"),
    (COMPARE, "--budget"): (*NUMBERS, "0"),
    (COMPARE, "--seeds"): WHOLE,
    (SWEEP, "--budget"): (*NUMBERS, "0"),
    (SWEEP, "--seeds"): WHOLE,
    (SWEEP, "--sizes"): WHOLE,
    (ABLATE, "--steps"): WHOLE,
    (ABLATE, "--seeds"): WHOLE,
    (ABLATE, "--primitives"): WHOLE,
    (CROSSVALIDATE, "-n"): WHOLE,
    (CROSSVALIDATE, "--seed"): SEEDS,
    (CALIBRATE, "--position"): NUMBERS,
    (CALIBRATE, "--rotation"): NUMBERS,
    (CALIBRATE, "--materials"): NUMBERS,
    (PLAN, "-n"): WHOLE,
    (PLAN, "--seed"): SEEDS,
    (PLAN, "--max-depth"): ("-1", str(10**9)),
}
"""A command, an option of it, and values that the option cannot have."""

NAMES = {"-n": ("-n: ", "--spectra: ", "--positions: ")}


@pytest.fixture
def refuse(tmp_path, monkeypatch, capsys):
    """Function: arguments -> the one sentence on stderr; nothing was written."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> str:
        monkeypatch.setattr(sys, "argv", ["bisplat", *arguments])
        with pytest.raises(SystemExit) as end:
            main()
        out, err = capsys.readouterr()
        assert end.value.code == 1 and out == "" and not list(tmp_path.iterdir())
        assert err.startswith("bisplat: ") and err.count("\n") == 1 and err.strip().isprintable()
        return err.removeprefix("bisplat: ")

    return run


@pytest.mark.parametrize(("command", "option"), REFUSED)
def test_absurd_numbers(command, option, refuse):
    for value in REFUSED[command, option]:
        sentence = refuse(
            *command.split(),
            f"{option}={value}" if option.startswith("--") else option,
            *(() if option.startswith("--") else (value,)),
        )
        assert sentence.startswith(NAMES.get(option, f"{option}: ")), sentence
        assert "expected" in sentence and "found" in sentence and len(sentence) < 300, sentence


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ((*CONVERT.split(), "--elevations", "0", "nan", "--azimuths", "0", "359"), "--elevations: "),
        ((*CONVERT.split(), "--azimuths", "10", "10"), "--azimuths: "),
        ((*SWEEP.split(), "6", "5"), "--sizes: expected different"),
        ((*TRAIN.split(), "--bypass", "x" * 10_000), "--bypass: "),
        ((*COMPARE.split(), "--models", "x" * 10_000), "--models: "),
        ((*OWN, "nerf"), "found 'nerf'; did you mean \"nerf2\"?"),
        (
            (*OWN, "no_module:Model"),
            "--model: expected a class at no_module:Model",
        ),
        (
            (*OWN, "json:JSONDecoder"),
            "expected a subclass of bisplat.SpectrumModel",
        ),
        ((*ABLATE.split(), "--models"), "--models: expected at least one"),
        ((*COMPARE.split(), "--models", "\x1b[2J:x" * 1000), "--models: "),
        ((*SIMULATE.split(), "--cell", "1"), "--cell: expected the engine fullwave, found rays"),
        ((*TRAIN.split(), "--scene", "closet"), "--scene: expected an option of the model mlp"),
        ((*SIMULATE.split(), "--ray", f"127.0.0.1:{'9' * 1000}"), "--ray: "),
        (("simulate", "x" * 200, "-o", "out"), "unknown scene"),
        (("scene", "x.obj", "--material", "y" * 10_000), "--material: expected NAME=MATERIAL"),
        (("locate", "x" * 5000, "--pictures", "y" * 5000, "-o", "out.csv"), "xxx…xxx"),
        (("evaluate", "no\nwhere\x1b[2J"), r"no\nwhere\x1b[2J"),
    ],
)
def test_other_texts(arguments, word, refuse):
    sentence = refuse(*arguments)
    assert word in sentence and len(sentence) < 600


@pytest.mark.parametrize("option", ["--seed", "--learning-rate", "--weight-decay"])
@pytest.mark.parametrize("text", ["1_0", "１", "1:30", "0x1", "٣"])
def test_numbers_are_written_with_the_digits_0_to_9(option, text, monkeypatch, capsys):
    """Python's float and int read the first two and the last."""
    monkeypatch.setattr(sys, "argv", ["bisplat", *TRAIN.split(), option, text])
    with pytest.raises(SystemExit) as ended:
        main()
    said = " ".join(capsys.readouterr().err.split())
    assert ended.value.code == 2 and option in said and text in said


def test_the_parsers_errors_escape_control_characters(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["bisplat", *TRAIN.split(), "--split=\x1b[2J"])
    with pytest.raises(SystemExit) as ended:
        main()
    said = capsys.readouterr().err
    assert ended.value.code == 2 and "\x1b" not in said and r"\x1b[2J" in said
