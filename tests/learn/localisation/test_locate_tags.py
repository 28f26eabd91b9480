"""Tags are located from responses along the track of a moving antenna."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

import bisplat
from bisplat.commands.locate_command import locate as locate_command
from learn.localisation.located_places import read_places
from learn.localisation.track_evidence import DirectPath
from scenes.files.errors import InputError, ParameterError
from simulate.dataset.responses_file import write_responses

FREQUENCY = 920.625e6
WAVELENGTH = 299_792_458 / FREQUENCY
TRACK = np.stack([np.linspace(0, 1, 50), np.zeros(50), np.zeros(50)], axis=1)
BOX = np.array([[-0.1, 0.2, 0.0], [1.1, 1.3, 0.0]])


def free_space(place, track=TRACK):
    """One-way responses of a tag in free space."""
    distance = np.linalg.norm(track - place, axis=1)
    return np.exp(-2j * np.pi * distance / WAVELENGTH) / distance


def by_mirror(place, wall=2.0, reflection=-0.3):
    """One-way responses of a tag in front of a wall beyond it, y = wall, that is a mirror."""
    image = np.array(place) * [1, -1, 1] + [0, 2 * wall, 0]
    return free_space(place) + reflection * free_space(image)


def locate_tags(responses, track=TRACK, box=BOX, **given):
    return bisplat.locate(track, responses, region=box, frequency=FREQUENCY, **given)


@pytest.mark.parametrize("place", [(0.3, 0.7, 0.0), (0.8, 0.5, 0.0)])
@pytest.mark.parametrize("round_trip", [False, True])
@pytest.mark.parametrize("phases_only", [False, True])
def test_a_tag_in_free_space_is_found_to_a_millimetre(place, round_trip, phases_only):
    responses = 3e-4 * np.exp(2j) * free_space(place) ** (2 if round_trip else 1)
    responses = responses / np.abs(responses) if phases_only else responses
    found = locate_tags([responses], round_trip=round_trip)[0]
    assert len(found) == 1
    assert np.linalg.norm(found[0].position - place) < 1e-3
    assert np.sqrt(np.trace(found[0].covariance)) < 1e-3
    assert found[0].misfit < 1e-6
    assert found[0].covariance[2, 2] == 0  # the box is flat


def test_a_tag_near_a_mirror_is_within_its_region():
    generator = np.random.default_rng(0)
    places = np.pad(generator.uniform([0.1, 0.4], [0.9, 0.9], (20, 2)), [(0, 0), (0, 1)])
    found = locate_tags([by_mirror(place) for place in places])
    judged = replace(found, truth=places)
    assert np.median(judged.errors["locate"]) < 0.03 and judged.share_in_region >= 0.7


def test_noise_widens_the_region():
    place, generator = (0.4, 0.6, 0.0), np.random.default_rng(1)
    noise = generator.normal(size=50) + 1j * generator.normal(size=50)
    spreads = []
    for level in (0.003, 0.1):
        responses = free_space(place) + level * noise
        found = locate_tags([responses])[0][0]
        spreads.append(np.sqrt(np.trace(found.covariance)))
        assert np.linalg.norm(found.position - place) < 3 * spreads[-1]
    assert spreads[1] > 3 * spreads[0]


def test_stops_without_a_read_are_left_out():
    place = (0.3, 0.7, 0.0)
    some = free_space(place)
    some[::3] = np.nan
    nothing = np.full(50, np.nan + 0j)
    few = np.where(np.arange(50) < 3, free_space(place), np.nan)
    whole, found, none, little = locate_tags([free_space(place), some, nothing, few])
    assert np.linalg.norm(found[0].position - whole[0].position) < 1e-3
    assert none == little == []


def test_the_pattern_ahead_counts():
    place = np.array([0.2, 0.45, 0.0])
    cosine = (place - TRACK) @ [0, 1, 0] / np.linalg.norm(TRACK - place, axis=1)
    ahead = locate_tags([cosine * free_space(place)], boresight=[0, 2, 0])[0]
    assert np.linalg.norm(ahead[0].position - place) < 1e-3
    otherwise = locate_tags([cosine * free_space(place)])[0]
    assert otherwise[0].misfit > 0.01 > ahead[0].misfit


def test_the_likelihood_is_that_of_the_whole_covariance():
    model = DirectPath(TRACK[::5], WAVELENGTH)
    places, responses = np.array([[0.3, 0.7, 0.0], [0.5, 0.5, 0.2]]), np.stack([by_mirror((0.3, 0.7, 0.0))[::5]])
    distance = np.linalg.norm(model.antennas[:, None] - model.antennas, axis=-1) / WAVELENGTH
    expected = []
    for direct in model.direct(places):
        gain = 1 + model.gain * np.exp(-((distance / model.length) ** 2) / 2)
        whole = np.outer(direct, direct.conj()) * gain + model.multipath * np.sinc(2 * distance)
        whole = whole + model.noise * np.eye(10)
        misfit = (responses[0].conj() @ np.linalg.solve(whole, responses[0])).real
        expected.append(-10 * np.log(misfit) - np.linalg.slogdet(whole)[1])
    found = model.log_likelihood(places, responses)[0]
    assert found == pytest.approx(expected, abs=0.05)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"heard": np.ones((1, 3), complex)}, "heard: expected"),
        ({"model_or_dataset": np.zeros((1001, 3))}, "expected at most 1000"),
        ({"region": BOX[::-1]}, "region: expected"),
        ({"region": None}, "region: expected"),
        ({"frequency": None}, "frequency: expected"),
        ({"boresight": (0, 0, 0)}, "boresight: expected"),
        ({"level": 3.0}, "level: expected none"),
    ],
)
def test_what_fits_nothing_is_refused(changed, message):
    given = {"model_or_dataset": TRACK, "heard": [free_space((0.3, 0.7, 0))], "frequency": FREQUENCY, "region": BOX}
    with pytest.raises(ParameterError, match=message):
        bisplat.locate(**(given | changed))


PLACES = np.array([[0.3, 0.7, 0.0], [0.6, 0.5, 0.0], [0.5, 0.8, 0.0], [0.45, 0.6, 0.0]])
ALONG = bisplat.ElementArray(TRACK - [0.5, 0, 0])


@pytest.fixture
def located(tmp_path):
    """Function: what write_dataset is given, and options of locate -> places by name."""

    def run(places, responses, array, region=None, **given):
        bisplat.write_dataset(tmp_path / "tags", places, responses, array, FREQUENCY, **given)
        locate_command((tmp_path / "tags",), tmp_path / "where.csv", region=region)
        return read_places(tmp_path / "where.csv")

    return run


@pytest.mark.parametrize(("turn", "swap"), [((0, 0, 0, 1), [0, 1, 2]), ((0, 0, np.sqrt(0.5), np.sqrt(0.5)), [1, 0, 2])])
def test_the_command_locates_the_tags_of_a_track(located, turn, swap):
    """The elements of an array that is turned by 90° about z lie along the world's y axis."""
    places = PLACES[:, swap]
    given = {"gateway_position": np.array([0.5, 0, 0])[swap], "gateway_orientation": turn, "phases": "per-position"}
    found = located(places, [free_space(place, TRACK[:, swap]) for place in places], ALONG, **given)
    assert np.array(list(found.values())) == pytest.approx(places, abs=1e-3)


