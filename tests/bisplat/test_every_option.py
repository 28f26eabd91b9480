"""Every option of every command changes what the command does, or is refused; ``option_trials`` has the calls."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import json
import shutil
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np
import pytest
import tyro
from PIL import Image, ImageOps

from bisplat.__main__ import main
from bisplat.commands.command_groups import COMMANDS
from scenes.scene.description import SceneObject
from scenes.scene.materials import p2040_material
from scenes.scene.shapes import box, sheet
from scenes.storage.scene_writing import write_scene
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.dataset_writer import write_positions
from simulate.exchange.given_responses import write_dataset
from simulate.generation.simulated_rooms import simulate_rooms
from simulate.rays.core.propagation import Propagation
from simulate.rssi.rssi_writer import write_rssi
from simulate.spectra.phase_retrieval import Retrieval
from tests.bisplat.option_trials import FIELD, NEVER, TRIALS
from tests.bisplat.refused_options import REFUSED
from tests.csi_folders import write_links
from tests.small_scene import small_scene

pytestmark = pytest.mark.usefixtures("small_models", "no_ceiling")

DRAWN = (
    "scenes.drawing.scene_drawing:draw_scene",
    "learn.reports.evaluation_report:write_evaluation",
    "learn.reports.evaluation_report:write_crossvalidation",
    "learn.reports.comparison_report:write_comparison",
    "learn.reports.comparison_report:write_ablation",
    "learn.reports.comparison_report:write_sweep",
    "learn.reports.engines_report:draw_plane",
    "learn.reports.score_report:draw_sweep",
    "learn.reports.coverage_report:draw_coverage",
    "learn.evaluation.engines_plane:compare_on_plane",
    "learn.comparison.experiment:array_ceiling",
)
"""Functions that draw, or compute a bound; they take most of the time."""

SETTINGS = {"config.json", "metadata.json", "protocol.json", "training.json"}
"""Files that record options. They do not show that an option has an effect."""

TIMES = {"training_seconds", "milliseconds_per_spectrum", "date"}
"""Keys of a row of results that differ from call to call."""


class Stopped(Exception):
    """A command came to the function at which it was to stop; has its arguments."""


def _patch(patches: pytest.MonkeyPatch, place: str, function: Callable) -> None:
    module, _, name = place.partition(":")
    patches.setattr(importlib.import_module(module), name, function)


def _run(words: list[str]) -> int:
    with mock.patch.object(sys, "argv", ["bisplat", *words]):
        try:
            main()
        except SystemExit as ended:
            return ended.code if isinstance(ended.code, int) else 1
    return 0


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """A folder with what the calls read."""
    folder = tmp_path_factory.mktemp("place")
    with pytest.MonkeyPatch.context() as patches:
        patches.chdir(folder)
        for name, seed in (("data", "0"), ("others", "3")):
            assert _run(f"simulate closet -n 12 -o {name} --seed {seed} --engine fullwave --field {FIELD}".split()) == 0
        assert _run("train data -o mlp --model mlp-responses --steps 2 --batch-size 2".split()) == 0
    simulated = shutil.ignore_patterns("metadata.json", "channels.npz", "field.npz", "scene")
    for name in ("measured", "twice", "small", "turned"):
        shutil.copytree(folder / "data", folder / name, ignore=simulated)
    rows = (folder / "data" / "tx_pos.csv").read_text().splitlines()
    (folder / "twice" / "tx_pos.csv").write_text("\n".join([rows[0], *(row for row in rows[1:7] for _ in "ab")]) + "\n")
    for path in (folder / "small" / "spectrum").iterdir():
        Image.open(path).resize((180, 45)).save(path)
    for path in (folder / "turned" / "spectrum").iterdir():
        ImageOps.flip(Image.open(path)).save(path)
    (folder / "one.txt").write_text((folder / "data" / "test_index.txt").read_text().splitlines()[0] + "\n")
    write_positions(folder / "places.csv", np.array([[2.1, 0.1, 1.2], [2.5, -0.2, 1.5]]))
    write_positions(folder / "near.csv", np.array([[2.3, 0.2, 1.3], [2.4, 0.1, 1.2]]))
    write_positions(folder / "far.csv", np.array([[2.3, 0.2, 1.3], [2.6, 0.1, 1.2]]))
    write_positions(folder / "others.csv", np.array([[2.2, 0.3, 1.1]]))
    (folder / "gateways.yml").write_text("door: [0.5, 0.3, 1.5]\nroof: {position: [1, 1, 2], pattern: dipole}\n")
    (folder / "far.yml").write_text("door: [0.5, 0.9, 1.5]\nroof: {position: [1, 1, 2], pattern: dipole}\n")
    write_rssi(folder / "powers", [[1, 0, 1], [2, 0, 1]], [[-50.0], [-60.0]], {"door": (0, 0, 1)}, 2.4e9)
    heard = np.random.default_rng(0).uniform(0, 3, (12, 3))
    write_rssi(folder / "heard", heard, -50 - 10 * heard[:, :1], {"door": (0, 0, 1)}, 2.4e9)
    (folder / "two.csv").write_text("door\n-60\n-70\n")
    write_links(folder / "links", np.exp(1j * np.arange(12 * 2 * 8)).reshape(12, 2, 8))
    angles = 2 * np.pi * np.arange(16) / 16
    write_positions(folder / "elements.csv", 0.1 * np.stack([np.cos(angles), np.sin(angles), 0.1 * angles], axis=1))
    write_positions(folder / "same.csv", np.zeros((2, 3)))
    given = read_dataset(folder / "data")
    band = given.responses[..., None] * np.array([1, 1j, -1, -1j])
    write_dataset(folder / "banded", given.positions, band, given.array, given.frequency.hertz, bandwidth=20e6)
    (folder / "banded" / "train_index.txt").write_text((folder / "data" / "train_index.txt").read_text())
    (folder / "banded" / "test_index.txt").write_text((folder / "data" / "test_index.txt").read_text())
    arrays = {
        "pos": given.positions,
        "elsewhere": given.positions + 1,
        "moved": given.positions + 2,
        "H": given.responses,
        "other": 2j * given.responses,
        "wide": band,
    }
    np.savez(folder / "recording.npz", **arrays)
    simulate_rooms(folder / "places", 2, spectra=6, propagation=Propagation(max_depth=0, diffraction=False, rays=100))
    box((-1, 2, 0), (4, 2.2, 2.4)).export(folder / "wall.obj")
    scene = small_scene(SceneObject("board", sheet((1.5, -3, 0), (0, 3, 0), (0, 0, 3)), "wood"))
    rough = {
        "concrete": p2040_material("concrete", scene.frequency, scattering_coefficient=0.5),
        "wood": p2040_material("wood", scene.frequency),
    }
    write_scene(dataclasses.replace(scene, materials=rough), folder / "rough")
    floor = dataclasses.replace(scene.objects[0], material="metal")
    write_scene(dataclasses.replace(small_scene(), objects=(floor,)), folder / "bare")
    return folder


@pytest.fixture(scope="module")
def outcomes() -> dict[tuple, Any]:
    """What calls did; most calls without an option are those of several trials."""
    return {}


@pytest.fixture
def outcome(place, outcomes, monkeypatch, capsys) -> Iterator[Callable]:
    """Function: words, function to stop at, file that exists -> what the command did."""
    monkeypatch.chdir(place)
    before = set(place.rglob("*"))
    for drawing in DRAWN:
        _patch(monkeypatch, drawing, lambda first, *others: first)
    _patch(monkeypatch, "scenes.browser.served_page:serve", lambda title, port, open_tab: open_tab(None))
    _patch(monkeypatch, "learn.view.tracing:Tracing", lambda *arguments: None)
    _patch(monkeypatch, "simulate.fullwave.gprmax:installed_gprmax", lambda what: "gprMax")
    retrieved = Retrieval(np.zeros((12, 16), complex), np.zeros(12))
    _patch(monkeypatch, "simulate.dataset.response_retrieval:retrieve", lambda dataset: retrieved)
    _patch(monkeypatch, "learn.comparison.ablate:ablate", lambda *arguments: SimpleNamespace(averages=list, remark=str))

    def clean() -> None:
        for path in sorted(set(place.rglob("*")) - before, reverse=True):
            path.rmdir() if path.is_dir() else path.unlink()

    def run(words: list[str], stops_at: str, there: str) -> Any:
        called = (*words, stops_at, there)
        if called not in outcomes:
            clean()
            outcomes[called] = run_anew(words, stops_at, there)
        return outcomes[called]

    def run_anew(words: list[str], stops_at: str, there: str) -> Any:
        if there:
            (place / there).parent.mkdir(exist_ok=True)
            (place / there).write_text("")
        with pytest.MonkeyPatch.context() as patches:
            if stops_at:
                module, _, name = stops_at.partition(":")
                signature = inspect.signature(getattr(importlib.import_module(module), name))

                def stop(*arguments, **named):
                    raise Stopped(_flat(signature.bind(*arguments, **named).arguments))

                _patch(patches, stops_at, stop)
            try:
                status = _run(words)
            except Stopped as stopped:
                return stopped.args[0]
        printed = capsys.readouterr()
        assert status == 0 or "bisplat: " in printed.err, printed.err
        new = sorted(path for path in set(place.rglob("*")) - before if path.is_file() and path.name not in SETTINGS)
        written = {str(path): _content(path) for path in new if "logs" not in path.parts and path.suffix != ".ckpt"}
        # Tables of methods have their training times, so that only the kind of the text is compared.
        out = printed.out.strip()[:1] if words[0] in ("compare", "ablate", "sweep") else printed.out
        return status, out, written

    yield run
    clean()


def _flat(value: Any) -> Any:
    """A value without functions and objects that differ from call to call."""
    if dataclasses.is_dataclass(value):
        return {field.name: _flat(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {name: _flat(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_flat(each) for each in value]
    if isinstance(value, np.ndarray):
        return value.tolist()
    return None if callable(value) else str(value)


def _content(path: Path) -> Any:
    if path.name == "results.jsonl":
        rows = [json.loads(line) for line in path.read_text().splitlines()]
        return [{key: value for key, value in row.items() if key not in TIMES} for row in rows]
    return path.read_bytes()


@pytest.mark.parametrize(
    ("command", "trial"),
    [pytest.param(name, trial, id=f"{name} {trial.words}") for name, trials in TRIALS.items() for trial in trials],
)
def test_option_changes_what_its_command_does(command, trial, outcome):
    without, given = (outcome(words, trial.stops_at, trial.there) for words in trial.calls)
    assert isinstance(given, dict) or given[0] == 0
    assert without != given


@pytest.mark.parametrize("call", REFUSED)
def test_option_that_can_do_nothing_is_refused(call, place, monkeypatch, capsys):
    monkeypatch.chdir(place)
    before = set(place.rglob("*"))
    assert _run(call.split()) == 1
    printed = capsys.readouterr()
    assert printed.err.startswith(f"bisplat: {REFUSED[call]}") and printed.err.count("\n") == 1, printed.err
    assert printed.out == "" and set(place.rglob("*")) == before


def options_of(command: str) -> list[list[str]]:
    """The spellings of each option of a command."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        parser = tyro.extras.get_parser(COMMANDS[command])
    return [list(action.option_strings) for action in parser._actions if action.option_strings]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_has_a_trial(command):
    tried = {trial.option for trial in TRIALS[command]} | {option for name, option in NEVER if name == command}
    missing = [spellings for spellings in options_of(command) if not tried & set(spellings)]
    assert missing == [["-h", "--help"]]
