"""config.json, protocol.json and results.jsonl: every field is checked, and the sentence names its place."""

import json

import pytest

from learn.comparison.compare import compare
from learn.comparison.results_folder import Results
from learn.training.config import Config, read_config
from scenes.files.errors import InputError, ParameterError
from tests import hostile_files as hostile

STEPS = {
    "steps": 3, "batch_size": 2, "learning_rate": 0.1, "weight_decay": 0.0, "full_resolution": 0.5,
    "matmul_precision": "highest", "find_phases": True, "init": None, "patience": 0,
}  # fmt: skip
CONFIG = {
    "dataset": "/data/room", "model": "helmholtz", "split": "blocked", "seed": 0, "split_seed": 0, "train_size": None,
    "options": {"primitives": 250}, "by_steps": STEPS, "array": {"rows": 4, "columns": 4, "spacing": 0.5},
    "grid": {"elevation_first_deg": 0.0, "elevation_step_deg": 1.0, "azimuth_step_deg": 1.0},
    "dataset_sha256": "0f", "frequency_hz": 915e6, "guard": 0.0,
}  # fmt: skip

BAD = [
    ({"dataset": 1}, "dataset: expected a text, found 1"),
    ({"split": "half"}, "split: expected area or blocked or files or random, found 'half'"),
    ({"seed": "0"}, "seed: expected a whole number, found '0'"),
    ({"seed": True}, "seed: expected a whole number, found True"),
    ({"train_size": 0}, "train_size: expected a whole number of at least 1, found 0"),
    ({"options": {"primitives": 10**12}}, "options: expected a whole number of at most 1e"),
    ({"options": {"primitives": {}}}, "options: expected .*, found {'primitives': {}}"),
    ({"by_steps": STEPS | {"steps": 0}}, "by_steps.steps: expected a whole number of at least 1, found 0"),
    ({"by_steps": STEPS | {"matmul_precision": "low"}}, "by_steps.matmul_precision: expected .*, found 'low'"),
    ({"by_steps": STEPS | {"speed": 0}}, "by_steps: expected a known key, found 'speed'"),
    ({"array": {"rows": 64, "columns": 64}}, "array.rows: expected at most 1024 elements in all, found"),
    ({"array": {"positions_m": [[0, 0, 0]]}}, "array.frequency: expected the frequency of the ElementArray"),
    ({"array": {"positions_m": [[0, 0]]}}, r"array.positions_m\[0\]: expected a list of 3, found"),
    ({"grid": {"elevation_step_deg": -1}}, "grid.elevation_step_deg: expected a number above 0, found -1"),
]


@pytest.mark.parametrize("value", [{"a": 1}, 2_000_000, object()])
def test_options_that_could_not_be_read_again_are_refused(value):
    with pytest.raises(ParameterError, match=r"limit: expected a (whole )?number"):
        Config(dataset="data", options={"limit": value})


def write(folder, name, content):
    (folder / name).write_text(content if isinstance(content, str) else json.dumps(content))
    return folder


@pytest.mark.parametrize(("change", "sentence"), BAD, ids=[str(change)[:50] for change, _ in BAD])
def test_settings_are_checked(tmp_path, change, sentence):
    with pytest.raises(InputError, match=f"config.json: {sentence}"):
        read_config(write(tmp_path, "config.json", CONFIG | change))


@pytest.mark.parametrize("key", sorted(CONFIG))
def test_settings_are_complete(tmp_path, key):
    with pytest.raises(InputError, match=f"config.json: expected the key {key}, found none"):
        read_config(write(tmp_path, "config.json", {k: v for k, v in CONFIG.items() if k != key}))


def begin_again(folder, dataset):
    compare(dataset, ["nearest"], split="blocked", output=folder)


@pytest.mark.parametrize("kind", hostile.SPECIAL)
@pytest.mark.parametrize("name", ["config.json", "protocol.json"])
def test_what_is_no_ordinary_file_is_not_opened(tmp_path, tiny, kind, name):
    hostile.SPECIAL[kind](tmp_path / name)
    with pytest.raises(InputError, match=f"{name}: expected the settings"):
        read_config(tmp_path) if name == "config.json" else begin_again(tmp_path, tiny)


PROTOCOL = {"dataset": "/data/room", "quantity": "spectrum", "split": "blocked", "seed": 0, "guard": 0.0}
PROTOCOL |= {"minutes": 5.0, "steps": None, "device": "1 CPU threads"}
ROW = {"label": "nearest", "seed": 0, "train_size": None, "test": 20, "ssim_median": 0.5}


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("[]", r"expected a mapping, found \[\]"),
        ("null", "expected a mapping, found nothing"),
        ("{", "expected the settings of a comparison as JSON, found malformed JSON"),
        (PROTOCOL | {"minutes": "5"}, "minutes: expected a number or nothing, found '5'"),
        (PROTOCOL | {"speed": 1}, "expected a known key, found 'speed'"),
    ],
)
def test_protocols_are_checked(tmp_path, tiny, content, sentence):
    with pytest.raises(InputError, match=f"protocol.json: {sentence}"):
        begin_again(write(tmp_path, "protocol.json", content), tiny)


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("{", "expected the scores of a method as JSON, found malformed JSON"),
        ("[]", r"expected a mapping, found \[\]"),
        (json.dumps(ROW | {"ssim_median": "high"}), "ssim_median: expected a number or nothing, found 'high'"),
        (json.dumps(ROW | {"label": None}), "label: expected a text, found nothing"),
    ],
)
def test_rows_are_checked(tmp_path, line, sentence):
    write(tmp_path, "results.jsonl", json.dumps(ROW | {"ssim_median": float("nan")}) + "\n" + line + "\n")
    with pytest.raises(InputError, match=f"results.jsonl, line 2: {sentence}"):
        _ = Results(tmp_path, "ssim_median").rows


def test_an_option_with_the_name_of_a_setting_is_told_apart():
    one, other = (Config(dataset="d", model="own:Class", seed=3, options={"seed": each}) for each in (1, 2))
    assert one.settings() != other.settings() and one.settings()["seed"] == 3 and one.settings()["option seed"] == 1