def test_the_command_locates_the_transmitter_of_a_receiver_that_moved(located, tmp_path):
    place, array = PLACES[1], bisplat.PlanarArray(1, 2)
    offsets = WAVELENGTH * array.positions  # all elements are places of the track
    responses = np.stack([free_space(place, TRACK + offset) for offset in offsets], axis=1)
    given = {"gateway_position": (9, 9, 9), "moving": "receiver"}  # the position is not used
    found = located(TRACK, responses, array, tuple(BOX.ravel()), **given)
    assert found["1"] == pytest.approx(place, abs=1e-3)
    with pytest.raises(ParameterError, match="region: expected the box"):
        locate_command((tmp_path / "tags",), tmp_path / "other.csv")


def test_a_dataset_of_pictures_alone_is_refused(tmp_path, folder):
    shutil.copytree(folder / "one", tmp_path / "pictures")
    (tmp_path / "pictures" / "channels.npz").unlink()
    with pytest.raises(InputError, match="pictures: expected recorded responses"):
        locate_command((tmp_path / "pictures",), tmp_path / "where.csv")


def test_too_few_stops_of_an_antenna_are_refused(located):
    with pytest.raises(InputError, match="tags: expected at least 4 antenna positions, found 2"):
        located(PLACES, [free_space(place)[:2] for place in PLACES], bisplat.PlanarArray(1, 2))


def test_a_tag_that_was_not_read_has_no_place(located, tmp_path, capsys):
    responses = np.array([free_space(place) for place in PLACES[:2]])
    located(PLACES[:2], responses, ALONG, gateway_position=(0.5, 0, 0))
    responses[1] = 0
    write_responses(tmp_path / "tags" / "channels.npz", responses)
    locate_command((tmp_path / "tags",), tmp_path / "again.csv")
    assert "1 of which nothing was heard" in capsys.readouterr().out
    assert list(read_places(tmp_path / "again.csv")) == ["00001"]
