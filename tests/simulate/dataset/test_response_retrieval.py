"""``bisplat dataset --retrieve``: channels.npz retrieved from pictures, marked, and continued after an interruption."""

import numpy as np
import pytest

import bisplat
from bisplat.commands.dataset_commands import dataset as make_dataset
from scenes.files.errors import InputError
from simulate.dataset import responses_file
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.metadata import write_metadata
from simulate.dataset.picture_files import encode_picture
from simulate.dataset.responses_file import retrieve, write_responses
from simulate.spectra.phase_retrieval import retrieve_responses
from simulate.spectra.spectrum import normalise
from tests.simulate.dataset.conftest import COUNT


@pytest.fixture
def folder(folder):
    """The dataset as NeRF² has it, with a row more than pictures."""
    (folder / "channels.npz").unlink()
    (folder / "metadata.json").unlink()
    with (folder / "tx_pos.csv").open("a") as file:
        file.write("1,1,1\n")
    return folder


def test_retrieved_responses_make_the_pictures_and_are_not_taken_for_recorded_ones(folder):
    found = retrieve(read_dataset(folder))
    assert (found.residual < 0.5).all()
    dataset = read_dataset(folder)
    assert "response" not in dataset.values
    np.testing.assert_array_equal(dataset.retrieved, found.responses)
    again = normalise(dataset.beamformer.spectrum(dataset.retrieved))
    assert np.abs(again - dataset.spectra).max() < 3 / 255
    with np.load(folder / "channels.npz") as archive:
        assert archive["retrieved"] and archive["channels"].shape == (COUNT + 1, 16)
        assert np.isnan(archive["channels"][-1]).all() and np.isfinite(archive["residual"][:-1]).all()
    first = (folder / "channels.npz").read_bytes()
    retrieve(read_dataset(folder))
    assert (folder / "channels.npz").read_bytes() == first


def test_interrupted_retrieval_goes_on_with_the_same_result(folder, monkeypatch):
    monkeypatch.setattr(responses_file, "AT_ONCE", 3)
    whole = retrieve(read_dataset(folder))
    (folder / "channels.npz").unlink()
    batches = []

    def interrupted(spectra, beamformer, seed):
        batches.append(seed)
        if len(batches) == 2:
            raise KeyboardInterrupt
        return retrieve_responses(spectra, beamformer, seed)

    with monkeypatch.context() as patch:
        patch.setattr(responses_file, "retrieve_responses", interrupted)
        with pytest.raises(KeyboardInterrupt):
            retrieve(read_dataset(folder))
        again = retrieve(read_dataset(folder))
    assert batches == [0, 3, 3]  # the first batch only once
    np.testing.assert_array_equal(again.responses, whole.responses)
    assert not list(folder.glob("*partial*"))


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 cut"])
def test_damaged_partial_result_is_begun_anew(folder, capsys, content):
    whole = retrieve(read_dataset(folder))
    (folder / "channels.npz").unlink()
    partial = folder / "channels.npz.partial.npz"
    partial.write_bytes(content)
    again = retrieve(read_dataset(folder))
    np.testing.assert_array_equal(again.responses, whole.responses)
    assert f"{partial}: expected " in capsys.readouterr().err
    assert not partial.exists()


def test_command_replaces_retrieved_responses_only_by_force_and_recorded_ones_never(folder):
    make_dataset((folder,), retrieve=True)
    before = (folder / "channels.npz").stat().st_mtime_ns
    with pytest.raises(InputError, match=r"channels\.npz: expected no such file yet"):
        make_dataset((folder,), retrieve=True)
    assert (folder / "channels.npz").stat().st_mtime_ns == before
    make_dataset((folder,), retrieve=True, force=True)
    assert (folder / "channels.npz").stat().st_mtime_ns > before
    write_responses(folder / "channels.npz", np.ones((COUNT + 1, 16)))
    with pytest.raises(InputError, match="found recorded ones"):
        make_dataset((folder,), retrieve=True, force=True)


def test_responses_recorded_with_a_phase_of_each_position_are_not_replaced(tmp_path):
    """They count as retrieved, since their phases cannot be compared, but no picture gives them back."""
    array = bisplat.PlanarArray()
    waves = array.manifold(np.radians([200.0, 60.0]), np.radians([40.0, 10.0]))
    places = [[3, 0, 1], [2, 2, 1]]
    bisplat.write_dataset(tmp_path / "mine", places, waves, array, "2.4 GHz", phases="per-position")
    before = (tmp_path / "mine" / "channels.npz").read_bytes()
    with pytest.raises(InputError, match="found recorded ones"):
        make_dataset((tmp_path / "mine",), retrieve=True, force=True)
    assert (tmp_path / "mine" / "channels.npz").read_bytes() == before


def test_pictures_of_no_array_are_refused(folder):
    noise = np.random.default_rng(0).integers(0, 256, (COUNT, 90, 360), dtype=np.uint8)
    for number, image in enumerate(noise, start=1):
        (folder / "spectrum" / f"{number:05d}.png").write_bytes(encode_picture(image))
    with pytest.raises(InputError, match="expected pictures that a 4 × 4 array explains"):
        retrieve(read_dataset(folder))
    write_metadata(folder / "metadata.json", {"array": {}})  # stated: then it is tried
    assert (retrieve(read_dataset(folder)).residual > 3).all()
