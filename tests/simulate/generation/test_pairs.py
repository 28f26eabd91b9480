"""Datasets of which both ends of the link move: what is simulated, written, read again, described and refused."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from learn.data.splits import split
from learn.evaluation.check import check
from learn.view.subject import subject
from scenes.checks.occupancy import element_positions
from scenes.files.errors import InputError, ParameterError
from scenes.files.progress import progress_bar
from scenes.scene.description import SPEED_OF_LIGHT, SceneObject
from scenes.scene.shapes import box
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.torch_dataset import TorchDataset
from simulate.engines.rays_engine import Rays
from simulate.exchange.convert import convert
from simulate.exchange.csi_export import export_csi
from simulate.exchange.reading_options import Conversion
from simulate.generation.dataset_parts import part_by_worker
from simulate.generation.reciprocity import element_offsets
from simulate.generation.simulation import request_for, simulate
from simulate.generation.simulation_options import Simulation
from simulate.parallel.machines import Machines
from simulate.positions.positions import write_positions
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from tests.small_scene import small_scene

SIGHT = Propagation(max_depth=0)
REFLECTED = Propagation(max_depth=2, diffraction=False, rays=20_000)


@pytest.fixture(scope="module")
def scene():
    found = small_scene()
    return replace(found, gateway=replace(found.gateway, rows=2, columns=3))


@pytest.fixture(scope="module")
def pairs(scene, tmp_path_factory):
    folder = tmp_path_factory.mktemp("pairs") / "data"
    return simulate(scene, folder, 7, propagation=REFLECTED, moving="both", transmitters=3)


def of_fixed_array(scene, propagation, transmitter, receiver):
    """The responses of an array that stands still, by a simulation of its own."""
    standing = replace(scene, gateway=replace(scene.gateway, position=tuple(receiver)))
    tracer = Tracer(standing, propagation, np.stack([transmitter - 0.1, transmitter + 0.1]))
    return tracer.responses(transmitter[None])[0]


def sight(distance, wavelength):
    return wavelength / (4 * np.pi * distance) * np.exp(-2j * np.pi * distance / wavelength)


def test_pairs_receive_what_fixed_arrays_do(scene, pairs):
    expected = np.stack(
        [of_fixed_array(scene, REFLECTED, *ends) for ends in zip(pairs.transmitters, pairs.receivers, strict=True)]
    )
    errors = np.linalg.norm(pairs.responses - expected, axis=1) / np.linalg.norm(expected, axis=1)
    assert np.median(errors) < 1e-5 and errors.max() < 1e-4


def test_places_are_drawn_in_the_region(scene, pairs):
    low, high = scene.transmitter.region
    elements = pairs.receivers[:, None] + element_offsets(scene.gateway, scene.wavelength)
    assert (elements.min((0, 1)) >= low - 1e-6).all() and (elements.max((0, 1)) <= high + 1e-6).all()
    assert (pairs.transmitters >= low).all() and (pairs.transmitters <= high).all()
    _, counts = np.unique(pairs.transmitters, axis=0, return_counts=True)
    assert sorted(counts) == [2, 2, 3] and len(np.unique(pairs.receivers, axis=0)) == 7


def test_folder_has_both_ends(pairs):
    folder = pairs.folder
    rows = [(folder / name).read_text().splitlines() for name in ("tx_pos.csv", "rx_pos.csv")]
    assert [each[0] for each in rows] == ["x,y,z"] * 2 and [len(each) for each in rows] == [8, 8]
    np.testing.assert_allclose(pairs.gateway_position, pairs.receivers[0])
    assert pairs.moving == "both" and json.loads((folder / "metadata.json").read_text())["moving"] == "both"
    assert sorted([*pairs.train, *pairs.test]) == list(range(7))
    assert TorchDataset(pairs)[2]["receiver"].tolist() == pytest.approx(pairs.receivers[2].tolist())


def test_pairs_are_made_again_and_repaired(scene, pairs, tmp_path):
    again = simulate(pairs.folder, tmp_path / "again").folder
    shutil.copytree(again, tmp_path / "damaged")
    (tmp_path / "damaged/spectrum/00003.png").unlink()
    (tmp_path / "damaged/rx_pos.csv").unlink()
    simulate(scene, tmp_path / "damaged", 7, propagation=REFLECTED, moving="both", transmitters=3)
    for made in (again, tmp_path / "damaged"):
        for path in (each for each in pairs.folder.rglob("*") if each.is_file() and "scene" not in each.parts):
            assert (made / path.relative_to(pairs.folder)).read_bytes() == path.read_bytes(), path


def test_exchanged_and_changed_positions_are_told(pairs, tmp_path):
    folder = tmp_path / "data"
    shutil.copytree(pairs.folder, folder)
    assert not [each for each in check(folder).warnings if "digest" in each]
    kept = {name: (folder / name).read_bytes() for name in ("tx_pos.csv", "rx_pos.csv")}
    (folder / "tx_pos.csv").write_bytes(kept["rx_pos.csv"])
    assert any(each.startswith("tx_pos.csv changed since the simulation") for each in check(folder).warnings)
    (folder / "rx_pos.csv").write_bytes(kept["tx_pos.csv"])
    assert any(each.startswith("tx_pos.csv and rx_pos.csv are exchanged") for each in check(folder).warnings)


def test_workers_make_the_same(scene, pairs):
    wanted = Simulation(n=7, moving="both", transmitters=3)
    request = request_for(scene, wanted, Rays(REFLECTED), 0)
    engine = request.engine
    with progress_bar() as progress:
        sent = [engine.sent(each) for each in engine.sources(request.settings, pairs.folder, Machines(), progress)]
    part = part_by_worker((request, sent, 100, "pairs"), 1, 5)
    np.testing.assert_array_equal(part.responses, pairs.responses[5:])


def test_given_pairs(scene, tmp_path):
    transmitters = np.array([[2.1, 0.1, 1.2], [2.5, -0.2, 1.5], [2.1, 0.1, 1.2]])
    receivers = np.array([[2.4, 0.0, 1.4], [2.2, 0.2, 1.3], [2.3, -0.1, 1.3]])
    write_positions(tmp_path / "tx.csv", transmitters)
    write_positions(tmp_path / "rx.csv", receivers)
    arrays, files = (
        simulate(scene, tmp_path / name, propagation=SIGHT, moving="both", positions=first, receivers=second)
        for name, first, second in (("a", transmitters, receivers), ("f", tmp_path / "tx.csv", tmp_path / "rx.csv"))
    )
    np.testing.assert_array_equal(files.responses, arrays.responses)
    np.testing.assert_allclose(arrays.receivers, receivers)
    assert json.loads((files.folder / "metadata.json").read_text())["placement"] == "positions of tx.csv and rx.csv"
    elements = element_positions(replace(scene.gateway, position=tuple(receivers[1])), scene.wavelength)
    distance = np.linalg.norm(elements - transmitters[1], axis=-1)
    np.testing.assert_allclose(np.abs(arrays.responses[1]), scene.wavelength / (4 * np.pi * distance), rtol=2e-3)


def test_pairs_over_a_band_and_at_several_frequencies(scene, tmp_path):
    places = {"positions": [[2.1, 0.1, 1.2], [2.5, -0.2, 1.5]], "receivers": [[2.4, 0.0, 1.4], [2.2, 0.2, 1.3]]}
    given = {name: np.array(each) for name, each in places.items()} | {"propagation": SIGHT, "moving": "both"}
    wide = simulate(scene, tmp_path / "wide", bandwidth="20 MHz", subcarriers=6, **given)
    elements = given["receivers"][:, None] + element_offsets(scene.gateway, scene.wavelength)
    distance = np.linalg.norm(elements - given["positions"][:, None], axis=-1)
    for subcarrier, hertz in enumerate(wide.band.frequencies(scene.frequency)):
        expected = sight(distance, SPEED_OF_LIGHT / hertz)
        np.testing.assert_allclose(wide.band_responses[..., subcarrier], expected, rtol=2e-3)
    with pytest.raises(InputError, match="expected spectra of a link with one end that stands still"):
        export_csi(wide, tmp_path / "csi")
    simulate(scene, tmp_path / "two", frequencies=(915e6, 1e9), **given)
    assert not [each for each in check(tmp_path / "two").warnings if "digest" in each]
    second = read_dataset(tmp_path / "two", 1e9)
    np.testing.assert_array_equal(second.receivers, given["receivers"])
    np.testing.assert_allclose(second.responses, sight(distance, second.wavelength), rtol=2e-3)
    convert(tmp_path / "two", tmp_path / "one", Conversion(frequency="1 GHz"))
    one = read_dataset(tmp_path / "one")
    np.testing.assert_array_equal(one.receivers, second.receivers)
    assert one.moving == "both"


def test_check_describes_pairs(pairs):
    found = check(pairs.folder)
    told = found.description()
    assert found.valid and found.split.leakage is None and found.split.spacing is None
    assert told["moving"].startswith("both ends")
    assert "receivers (m)" in told and "gateway at (m)" not in told and "known positions" not in told
    assert found.figures()["split"]["test"] == 1


@pytest.mark.parametrize(
    "refused",
    [
        lambda dataset: split(dataset, "random", 0),
        lambda dataset: check(dataset.folder, "random"),
        lambda dataset: subject(str(dataset.folder)),
    ],
)
def test_what_needs_a_fixed_end_refuses_pairs(refused, pairs):
    with pytest.raises(InputError, match="data: expected spectra of a link with one end that stands still"):
        refused(pairs)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "transmitters: expected how many places the transmitter has"),
        ({"transmitters": 5}, "transmitters: expected a whole number of at most 4, found 5"),
        ({"transmitters": 2, "moving": "receiver"}, "transmitters: expected none unless both ends move"),
        ({"transmitters": 2, "engine": "fullwave"}, "moving: expected transmitter or receiver in full wave"),
        ({"positions": "two"}, "receivers: expected the array's places beside the transmitters' positions,"),
        ({"positions": "two", "receivers": "two", "transmitters": 2}, "transmitters: expected none beside positions"),
        ({"receivers": "two", "transmitters": 2}, "receivers: expected positions of the transmitter beside them"),
        ({"positions": "same", "receivers": "same"}, "positions: expected at least two different pairs, found 2 alike"),
        ({"positions": "many", "receivers": "many"}, "positions: expected at most 100 places of the transmitter"),
        ({"positions": "two", "receivers": "touching"}, "positions: expected transmitters apart from the array's elem"),
        ({"positions": "inside", "receivers": "two"}, 'positions: expected a free place in row 0, found one inside "b'),
        ({"positions": "two", "receivers": "inside"}, 'receivers: expected a free place in row 0, found one inside "b'),
    ],
)
def test_options_of_pairs_that_are_refused(scene, options, message, tmp_path):
    places = {
        "two": np.array([[2.1, 0.1, 1.2], [2.5, -0.2, 1.5]]),
        "same": np.array([[2.1, 0.1, 1.2]] * 2),
        "many": np.stack([np.linspace(2, 2.5, 101), np.zeros(101), np.ones(101)], axis=1),
        "touching": np.array([[2.4, 0.1, 1.2], [2.5, -0.2, 1.5] - element_offsets(scene.gateway, scene.wavelength)[4]]),
        "inside": np.array([[8.0, 0.0, 1.0], [2.5, -0.2, 1.5]]),
    }
    block = SceneObject("block", box((7.5, -0.5, 0.5), (8.5, 0.5, 1.5)), "concrete")
    scene = replace(scene, objects=(*scene.objects, block))
    given = {name: places.get(value, value) if isinstance(value, str) else value for name, value in options.items()}
    with pytest.raises(ParameterError) as refused:
        simulate(scene, tmp_path / "data", 4, **{"moving": "both", **given})
    assert str(refused.value).startswith(message) and not (tmp_path / "data").exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda folder: (folder / "rx_pos.csv").unlink(), "rx_pos.csv: expected a CSV of positions"),
        (lambda folder: write_positions(folder / "rx_pos.csv", np.ones((2, 3))), "rx_pos.csv: expected 7 rows"),
        (lambda folder: (folder / "metadata.json").unlink(), 'rx_pos.csv: expected "moving": "both"'),
    ],
)
def test_folder_that_lacks_an_end_is_refused(change, message, pairs, tmp_path):
    folder = Path(shutil.copytree(pairs.folder, tmp_path / "data"))
    change(folder)
    with pytest.raises(InputError, match=message):
        read_dataset(folder)


@pytest.mark.parametrize(("name", "old", "new"), [("rx_pos.csv", ".", ".1"), ("metadata.json", '"both"', '"receiver"')])
def test_pairs_that_have_changed_are_not_made_again(name, old, new, pairs, tmp_path):
    changed = Path(shutil.copytree(pairs.folder, tmp_path / "data")) / name
    header, rest = changed.read_text().split("\n", 1)
    changed.write_text(f"{header}\n{rest.replace(old, new)}")
    with pytest.raises(InputError, match="expected the receivers that the dataset was made with, found a change"):
        simulate(changed.parent, tmp_path / "again")
