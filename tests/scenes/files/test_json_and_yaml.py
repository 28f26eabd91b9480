"""JSON and YAML from anywhere: what is neither, or too much of it, gets one sentence, soon."""

import time

import msgspec
import pytest
import yaml

from scenes.files.errors import InputError
from scenes.files.json_yaml_xml import PlainDumper, read_json, read_yaml
from scenes.files.schema import conform
from tests import hostile_files as hostile


def write(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize(
    ("read", "content"),
    [
        *(pytest.param(read_json, content, id=f"JSON: {case}") for case, content in hostile.JSON.items()),
        *(pytest.param(read_yaml, content, id=f"YAML: {case}") for case, content in hostile.YAML.items()),
    ],
)
def test_damaged_files(tmp_path, read, content):
    path = write(tmp_path / "given", content)
    began = time.perf_counter()
    with pytest.raises(InputError, match=r"given(, line \d+)?: expected a thing.*found ") as caught:
        read(path, "a thing")
    assert time.perf_counter() - began < 5
    assert str(caught.value).isprintable() and len(str(caught.value)) < 600


@pytest.mark.parametrize(
    ("content", "value"),
    [
        ("\ufeff{}", {}),
        ('{"a": [1, 2.5, null, true, "ü"]}', {"a": [1, 2.5, None, True, "ü"]}),
        ("[" * 50 + "]" * 50, None),
        (str(10**30), 10**30),
    ],
)
def test_json_is_read_as_it_is(tmp_path, content, value):
    found = read_json(write(tmp_path / "given", content), "a thing")
    assert value is None or found == value


def test_nan_is_read_where_a_model_may_have_diverged(tmp_path):
    assert read_json(write(tmp_path / "given", "[NaN]"), "scores", nan=True) != [0]


@pytest.mark.parametrize(
    ("content", "value"),
    [
        ("\ufeffa: 1\n", {"a": 1}),
        ("a: 2024-01-31\n", {"a": "2024-01-31"}),  # a text, since nothing of ours is a date
        ("a: 2024-13-45\n", {"a": "2024-13-45"}),
        ("a: {b: [1, 2.5, null, x]}\n", {"a": {"b": [1, 2.5, None, "x"]}}),
        ("a: [1e3, -.5, 5., -1.5e-3, 010, .inf]\n", {"a": [1000.0, -0.5, 5.0, -0.0015, 10, float("inf")]}),
        ("a: [1_0, 1:30, 1:30.5, 0x10, １]\n", {"a": ["1_0", "1:30", "1:30.5", "0x10", "１"]}),
        ("", None),
    ],
)
def test_yaml_is_read_as_it_is(tmp_path, content, value):
    assert read_yaml(write(tmp_path / "given", content), "a thing") == value


@pytest.mark.parametrize("text", ["1_0", "1:30", "0x10", "010", "1e3", "-.5", "１", "1.5", "on", "2024-01-01"])
def test_a_text_that_looks_like_a_number_is_written_as_a_text(tmp_path, text):
    """A scene may have such a name."""
    written = yaml.dump({"name": text}, Dumper=PlainDumper)
    assert read_yaml(write(tmp_path / "given", written), "a thing") == {"name": text}


@pytest.mark.parametrize("value", ["1_0", "1:30", "0x10", "３", "!!int 1_0", "!!float 1:30"])
def test_what_only_a_program_reads_as_a_number_is_refused(tmp_path, value):
    path = write(tmp_path / "given", f"rows: 1\nsize: [0, {value}]\n")
    with pytest.raises(InputError, match=rf"expected a(.*) number, found '{value.split()[-1]}'"):
        conform(read_yaml(path, "a thing"), Inner, str(path), numbers_as_text=True)


class Inner(msgspec.Struct, forbid_unknown_fields=True):
    rows: int
    size: tuple[float, float] = (0.0, 0.0)


class Outer(msgspec.Struct):
    inner: Inner
    many: list[Inner] = []


@pytest.mark.parametrize(
    ("value", "sentence"),
    [
        (None, "expected a mapping, found nothing"),
        ({}, "expected the key inner, found none"),
        ({"inner": {"rows": True}}, "inner.rows: expected a whole number, found True"),
        ({"inner": {"row": 4}}, r'inner: expected a known key, found \'row\'; did you mean "rows"\?'),
        ({"inner": {"rows": 4, "size": [1]}}, r"inner.size: expected a list of 2, found \[1\]"),
        ({"inner": {"rows": 4, "size": [1, "x"]}}, r"inner.size\[1\]: expected a number, found 'x'"),
        ({"inner": {"rows": 4, "size": [1, 10**400]}}, r"inner.size\[1\]: expected another value, found 1000.*range\)"),
        ({"inner": {"rows": 4}, "many": [{"rows": 1}, {}]}, r"many\[1\]: expected the key rows, found none"),
        ({"inner": {"rows": "x\x1b[2J"}}, r"inner.rows: expected a whole number, found 'x\\x1b\[2J'"),
    ],
)
def test_schema_names_the_key_and_the_value(value, sentence):
    with pytest.raises(InputError, match=f"^file: {sentence}$"):
        conform(value, Outer, "file")
