"""metadata.json and gateway_info.yml: every field's type and range is checked, with its place in the sentence."""

import json

import pytest
import yaml

from scenes.files.errors import InputError
from simulate.dataset.metadata import read_metadata
from simulate.dataset.spectra_folder import read_gateway, write_gateway
from simulate.generation.request import read_request

BAD = [
    ([], r"expected a mapping, found \[\]"),
    ({"array": {"columns": 0}}, "array.columns: expected a whole number of at least 1, found 0"),
    ({"array": {"rows": 64, "columns": 17}}, "array.rows: expected at most 1024 elements in all, found 64 × 17"),
    ({"array": {"spacing": -0.5}}, "array.spacing: expected a number above 0, found -0.5"),
    ({"array": {"positions_m": [[0, 0, 0], [0, 0]]}}, r"array.positions_m\[1\]: expected a list of 3, found \[0, 0\]"),
    ({"array": {"positions_m": [[0, 0, 0]], "frequency": 1e9}}, "array.frequency: expected none, since frequency_hz"),
    ({"array": {}, "grid": {"elevation_step_deg": 0}}, "grid.elevation_step_deg: expected a number above 0, found 0"),
    ({"frequency_hz": 915}, "frequency_hz: expected hertz, .*, found 915"),
    ({"engine": "lasers"}, "engine: expected fullwave or rays, found 'lasers'"),
    ({"engine": "fullwave"}, "expected the key scene_file, found none"),
    ({"propagation": {"colour": 1}}, "propagation: expected a known key, found 'colour'"),
    ({"measurement": {"seed": 0, "gain_error_db": -1}}, "measurement.gain_error_db: .* from 0 to 60"),
    ({"scene_file": "/etc/passwd.yaml"}, "scene_file: expected a file in the folder .*, found '/etc/passwd.yaml'"),
    ({"seed": -1}, "seed: expected a whole number of at least 0, found -1"),
]


@pytest.mark.parametrize(("content", "sentence"), BAD, ids=[str(content)[:50] for content, _ in BAD])
def test_fields_are_checked(tmp_path, content, sentence):
    path = tmp_path / "metadata.json"
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=rf"metadata.json: {sentence}"):
        read_metadata(path)


@pytest.mark.parametrize("content", [{}, {"array": {}}, {"made_by": "another program", "rooms": [1, 2]}])
def test_what_other_programs_write_is_taken(tmp_path, content):
    (tmp_path / "metadata.json").write_text(json.dumps(content))
    assert read_metadata(tmp_path / "metadata.json") == content


def test_folder_that_is_to_be_made_again_needs_all_of_it(tmp_path):
    with pytest.raises(InputError, match=r"metadata.json: expected .* found no such"):
        read_request(tmp_path)
    (tmp_path / "metadata.json").write_text('{"seed": 1}')
    with pytest.raises(InputError, match=r"metadata.json: expected the key \w+, found none"):
        read_request(tmp_path)


POSE = "gateway1: {position: %s, orientation: %s}"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "expected a mapping, found nothing"),
        (POSE % ("[1, 2]", "[0, 0, 0, 1]"), r"gateway1.position: expected a list of 3, found \[1, 2\]"),
        (POSE % ("[1, 2, .nan]", "[0, 0, 0, 1]"), r"gateway1.position\[2\]: expected a number of .*, found nan"),
        (POSE % (f"[1, 2, {'9' * 400}]", "[0, 0, 0, 1]"), r"gateway1.position\[2\]: expected another value, found 99"),
        (POSE % ("[1, 2, 3]", "[0, 0, 1, 1]"), "gateway1.orientation: expected a quaternion of unit length, found"),
        ("a: &a [1]\nb: *a", "line 2: expected gateway1 .* found malformed YAML, the alias"),
    ],
)
def test_gateways_that_are_none(tmp_path, text, sentence):
    (tmp_path / "gateway_info.yml").write_text(text)
    with pytest.raises(InputError, match=rf"gateway_info.yml[:,] {sentence}"):
        read_gateway(tmp_path / "gateway_info.yml")


def test_gateways_of_other_programs_are_read(tmp_path):
    path = tmp_path / "gateway_info.yml"
    path.write_text("gateway1: {position: [1e-3, 2, 3.5], orientation: [0, 0, 0, 1], model: x}\ngateway2: {}\n")
    position, _ = read_gateway(path)
    assert position.tolist() == [1e-3, 2, 3.5]


@pytest.mark.parametrize("name", ["lab", "a: b", "[x", "# 1", "Büro", "2024-01-01", "yes", "x" * 200, "'", "- a"])
def test_every_name_of_a_scene_can_be_written(tmp_path, name):
    path = tmp_path / "gateway_info.yml"
    write_gateway(path, name, [1, 2, 3], [0, 0, 0, 1])
    assert yaml.safe_load(path.read_text())["dataset_name"] == name
    read_gateway(path)
