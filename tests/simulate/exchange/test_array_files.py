"""Arrays of other programs' files."""

import h5py
import numpy as np
import pytest
import scipy.io

from scenes.files.errors import InputError
from simulate.exchange import array_files
from simulate.exchange.array_files import read_arrays

PLACES = np.arange(12.0).reshape(4, 3)
VALUES = np.exp(1j * np.arange(8.0)).reshape(4, 2)


def matlab_73(path):
    """As MATLAB 7.3 writes it: HDF5 with the axes in reverse order, and numbers of the parts real and imag."""
    with h5py.File(path, "w", userblock_size=512) as file:
        file["pos"] = PLACES.T
        parts = np.zeros(VALUES.T.shape, [("real", "f8"), ("imag", "f8")])
        parts["real"], parts["imag"] = VALUES.T.real, VALUES.T.imag
        file["H"] = parts
        file["#refs#/a"] = np.zeros(2)
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")


def hdf5(path):
    with h5py.File(path, "w") as file:
        file["measured/pos"], file["measured/H"], file["note"] = PLACES, VALUES, "a text"


WRITERS = {
    ".npz": lambda path: np.savez(path, pos=PLACES, H=VALUES),
    ".mat": lambda path: scipy.io.savemat(path, {"pos": PLACES, "H": VALUES, "note": "a text"}),
    "73.mat": matlab_73,
    ".h5": hdf5,
}


@pytest.mark.parametrize("ending", WRITERS)
def test_arrays_have_their_names_and_axes(tmp_path, ending):
    path = tmp_path / f"file{ending}"
    WRITERS[ending](path)
    found = {name.rpartition("/")[2]: each for name, each in read_arrays(path).items()}
    assert set(found) == {"pos", "H"}
    np.testing.assert_array_equal(found["pos"], PLACES)
    np.testing.assert_array_equal(found["H"], VALUES)


def test_an_array_alone_has_the_name_of_its_file(tmp_path):
    np.save(tmp_path / "channels.npy", VALUES)
    assert list(read_arrays(tmp_path / "channels.npy")) == ["channels"]


TABLES = {
    "commas, pairs of parts": "x,y,z,h1_re,h1_im,h2_re,h2_im\n1,2,3,0.5,-1,2,0\n4,5,6,1.5,0,0,1e-1\n",
    "semicolons, decimal commas": "x;y;z;h1;h2\n1;2;3;0,5-1j;2\n4;5;6;1,5;0,1j\n",
    "tabs": "x\ty\tz\th1\th2\n1\t2\t3\t0.5-1j\t2\n4\t5\t6\t1.5\t0.1j\n",
    "spaces, as MATLAB prints": "% x y z h1 h2\n1 2 3 0.5-1i 2\n4 5 6 1.5 0.1i\n",
    "a mark of byte order": "\ufeffx,y,z,h1 real,h1 imag,h2 real,h2 imag\n1,2,3,0.5,-1,2,0\n4,5,6,1.5,0,0,0.1\n",
    "texts beside": "name,x,y,z,h1,h2\na,1,2,3,0.5-1j,2\nb,4,5,6,1.5,0.1j\n",
}


@pytest.mark.parametrize("kind", TABLES)
def test_columns_of_a_table(tmp_path, kind):
    (tmp_path / "table.csv").write_text(TABLES[kind])
    found = read_arrays(tmp_path / "table.csv")
    assert list(found) == ["x", "y", "z", "h1", "h2"]
    np.testing.assert_array_equal(np.stack(list(found.values())[:3], axis=1), [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_allclose(np.stack([found["h1"], found["h2"]], axis=1), [[0.5 - 1j, 2], [1.5, 0.1j]])


def test_a_table_without_names_has_numbers(tmp_path):
    (tmp_path / "table.txt").write_text("1 2 3\n4 5 6\n")
    found = {name: each.tolist() for name, each in read_arrays(tmp_path / "table.txt").items()}
    assert found == {"1": [1, 4], "2": [2, 5], "3": [3, 6]}


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("log.bin", b"1", r"expected a file that ends in \.npy"),
        ("nowhere.npy", None, "found no such file"),
        ("a.npy", b"\x93NUMPY\x01\x00", "found a damaged file"),
        ("a.mat", b"MATLAB", "found a damaged file"),
        ("a.h5", b"HDF", "found a damaged file"),
        ("a.csv", b"\n\n", "found an empty file"),
        ("a.csv", b"x,y,z\n1,2,3\n4,5\n", "row 3: "),
        ("a.csv", b"x,y,z\n1,2,3\n4,five,6\n7,8,9\n", "column 'y': .* row 2, found 'five'"),
        ("a.csv", b"a,b\nc,d\n", "expected arrays of numbers, found none"),
    ],
)
def test_what_cannot_be_read_is_named(tmp_path, name, content, message):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_arrays(tmp_path / name)


def test_python_objects_are_not_run(tmp_path):
    np.save(tmp_path / "a.npy", np.array([{}], object), allow_pickle=True)
    with pytest.raises(InputError, match="found a damaged file"):
        read_arrays(tmp_path / "a.npy")


def test_what_unpacks_to_too_much_or_lies_in_another_file_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(array_files, "LARGEST", 2 * 10**6)
    np.savez_compressed(tmp_path / "a.npz", x=np.zeros(10**6))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("x", (10**6,), "f8", compression="gzip")
    (tmp_path / "secret").write_bytes(bytes(64))
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file.create_dataset("x", (8,), "f8", external=[(str(tmp_path / "secret"), 0, 64)])
    for name, found in (("a.npz", "MB when unpacked"), ("a.h5", "MB when unpacked"), ("b.h5", "in another file")):
        with pytest.raises(InputError, match=found):
            read_arrays(tmp_path / name)
