"""Options by their declarations: each is described, takes numbers only, and is refused where it can do nothing."""

from __future__ import annotations

import argparse
import re
import warnings

import pytest
import tyro

from bisplat.commands.command_groups import COMMANDS
from bisplat.commands.common_options import REGISTRY

HUGE = "9" * 4000

ABSURD: dict[str, dict[str, tuple[str, ...]]] = {
    "demo -o out": {"-n": ("0", HUGE), "--steps": ("-1",)},
    "simulate lab -o out": {
        "-n": ("0", str(10**15)),
        "--seed": ("-1", str(2**32), HUGE),
        "--workers": ("0",),
        "--max-depth": ("-1", str(10**9)),
        "--rays": ("0", HUGE),
        "--patches": ("0",),
        "--snr-db": ("nan", "-1e300"),
        "--gain-error-db": ("inf", "-1"),
    },
    "simulate lab -o out --engine fullwave": {"--cell": ("nan", "-1", "0", "1e-300")},
    "train nowhere -o out --model mlp": {
        "--seed": ("-1", str(2**63)),
        "--steps": ("0", HUGE),
        "--batch-size": ("0",),
        "--learning-rate": ("nan", "0", "1e300"),
        "--full-resolution": ("1.01",),
    },
    "compare nowhere -o out": {"--budget": ("nan", "0", "1e300"), "--seeds": ("0", HUGE)},
    "compare nowhere -o out --sizes 5": {"--budget": ("-1",), "--sizes": ("0", HUGE)},
    "compare nowhere -o out --without each": {"--steps": ("0",), "--seeds": ("-1",), "--primitives": ("0",)},
    "crossvalidate nowhere --scene lab": {"-n": ("0",), "--seed": ("-1",)},
    "calibrate closet nowhere -o out": {"--position": ("nan", "-1"), "--materials": ("inf",)},
    "plan nowhere -o out": {"-n": ("0", HUGE), "--seed": ("-1",), "--max-depth": ("-1",)},
}
"""Of each call: values that its options cannot have, which it says before it looks for anything else."""

IDLE: dict[str, tuple[str, ...]] = {
    "scene closet": ("--unit mm", "--up y", "--list", "--gateway 1 1 1", "--own-material wet=15,2,0.1"),
    "scene wall.obj --list": ("--output out", "--walls as-drawn", "--array 4x4"),
    "simulate closet -o out": ("--field data", "--gpu", "--diffuse", "--patches 9"),
    "simulate data -o out": ("-n 5", "--seed 3", "--snr-db 10", "--cell 0.05", "--engine fullwave", "--array 2x2"),
    "simulate closet -o out --engine fullwave": ("--max-depth 2", "--no-los"),
    "simulate closet -o out --engine fullwave --field data": ("--cell 0.05", "--gpu", "--workers 2"),
    "simulate closet -o out --positions places.csv": ("-n 2", "--placement grid"),
    "simulate closet -o out --max-depth 0": ("--rays 9", "--patches 9"),
    "simulate closet -o out --gateways nowhere.yml --positions places.csv": ("-n 2", "--placement grid"),
    "dataset places.csv --frequency 1e9 --array 4x4@0.5 -o out --moving both": ("--gateway 1 1 1",),
    "dataset places.csv --frequency 1e9 --array 4x4@0.5 -o out": ("--one-per-position 1",),
    "dataset data --retrieve": ("--array 4x4@0.5", "--output out"),
    "check data": ("--guard 1", "--seed 1"),
    "train data -o out --preset paper": ("--model mlp",),
    "train data -o out": ("--trainer devices=2", "--no-find-phases", "--steps 9", "--budget 1"),
    "train data -o out --model mlp": ("--no-find-phases", "--bypass bst", "--scene closet"),
    "train data -o out --model mlp --budget 1": ("--steps 9",),
    "train data -o out --model nerf2": ("--full-resolution 1",),
    "evaluate mlp": ("--further-gateways mlp",),
    "compare data -o out": ("--test-rooms 3", "--scene closet", "--primitives 9"),
    "compare data -o out --models nearest": ("--steps 5", "--budget 1"),
    "compare data -o out --models mlp --steps 5": ("--budget 1",),
    "compare heard": ("--steps 5", "--test-rooms 1", "--budget 1", "--without each"),
    "compare links": ("--scene closet",),
    "compare places": ("--split random", "--guard 1", "--scene closet"),
    "compare places --models mean": ("--budget 1",),
    "compare heard -o out --sizes 3": ("--init mlp", "--steps 5"),
    "locate heard -o out.csv": ("--level 1", "--region 0 0 0 1 1 1"),
    "locate heard nowhere -o out.csv": ("--split random",),
    "locate links nowhere -o out.csv": ("--level 1",),
    "locate data -o out.csv": ("--level 3", "--split random"),
    "locate mlp data -o out.csv": ("--region 0 0 0 1 1 1", "--boresight 1 0 0"),
    "plan heard -o out.csv": ("--max-depth 1",),
    "plan mlp -o out.csv": ("--no-los",),
    "calibrate closet heard -o out": ("--rotation 1", "--carrier 0.1", "--array 2x2"),
    "calibrate closet data -o out": ("--seed 1",),
}
"""Of each call: options that do nothing in it."""


