"""Folders of received powers: every byte of the format, and a sentence for each mistake."""

import re
from pathlib import Path

import numpy as np
import pytest

import bisplat
from scenes.files.errors import InputError
from tests.corpus import ANY_FILE

PLACES = np.array([[1.0, 2.0, 1.0], [4.0, 2.0, 1.0], [2.5, 0.25, 1.125], [3.0, 3.0, 1.0], [0.5, 1.5, 1.0]])
POWERS = np.array([[-48.0, -61.25], [-60.0, np.nan], [-52.0, -100.0], [-70.0, -99.0], [np.nan, -0.00001]])
GATEWAYS = {"door": (0.0, 0.0, 2.5), "7": (5.0, 0.0, 2.5)}


@pytest.fixture
def folder(tmp_path) -> Path:
    """A valid folder."""
    bisplat.write_dataset(
        tmp_path / "hall", PLACES, powers=POWERS, gateways=GATEWAYS, frequency="2.4 GHz", floor_dbm=-99
    )
    return tmp_path / "hall"


def test_files_are_those_of_nerf2_byte_by_byte(folder):
    assert (folder / "tx_pos.csv").read_text() == (
        "x,y,z\n1.000000,2.000000,1.000000\n4.000000,2.000000,1.000000\n2.500000,0.250000,1.125000\n"
        "3.000000,3.000000,1.000000\n0.500000,1.500000,1.000000\n"
    )
    assert (folder / "gateway_rssi.csv").read_text() == "door,7\n-48,-61.25\n-60,-100\n-52,-100\n-70,-99\n-100,0\n"
    assert (folder / "gateway_position.yml").read_text() == (
        "door: [0.000000, 0.000000, 2.500000]\n'7': [5.000000, 0.000000, 2.500000]\n"
    )
    assert (folder / "train_index.txt").read_text() == "0\n1\n3\n"
    assert (folder / "test_index.txt").read_text() == "2\n4\n"
    assert {path.name for path in folder.iterdir()} == {
        *("tx_pos.csv", "gateway_rssi.csv", "gateway_position.yml", "train_index.txt", "test_index.txt"),
        "metadata.json",
    }


def test_what_is_written_is_what_is_read(folder):
    read = bisplat.read_dataset(folder)
    np.testing.assert_array_equal(read.positions, PLACES)
    np.testing.assert_array_equal(read.powers, [[-48, -61.25], [-60, np.nan], [-52, np.nan], [-70, -99], [np.nan, 0]])
    assert read.gateway_names == list(GATEWAYS)
    np.testing.assert_array_equal(read.gateway_positions, list(GATEWAYS.values()))
    assert (read.floor_dbm, read.frequency.hertz, len(read)) == (-99, 2.4e9, 5)
    assert sorted([*read.train, *read.test]) == [0, 1, 2, 3, 4]


def test_a_foreign_folder_needs_neither_metadata_nor_index_files(folder):
    for name in ("metadata.json", "train_index.txt", "test_index.txt"):
        (folder / name).unlink()
    read = bisplat.read_dataset(folder)
    assert read.frequency is None and read.floor_dbm == -100 and len(read.train) == len(read.test) == 0


def test_gateways_go_by_their_names(folder):
    lines = (folder / "gateway_position.yml").read_text().splitlines()
    (folder / "gateway_position.yml").write_text("\n".join(lines[::-1]) + "\n")
    found = inspect_rssi(folder)
    np.testing.assert_array_equal(found.dataset.gateway_positions, list(GATEWAYS.values()))
    assert "another order" in found.warnings[0] and "NeRF²" in found.warnings[0]


HEAD = "door,7\n"
ROWS = "-48,-61\n-60,-100\n-52,-100\n-70,-99\n-100,-40\n"

