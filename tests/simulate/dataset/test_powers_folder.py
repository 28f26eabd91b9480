"""Folders of received powers: every byte of the format, what is read of it, and what is wrong with damaged ones."""

import re
from pathlib import Path

import numpy as np
import pytest

import bisplat
from scenes.files.errors import InputError
from simulate.dataset.dataset_folder import inspect
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
    assert read.frequency.source == "assumed" and read.floor_dbm == -100 and len(read.train) == len(read.test) == 0


def test_gateways_go_by_their_names(folder):
    lines = (folder / "gateway_position.yml").read_text().splitlines()
    (folder / "gateway_position.yml").write_text("\n".join(lines[::-1]) + "\n")
    found = inspect(folder)
    np.testing.assert_array_equal(found.dataset.gateway_positions, list(GATEWAYS.values()))
    assert "another order" in found.warnings[0] and "NeRF²" in found.warnings[0]


HEAD = "door,7\n"
ROWS = "-48,-61\n-60,-100\n-52,-100\n-70,-99\n-100,-40\n"

DAMAGES = {
    "a column too few": ("gateway_rssi.csv", HEAD + ROWS + "-3\n", "position 6"),
    "an empty cell": ("gateway_rssi.csv", HEAD + "-48,\n" + ROWS[8:], 'position 1 (line 2), "7"'),
    "no header": ("gateway_rssi.csv", ROWS, "line 1"),
    "a row too many": ("gateway_rssi.csv", HEAD + ROWS + "-3,-4\n", "5 positions"),
    "milliwatts": ("gateway_rssi.csv", HEAD + "1e-5,2e-6\n" * 5, "2e-06"),
    "no minus sign": ("gateway_rssi.csv", HEAD + "48,61\n" * 5, "61"),
    "twice the same gateway": ("gateway_rssi.csv", "door,door\n" + ROWS, "door"),
    "a gateway without a place": ("gateway_position.yml", "door: [0, 0, 1]\n", "7"),
    "numbered from 1": ("test_index.txt", "3\n5\n", "row 2"),
    "in both parts": ("test_index.txt", "0\n2\n", "found 0"),
    "a floor below the mark": ("metadata.json", '{"receiver": {"floor_dbm": -120}}', "floor_dbm"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damage_is_one_problem_that_names_the_place(damage, folder):
    name, content, place = DAMAGES[damage]
    (folder / name).write_text(content)
    [problem] = inspect(folder).problems
    assert problem.startswith(str(folder / name)) and place in problem and "\n" not in problem
    with pytest.raises(InputError):
        bisplat.read_dataset(folder)


@pytest.mark.parametrize("name", ["tx_pos.csv", "gateway_position.yml", "gateway_rssi.csv", "train_index.txt"])
@pytest.mark.parametrize("kind", ANY_FILE)
def test_what_is_no_file_is_refused(name, kind, folder):
    make, _ = ANY_FILE[kind]
    (folder / name).unlink()
    make(folder / name)
    assert inspect(folder).problems


@pytest.mark.parametrize(
    ("changed", "argument"),
    [
        ({"powers": POWERS.T}, "powers"),
        ({"powers": np.where(np.isnan(POWERS), np.inf, POWERS)}, "powers"),
        ({"positions": PLACES[:4]}, "powers"),
        ({"gateways": {"door": (0, 0), "7": (1, 1, 1)}}, "gateways"),
        ({"frequency": None}, "frequency"),
        ({"floor_dbm": -120}, "floor_dbm"),
        ({"array": bisplat.PlanarArray()}, "array"),
        ({"spectra": np.zeros((5, 90, 360))}, "powers"),
    ],
)
def test_wrong_arguments_write_nothing(changed, argument, tmp_path):
    given = {"positions": PLACES, "powers": POWERS, "gateways": GATEWAYS, "frequency": 2.4e9} | changed
    with pytest.raises(InputError, match=f"^{argument}: "):
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


def written(folder: Path, places: np.ndarray, powers: np.ndarray) -> None:
    bisplat.write_dataset(folder, places, powers=powers, gateways=GATEWAYS, frequency=2.4e9)


def test_check_tells_the_exponent_of_the_distance(tmp_path):
    written(tmp_path / "x", *by_distance(-30, 25))
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
        (lambda places, powers: (places, np.where(np.arange(60)[:, None] < 9, 0, powers - 9)), "18 of 120 .* 0 dBm"),
        (lambda places, powers: (places, powers + 40), "lie above 0 dBm, which NeRF² reads as amplitudes above 1"),
        (lambda places, powers: (places, np.where(np.arange(60)[:, None] < 3, np.nan, powers)), "3 of 60 positions"),
    ],
)
def test_check_warns_of_oddities(change, warning, tmp_path):
    written(tmp_path / "x", *change(*by_distance(-20, 30)))
    assert re.search(warning, "\n".join(bisplat.check(tmp_path / "x").warnings))


def test_powers_weaker_than_the_mark_are_kept_and_named(folder):
    (folder / "gateway_rssi.csv").write_text(HEAD + ROWS.replace("-99", "-104"))
    assert np.nanmin(bisplat.read_dataset(folder).powers) == -104
    assert "1 of 7 powers lie below -100 dBm" in bisplat.check(folder).warnings[0]


def test_hdf5_has_all(folder, tmp_path):
    import h5py

    bisplat.export(folder, tmp_path / "hall.h5")
    read = bisplat.read_dataset(folder)
    with h5py.File(tmp_path / "hall.h5") as file:
        np.testing.assert_array_equal(file["rssi_dbm"], read.powers)
        np.testing.assert_array_equal(file["positions_m"], read.positions)
        np.testing.assert_array_equal(file["gateway_positions_m"], read.gateway_positions)
        assert [name.decode() for name in file["gateway_names"]] == read.gateway_names
        assert (file.attrs["floor_dbm"], file.attrs["frequency_hz"]) == (-99, 2.4e9)
        assert list(file["test_index"]) == list(read.test)
