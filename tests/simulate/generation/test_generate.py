"""A simulated folder: valid, the same bytes however often it was interrupted, never a mix of two requests."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import simulate.rays.expected_correlation
import simulate.rays.tracer
from scenes.files import atomic
from scenes.files.errors import InputError
from simulate.dataset.dataset_folder import inspect
from simulate.engines.rays_engine import Rays
from simulate.generation import dataset_parts
from simulate.generation import generate as module
from simulate.generation.dataset_parts import make_part, picture_names
from simulate.generation.generate import generate
from simulate.generation.request import Request, read_request
from simulate.rays import chain_solver
from simulate.rays.core.propagation import Propagation
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.measurement import Measurement
from simulate.spectra.spectrum import picture
from tests.folders import contents

COUNT = 7


@pytest.fixture(scope="module")
def request_of(make_scene, floor):
    """Seven positions over a floor."""
    positions = np.random.default_rng(9).uniform([-5, -1, 0.5], [-2, 1, 2.5], (COUNT, 3))
    rays = Rays(Propagation(max_depth=1, diffraction=False, rays=20_000))
    return Request(make_scene(floor), positions, "uniform, seed 9", rays, seed=3)


@pytest.fixture(autouse=True)
def small_parts(monkeypatch):
    monkeypatch.setattr(module, "PART", 2)


@pytest.fixture(scope="module")
def finished(request_of, tmp_path_factory) -> Path:
    """The folder of a run that nothing interrupted."""
    folder = tmp_path_factory.mktemp("finished") / "dataset"
    part, module.PART = module.PART, 2
    try:
        generate(request_of, folder)
    finally:
        module.PART = part
    return folder


class Quick:
    """A tracer that costs nothing: what is tested is what is written, not what is traced."""

    def __init__(self, *arguments):
        pass

    def responses(self, positions):
        return np.exp(1j * positions @ np.arange(48).reshape(3, 16)).astype(np.complex64)


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(simulate.rays.tracer, "Tracer", Quick)
    monkeypatch.setattr(simulate.rays.expected_correlation, "expected_correlation", lambda *arguments: None)


def killed_at(monkeypatch, place, name: str, number: int):
    """Make a function raise KeyboardInterrupt at its ``number``-th call, counted from 0."""
    original, calls = getattr(place, name), []

    def function(*arguments, **options):
        calls.append(None)
        if len(calls) > number:
            raise KeyboardInterrupt
        return original(*arguments, **options)

    monkeypatch.setattr(place, name, function)


def test_simulated_folder_is_a_valid_dataset(finished, request_of):
    found = inspect(finished)
    assert found.problems == []
    assert found.warnings == []
    assert found.dataset.positions == pytest.approx(request_of.positions, abs=1e-6)
    assert found.dataset.responses.shape == (COUNT, 16)
    assert (found.dataset.pictures == picture(Beamformer().spectrum(found.dataset.responses))).all()
    assert found.dataset.gateway_position.tolist() == [0, 0, 1.5]
    assert found.dataset.gateway_orientation == pytest.approx([0.5, -0.5, -0.5, 0.5])
    assert sorted([*found.dataset.train, *found.dataset.test]) == list(range(COUNT))
    assert len(found.dataset.test) == 1  # a fifth
    assert {path.name for path in finished.iterdir()} == {
        *("channels.npz", "gateway_info.yml", "metadata.json", "scene", "spectrum"),
        *("test_index.txt", "train_index.txt", "tx_pos.csv"),
    }


def test_same_request_again_returns_at_once(finished, request_of, monkeypatch):
    before = contents(finished)
    monkeypatch.setattr(simulate.rays.tracer, "Tracer", None)  # calling it would be an error
    generate(request_of, finished)
    assert contents(finished) == before


@pytest.mark.parametrize("pictures", [0, 3, 6])
def test_killed_run_leaves_no_dataset_and_run_again_ends_with_the_same_bytes(
    pictures, finished, request_of, tmp_path, monkeypatch
):
    """With the real tracer: chains found again give the same responses."""
    folder = tmp_path / "dataset"
    with monkeypatch.context() as patch:
        # A part's responses are written after its two pictures.
        killed_at(patch, dataset_parts, "write_atomically", pictures + pictures // 2)
        with pytest.raises(KeyboardInterrupt):
            generate(request_of, folder)
    assert len(list((folder / "spectrum").iterdir())) == pictures
    assert not list(folder.rglob("*.tmp"))
    assert not list(folder.glob("*_index.txt"))
    monkeypatch.setattr(chain_solver, "_latest", {})
    generate(request_of, folder)
    assert contents(folder) == contents(finished)


@pytest.mark.kill
@pytest.mark.parametrize("function", ["fsync", "replace"])
def test_run_killed_at_any_write_ends_with_the_same_bytes(function, request_of, tmp_path, monkeypatch, quick):
    """Killed before a file is whole, or whole but not yet in its place: at each of them in turn."""
    generate(request_of, tmp_path / "whole")
    expected = contents(tmp_path / "whole")
    for number in range(100):
        folder = tmp_path / str(number)
        with monkeypatch.context() as patch:
            killed_at(patch, atomic.os, function, number)
            try:
                generate(request_of, folder)
            except KeyboardInterrupt:
                # A loader needs both indices; the last file written is the second one.
                assert not (folder / "test_index.txt").exists()
            else:
                break
        generate(request_of, folder)
        assert contents(folder) == expected, number
    assert number > COUNT + 5


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-20])


def empty(path: Path) -> None:
    path.write_bytes(b"")


@pytest.mark.parametrize("fault", [cut, empty, Path.unlink])
@pytest.mark.parametrize("name", ["spectrum/00003.png", "power_db/00004.tif", "parts/0000000002.npy"])
def test_damaged_part_of_an_unfinished_dataset_is_made_again(
    name, fault, request_of, tmp_path, monkeypatch, quick, capsys
):
    asked = replace(request_of, power=True)
    generate(asked, tmp_path / "whole")
    with monkeypatch.context() as patch:
        killed_at(patch, module, "write_responses", 0)
        with pytest.raises(KeyboardInterrupt):
            generate(asked, tmp_path / "killed")
    fault(tmp_path / "killed" / name)
    made = []
    monkeypatch.setattr(module, "make_part", lambda *args: made.append(args[2]) or make_part(*args))
    capsys.readouterr()
    generate(asked, tmp_path / "killed")
    assert contents(tmp_path / "killed") == contents(tmp_path / "whole")
    assert made == [2]
    progress = ("bisplat: finding paths", "bisplat: spectra: ")
    said = [line for line in capsys.readouterr().err.splitlines() if not line.startswith(progress)]
    if fault is Path.unlink and name.startswith("parts"):  # then it was never finished
        assert said == []
    else:
        (sentence,) = said
        assert sentence.startswith(f"bisplat: {tmp_path / 'killed' / name}: expected ")
        assert sentence.endswith("; the spectra 00003 to 00004 are made again")


@pytest.mark.parametrize("place", ["make_part", "write_responses", "write_positions", "write_index"])
def test_unfinished_dataset_is_told(place, request_of, tmp_path, monkeypatch, quick):
    with monkeypatch.context() as patch:
        killed_at(patch, module, place, int(place in ("make_part", "write_index")))
        with pytest.raises(KeyboardInterrupt):
            generate(request_of, tmp_path / "killed")
    (problem,) = inspect(tmp_path / "killed").problems
    assert problem.startswith(f"{tmp_path / 'killed'}: ") and "run the same command again" in problem
    generate(request_of, tmp_path / "killed")
    assert not inspect(tmp_path / "killed").problems


@pytest.mark.parametrize(
    ("name", "fault", "again"),
    [
        *(("spectrum/00003.png", fault, [2]) for fault in (cut, empty, Path.unlink)),
        *(("channels.npz", fault, [0, 2, 4, 6]) for fault in (cut, empty, Path.unlink)),
        *(("tx_pos.csv", fault, []) for fault in (empty, Path.unlink)),
    ],
)
def test_damaged_file_of_a_finished_dataset_is_made_again_and_the_rest_kept(
    name, fault, again, request_of, tmp_path, monkeypatch, quick, capsys
):
    folder = tmp_path / "whole"
    generate(request_of, folder)
    before = contents(folder)
    (folder / "train_index.txt").write_text("00001\n")  # a split of the user's own
    fault(folder / name)
    made = []
    monkeypatch.setattr(module, "make_part", lambda *args: made.append(args[2]) or make_part(*args))
    generate(request_of, folder)
    assert contents(folder) == before | {"train_index.txt": b"00001\n"}
    assert made == again
    assert ("made again" in capsys.readouterr().err) == (len(again) == 1 or (again != [] and fault is not Path.unlink))


@pytest.mark.parametrize("lost", ["scene", "rows", "order"])
def test_lost_scene_and_changed_positions_of_a_finished_dataset_are_made_again(lost, request_of, tmp_path, quick):
    folder = tmp_path / "data"
    generate(request_of, folder)
    before = contents(folder)
    lines = (folder / "tx_pos.csv").read_text().splitlines()
    if lost == "scene":
        shutil.rmtree(folder / "scene")
    elif lost == "rows":
        (folder / "tx_pos.csv").write_text("\n".join(lines[:-1]) + "\n")
    else:
        (folder / "tx_pos.csv").write_text("\n".join([lines[0], lines[2], lines[1], *lines[3:]]) + "\n")
    generate(request_of, folder)
    assert contents(folder) == before


def other(request: Request, what: str) -> Request:
    if what == "seed":
        return replace(request, seed=4)
    if what == "positions_sha256":
        return replace(request, positions=request.positions + 0.01)
    if what == "propagation.max_depth":
        return replace(request, engine=Rays(replace(request.engine.propagation, max_depth=2)))
    gateway = replace(request.scene.gateway, position=(0.0, 0.1, 1.5))
    return replace(request, scene=replace(request.scene, gateway=gateway))


@pytest.mark.parametrize("what", ["seed", "positions_sha256", "propagation.max_depth", "scene_sha256"])
def test_another_request_into_the_same_folder_is_refused_and_changes_nothing(what, finished, request_of):
    before = contents(finished)
    with pytest.raises(InputError, match=f"a dataset whose {what} is") as error:
        generate(other(request_of, what), finished)
    assert str(finished) in str(error.value)
    assert contents(finished) == before


def test_names_have_five_digits_or_as_many_as_needed():
    assert picture_names(2) == ["00001", "00002"]
    assert picture_names(100_000)[0] == "000001"


def test_folder_made_again_from_its_own_metadata_holds_the_same_bytes(finished, tmp_path):
    """With the real tracer, and the scene as its YAML has it."""
    generate(read_request(finished), tmp_path / "again")
    assert contents(tmp_path / "again") == contents(finished)


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("tx_pos.csv", "\n-", "\n-1", "expected the positions that the dataset was made with"),
        ("metadata.json", '_hz": 915000000.0', '_hz": 2400000000.0', "frequency_hz: .*scene.yaml, found 24000000"),
    ],
)
def test_folder_that_was_changed_is_not_made_again(name, old, new, message, finished, tmp_path):
    changed = shutil.copytree(finished, tmp_path / "changed") / name
    changed.write_text(changed.read_text().replace(old, new))
    with pytest.raises(InputError, match=message):
        read_request(changed.parent)


def test_measured_folder_has_power_and_noise_as_asked_for(request_of, tmp_path, quick):
    measured = replace(request_of, measurement=Measurement(snr_db=20.0), power=True)
    generate(measured, tmp_path / "measured")
    generate(request_of, tmp_path / "ideal")
    found, ideal = (inspect(tmp_path / name).dataset for name in ("measured", "ideal"))
    assert found is not None and ideal is not None
    error = np.linalg.norm(found.responses - ideal.responses) / np.linalg.norm(ideal.responses)
    assert 0.05 < error < 0.2
    power = np.asarray(Image.open(tmp_path / "measured" / "power_db" / "00003.tif"))
    np.testing.assert_allclose(power, Beamformer().power_db(found.responses[2]), atol=1e-3)
    assert not (tmp_path / "ideal" / "power_db").exists()