MISTAKES = {
    "semicolons": ("gateway_rssi.csv", (HEAD + ROWS).replace(",", ";"), "separated by commas, found others"),
    "a column too few": ("gateway_rssi.csv", HEAD + ROWS + "-3\n", r"position 6 \(line 7\): .* found 1 numbers"),
    "a row too many": ("gateway_rssi.csv", HEAD + ROWS + "-3,-4\n", "each of the 5 positions .* found 6 rows"),
    "no header": ("gateway_rssi.csv", ROWS, "line 1: .* found '-48,-61'"),
    "an empty cell": ("gateway_rssi.csv", HEAD + "-48,\n" + ROWS[8:], 'position 1 .*, "7": .* -100 where nothing was'),
    "milliwatts": ("gateway_rssi.csv", HEAD + "1e-5,2e-6\n" * 5, "found 2e-06 to 1e-05, which look like linear powers"),
    "no minus sign": ("gateway_rssi.csv", HEAD + "48,61\n" * 5, "found 48 to 61, all positive"),
    "twice the same gateway": ("gateway_rssi.csv", "door,door\n" + ROWS, '"door" more than once'),
    "another gateway": ("gateway_rssi.csv", "door,window\n" + ROWS, r'gateway_position.yml: .* found none of "window"'),
    "a list of gateways": ("gateway_position.yml", "- [0, 0, 1]\n", "the position .* of each gateway by its name"),
    "a position too few": ("tx_pos.csv", "x,y,z\n1,2,3\n", "a row for each of the 1 positions of tx_pos.csv, found 5"),
    "numbered from 1": ("test_index.txt", "3\n5\n", r"row 2: .* from 0 to 4, found '5'; the first position has the nu"),
    "in both": ("test_index.txt", "0\n2\n", "not in train_index.txt, found 0 in both"),
    "a floor below the mark": ("metadata.json", '{"receiver": {"floor_dbm": -120}}', "floor_dbm: .* at least -100"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_refused_in_one_sentence(mistake, folder):
    name, content, sentence = MISTAKES[mistake]
    (folder / name).write_text(content)
    with pytest.raises(InputError, match=sentence) as refused:
        bisplat.read_dataset(folder)
    assert "\n" not in str(refused.value) and str(refused.value).startswith(str(folder))


@pytest.mark.parametrize("name", ["tx_pos.csv", "gateway_position.yml", "gateway_rssi.csv", "train_index.txt"])
@pytest.mark.parametrize("kind", ANY_FILE)
def test_what_is_no_file_is_refused(name, kind, folder):
    make, _ = ANY_FILE[kind]
    (folder / name).unlink()
    make(folder / name)
    with pytest.raises(InputError, match="expected"):
        bisplat.read_dataset(folder)


def test_other_folders_are_refused(tmp_path, folder):
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=r"expected received powers \(gateway_rssi.csv\), found no such file"):
        bisplat.read_dataset(tmp_path / "empty")
    with pytest.raises(InputError, match="found nothing there"):
        bisplat.read_dataset(tmp_path / "nowhere")
    with pytest.raises(InputError, match=r"expected a dataset of spectra, found received powers \(RSSI\)"):
        bisplat.read_dataset(folder)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"rssi_dbm": POWERS.T}, "rssi_dbm: expected powers of 5 positions × 2 gateways, found 2 × 5: transpose"),
        ({"rssi_dbm": np.where(np.isnan(POWERS), np.inf, POWERS)}, "rssi_dbm: expected finite powers, or NaN"),
        ({"rssi_dbm": POWERS * 1j}, "rssi_dbm: .* found complex128 numbers"),
        ({"positions": PLACES[:4]}, r"rssi_dbm: expected powers of 4 positions × 2 gateways, found shape \(5, 2\)"),
        ({"gateways": {"door": (0, 0), "7": (1, 1, 1)}}, 'gateways: expected a position x, y, z of "door"'),
        ({"gateways": [(0, 0, 2), (1, 1, 1)]}, "gateways: expected the position of each gateway by its name"),
        ({"frequency": 2.4}, "frequency: expected hertz"),
        ({"floor_dbm": -120}, "floor_dbm: expected a power in dBm from -100 to 60, found -120"),
    ],
)
def test_wrong_arguments_write_nothing(changed, message, tmp_path):
    given = {"positions": PLACES, "rssi_dbm": POWERS, "gateways": GATEWAYS, "frequency": 2.4e9} | changed
    with pytest.raises(InputError, match=message):
        bisplat.write_dataset(tmp_path / "hall", **given)
    assert not (tmp_path / "hall").exists()