def _parser(command: str) -> argparse.ArgumentParser:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return tyro.extras.get_parser(COMMANDS[command], registry=REGISTRY)


def _named(action: argparse.Action) -> str:
    return " ".join([*action.option_strings, str(action.metavar)])


@pytest.fixture
def refused(command, tmp_path, monkeypatch):
    """Function: words, exit status -> stderr. Nothing was written, and there is no traceback."""
    monkeypatch.chdir(tmp_path)
    markers = ("heard/gateway_rssi.csv", "links/csidata.npy", "places/rooms.json", "data/spectrum/x", "room/scene.yaml")
    for marker in (*markers, "wall.obj"):
        (tmp_path / marker).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / marker).write_text("")
    (tmp_path / "mlp").mkdir()
    (tmp_path / "places.csv").write_text("x,y,z\n1,1,1\n1,1,1.2\n")
    before = set(tmp_path.rglob("*"))

    def run(words: list[str], status: int = 1) -> str:
        ended, out, err = command(*words)
        assert ended == status and out == "" and set(tmp_path.rglob("*")) == before, err
        if status == 1:
            assert err.startswith("bisplat: ") and err.count("\n") == 1 and err.strip().isprintable() and len(err) < 600
        return err

    return run


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_is_described(name):
    for action in _parser(name)._actions:
        text = re.sub(r"\((default|required|optional).*?\)", "", str(action.help or "")).strip()
        assert len(text) > 3, _named(action)


@pytest.mark.parametrize("name", COMMANDS)
def test_numbers_are_written_with_the_digits_0_to_9(name, refused):
    """Python's int and float also read 1_0 and digits of other scripts."""
    actions = _parser(name)._actions
    needed = [words for action in actions if action.required for words in _words(action, "nowhere")]
    for action in actions:
        kinds = str(action.metavar)
        if action.option_strings and not action.required and re.search("INT|FLOAT", kinds) and "STR" not in kinds:
            said = " ".join(refused([name, *needed, *_words(action, "1_0")], status=2).split())
            assert "1_0" in said and action.option_strings[0] in said


def _words(action: argparse.Action, text: str) -> list[str]:
    """An option with as many values as it takes; numbers among them are 1, unless the text is one."""
    metavars = str(action.metavar).split()
    count = action.nargs if isinstance(action.nargs, int) else 1
    values = ["1" if text == "nowhere" and re.search("INT|FLOAT", each) else text for each in metavars][:count]
    return [*action.option_strings[:1], *(values or [text])]


@pytest.mark.parametrize(
    "call", ["fly", "train", "train data", "train data -o run --steps many", "evaluate run --fast", "predict run"]
)
def test_wrong_usage_exits_2(call, refused):
    assert refused(call.split(), status=2)


@pytest.mark.parametrize("call", ABSURD)
def test_absurd_numbers(call, refused):
    for option, values in ABSURD[call].items():
        for value in values:
            words = [f"{option}={value}"] if option.startswith("--") else [option, value]
            sentence = refused([*call.split(), *words])
            assert option == "-n" or sentence.startswith(f"bisplat: {option}: "), sentence
            assert "expected" in sentence and "found" in sentence, sentence


@pytest.mark.parametrize("call", IDLE)
def test_option_that_does_nothing_is_refused(call, refused):
    for option in IDLE[call]:
        name = option.split()[0].replace("--no-", "--")
        assert refused([*call.split(), *option.split()]).startswith(f"bisplat: {name}: expected ")


@pytest.mark.parametrize(
    ("call", "word"),
    [
        ("scene wall.obj --material a=wood --material b=wood", "--material: expected once, with all its values"),
        ("train data -o out --model mlp --option pixel=9", "--option: pixel: expected an option of the model mlp"),
        ("train data -o out --model mlp --option pixels", "--option: expected NAME=VALUE"),
        ("train data -o out --model nerf", "found 'nerf'; did you mean \"nerf2\"?"),
        ("train data -o out --model no_module:Model", "--model: expected a class at no_module:Model"),
        ("export mlp", "expected one of --output, --hdf5"),
        ("export mlp -o x.onnx --hdf5 x.h5", "found --output and --hdf5"),
        ("simulate room -o out", "found the folder of a scene; give room/scene.yaml"),
        ("simulate closet -o out --snr nan", "--snr-db: expected"),
        ("train nowhere -o run", "nowhere: expected a dataset folder"),
        ("evaluate data", "data: expected a run folder"),
        ("predict data --positions places.csv -o out.npz", "data: expected a run folder"),
        ("predict data --positions places.csv -o out.npy", "out.npy: expected a name that ends in .npz"),
        ("evaluate heard", "heard: expected a run folder"),
        ("evaluate no\nwhere\x1b[2J", r"no\nwhere\x1b[2J"),
    ],
    ids=lambda text: text[:40],
)
def test_other_texts(call, word, refused):
    assert word in refused(call.split(" "))


def test_the_parsers_errors_escape_control_characters(refused):
    said = refused(["train", "data", "-o", "out", "--split=\x1b[2J"], status=2)
    assert "\x1b" not in said and r"\x1b[2J" in said
