"""Datasets from responses of one's own."""

import json

import h5py
import numpy as np
import pytest

import bisplat
from scenes.files.errors import ParameterError
from simulate.dataset.dataset_folder import assumptions_of
from simulate.dataset.written_dataset import write_dataset
from simulate.spectra.array import PlanarArray
from simulate.spectra.element_array import ElementArray
from simulate.spectra.spectrum import picture

ARRAY = PlanarArray(rows=2, columns=3, spacing=0.4)
PLACES = np.array([[3.0, 0.5, 1.0], [2.0, -1.0, 1.5], [4.0, 1.0, 0.5], [3.5, 2.0, 1.0]])


def waves(array: PlanarArray = ARRAY, count: int = len(PLACES)) -> np.ndarray:
    """Two plane waves at each position."""
    generator = np.random.default_rng(0)
    azimuths, elevations = generator.uniform(0, 6, (2, count)), generator.uniform(0.2, 1.2, (2, count))
    return 1e-4 * (array.manifold(azimuths[0], elevations[0]) + 0.5j * array.manifold(azimuths[1], elevations[1]))


def test_what_is_given_is_what_is_read(tmp_path):
    turn = bisplat.facing((0, 1, 0))
    made = write_dataset(tmp_path / "mine", PLACES, waves(), ARRAY, "2.4 GHz", (1, 2, 3), turn)
    read = bisplat.read_dataset(tmp_path / "mine")
    np.testing.assert_allclose(read.responses, waves(), rtol=1e-6)
    np.testing.assert_array_equal(read.pictures, picture(read.beamformer.spectrum(waves())))
    np.testing.assert_array_equal(read.positions, PLACES)
    assert read.array == made.array == ARRAY and read.frequency.hertz == 2.4e9
    assert read.gateway_position.tolist() == [1, 2, 3]
    np.testing.assert_allclose(read.gateway_orientation, turn, atol=1e-9)
    assert (read.identification.source, read.frequency.source) == ("metadata", "metadata")
    assert assumptions_of(read) == [] and len(read.train) == 0


def test_an_array_of_element_positions_gets_the_frequency_of_the_dataset(tmp_path):
    circle = ElementArray.circle(6, 0.05)
    made = write_dataset(tmp_path / "mine", PLACES, waves(circle.at(2.4e9)), circle, "2.4 GHz")
    assert made.array == circle.at(2.4e9) == bisplat.read_dataset(tmp_path / "mine").array
    stated = json.loads((tmp_path / "mine" / "metadata.json").read_text())["array"]
    assert stated == {"positions_m": [list(each) for each in circle.positions_m]}
    np.testing.assert_array_equal(made.pictures, picture(made.beamformer.spectrum(waves(circle.at(2.4e9)))))
    assert made.identification.residual < 0.4
    with pytest.raises(ParameterError, match="frequency: expected the frequency of the array, "):
        write_dataset(tmp_path / "other", PLACES, waves(circle.at(2.4e9)), circle.at(915e6), "2.4 GHz")
    bisplat.export(tmp_path / "mine", tmp_path / "mine.h5")
    with h5py.File(tmp_path / "mine.h5") as file:
        np.testing.assert_array_equal(file.attrs["element_positions_m"], circle.positions_m)
        assert "array_rows" not in file.attrs


def test_responses_of_unknown_phase_are_not_compared_between_positions(tmp_path):
    made = write_dataset(tmp_path / "mine", PLACES, waves(), ARRAY, 915e6, phases="per-position")
    assert made.quantities == ["spectrum", "retrieved"]
    np.testing.assert_allclose(made.retrieved, waves(), rtol=1e-6)
    described = bisplat.check(tmp_path / "mine", split="random").description()
    assert described["complex responses"] == "yes, each with a phase of its own"


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"responses": waves().T}, r"responses: .* found 6 × 4: transpose them"),
        ({"responses": np.abs(waves())}, "responses: .* with phases, found real numbers only"),
        ({"responses": waves() * [[1], [0], [1], [0]]}, "found zeros in row 1 and 1 more; leave them out"),
        ({"responses": waves() * 1e-20}, "expected a largest magnitude from 1e-12"),
        ({"responses": waves() * np.nan}, "all finite"),
        ({"frequency": 2.4}, "2.4 GHz are 2.4e9"),
        ({"positions": PLACES * 1e6}, "coordinates within ±100000 m"),
        ({"phases": "free"}, "phases: .* found 'free'"),
        ({"moving": "both"}, "receivers: "),
        ({"receivers": PLACES}, "receivers: expected none"),
        ({"moving": "both", "receivers": PLACES[:3]}, "receivers: .* found 3"),
        ({"moving": "both", "receivers": PLACES, "gateway_position": (1, 0, 0)}, "gateway_position: "),
    ],
)
def test_mistakes_are_told_in_a_sentence(tmp_path, changed, message):
    given = {"positions": PLACES, "responses": waves(), "array": ARRAY, "frequency": 915e6} | changed
    with pytest.raises(ParameterError, match=message):
        write_dataset(tmp_path / "mine", **given)
    assert not (tmp_path / "mine").exists()


def test_both_ends_move(tmp_path):
    made = write_dataset(tmp_path / "mine", PLACES, waves(), ARRAY, 2.4e9, moving="both", receivers=PLACES[::-1])
    np.testing.assert_array_equal(made.transmitters, PLACES)
    np.testing.assert_array_equal(made.receivers, PLACES[::-1])
    np.testing.assert_array_equal(made.gateway_position, PLACES[-1])
    other = write_dataset(tmp_path / "other", PLACES, waves(), ARRAY, 2.4e9, moving="both", receivers=PLACES + 1)
    assert made.moving == "both" and made.fingerprint != other.fingerprint