def test_powers_at_the_mark_count_as_not_received(tmp_path, capsys):
    made = bisplat.write_dataset(
        tmp_path / "x", PLACES[:2], powers=[[-100.0, -50], [-103, -60]], gateways=GATEWAYS, frequency=2.4e9
    )
    assert np.isnan(made.powers[:, 0]).all()
    assert "2 powers of -100 dBm or less count as not received" in capsys.readouterr().err


def test_check_describes_the_folder(folder):
    checked = bisplat.check(folder)
    described, found = checked.description(), checked.figures()
    assert "5 positions × 2 gateways" in described["holds"] and described["powers (dBm)"] == "-99 to 0, median -60"
    assert (found["kind"], found["positions"], found["gateways"]) == ("rssi", 5, ["door", "7"])
    assert (found["weakest_dbm"], found["strongest_dbm"], found["not_received"]) == (-99, 0, 0.3)


def by_distance(at_one_metre: float, slope: float) -> tuple[np.ndarray, np.ndarray]:
    """Sixty positions, and powers of so many dBm at one metre, which fall by ``slope`` dB per decade."""
    places = np.random.default_rng(0).uniform((1, 1, 0), (9, 9, 2), (60, 3))
    distance = np.linalg.norm(places[:, None] - np.array(list(GATEWAYS.values())), axis=-1)
    return places, at_one_metre - slope * np.log10(distance)


def test_check_tells_the_exponent_of_the_distance(tmp_path):
    bisplat.write_dataset(tmp_path / "x", *by_distance(-30, 25), GATEWAYS, 2.4e9)
    found = bisplat.check(tmp_path / "x")
    assert found.warnings == [] and found.figures()["distance_exponent"] == pytest.approx(2.5, abs=1e-3)
    assert "exponent 2.5" in found.description()["distance law"]


@pytest.mark.parametrize(
    ("change", "warning"),
    [
        (lambda places, powers: (1000 * places, powers), "above those of free space at 2400 MHz .* in metres"),
        (lambda places, powers: (places, -130 - powers), "rise with the distance"),
        (lambda places, powers: (places, powers * [1, np.nan]), "gateway 7 received nothing"),
        (lambda places, powers: (places, powers * np.nan), "no gateway has received anything"),
        (lambda places, powers: (places, powers + 40), "lie above 0 dBm, which NeRF² reads as amplitudes above 1"),
        (lambda places, powers: (places, np.where(np.arange(60)[:, None] < 3, np.nan, powers)), "3 of 60 positions"),
    ],
)
def test_check_warns_of_oddities(change, warning, tmp_path):
    bisplat.write_dataset(tmp_path / "x", *change(*by_distance(-20, 30)), GATEWAYS, 2.4e9)
    assert re.search(warning, "\n".join(bisplat.check(tmp_path / "x").warnings))


def test_powers_weaker_than_the_mark_are_kept_and_named(folder):
    (folder / "gateway_rssi.csv").write_text(HEAD + ROWS.replace("-99", "-104"))
    assert np.nanmin(bisplat.read_dataset(folder).powers) == -104
    assert "1 of 7 powers lie below -100 dBm" in bisplat.check(folder).warnings[0]


def test_hdf5_has_all(folder, tmp_path):
    import h5py

    bisplat.export_hdf5(folder, tmp_path / "hall.h5")
    read = bisplat.read_dataset(folder)
    with h5py.File(tmp_path / "hall.h5") as file:
        np.testing.assert_array_equal(file["rssi_dbm"], read.powers)
        np.testing.assert_array_equal(file["positions_m"], read.positions)
        np.testing.assert_array_equal(file["gateway_positions_m"], read.gateway_positions)
        assert [name.decode() for name in file["gateway_names"]] == read.gateway_names
        assert (file.attrs["floor_dbm"], file.attrs["frequency_hz"]) == (-99, 2.4e9)
        assert list(file["test_index"]) == list(read.test)
