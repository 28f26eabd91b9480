"""Transmitters are found from received powers and from channels of known rows, and errors are judged the same way."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

import bisplat
from learn.localisation.channel_evidence import ChannelFingerprints
from learn.localisation.power_evidence import PowerEvidence
from learn.quantities.quantity import Prediction
from scenes.files.errors import InputError
from simulate.positions.positions import write_positions
from tests.folders import write_hall, write_links

GATEWAYS = {"a": (0.0, 0, 2), "b": (9.0, 0, 2), "c": (0.0, 6, 2), "d": (9.0, 6, 1)}
WAVELENGTH = 0.125


@pytest.fixture(scope="module")
def hall(tmp_path_factory) -> bisplat.Dataset:
    """A hundred positions and four gateways with 2 dB of noise; what lies below −66 dBm is not received."""
    folder = tmp_path_factory.mktemp("powers") / "hall"
    made = write_hall(folder, [(0, 0, 0.5), (9, 6, 1.5)], 100, GATEWAYS, floor_dbm=-66)
    assert 0.01 < np.isnan(made.powers).mean() < 0.2
    return made


def channels_at(places: np.ndarray, scatterers: np.ndarray, antennas: np.ndarray) -> np.ndarray:
    """Channels over 52 subcarriers of 20 MHz: the line of sight, and a path by way of each scatterer."""
    frequencies = 299_792_458 / WAVELENGTH + np.linspace(-10e6, 10e6, 52)
    ways = [np.linalg.norm(places[:, None] - antennas, axis=2)]
    for each in scatterers:
        ways.append(np.linalg.norm(places - each, axis=1)[:, None] + np.linalg.norm(antennas - each, axis=1) + 1)
    return sum(np.exp(-2j * np.pi * way[..., None] * frequencies / 299_792_458) / way[..., None] for way in ways)


@pytest.fixture(scope="module")
def csi(tmp_path_factory) -> bisplat.Dataset:
    places = np.random.default_rng(0).uniform((2, -1.5, 1), (5, 1.5, 1.5), (160, 3))
    folder = tmp_path_factory.mktemp("csi") / "links"
    antennas = np.array([[0, 0.06 * number, 2] for number in range(8)])
    write_links(folder, channels_at(places, np.array([[4.0, 4, 1], [7, -1, 2]]), antennas))
    write_positions(folder / "tx_pos.csv", places)
    return bisplat.read_dataset(folder)


@pytest.mark.parametrize(("kind", "first", "least"), [("hall", 60, 0.8), ("csi", 120, 0.75)])
def test_errors_are_smaller_than_those_of_similar_rows(kind, first, least, request):
    data = request.getfixturevalue(kind)
    rows = bisplat.locate(replace(data, train=np.arange(first), test=np.arange(first, len(data)))).rows()
    found = {row["method"]: row["median, m"] for row in rows}
    assert found["locate"] < 0.9 * min(each for name, each in found.items() if name != "locate")
    assert rows[0]["within 90 % region"] >= least and rows[1]["within 90 % region"] is None


def test_likelihood_of_powers_by_hand():
    predicted = Prediction(np.array([[-50.0]]), np.array([[-50 - 2 * 1.6449]]), np.array([[-50 + 1.6449]]))
    heard, one = np.array([[-49.0], [-47.0], [-51.0], [np.nan]]), np.zeros((1, 3))

    def likely(floor, level):
        evidence = PowerEvidence(lambda points: predicted, heard, one, np.zeros((1, 1)), floor, 0.3)
        evidence.level = level
        assert evidence.misfit(one, np.array([-48 + level]))[0] == pytest.approx(4, rel=1e-3)
        return [each[0] for each in evidence.log_likelihood(one, heard)]

    level, above, below, nothing = likely(-53, 1.0)
    assert level - above == pytest.approx(2, rel=1e-3)  # two deviations of 1 dB above the median
    assert level - below == pytest.approx(0.5, rel=1e-3)  # one of 2 dB below it
    assert nothing == pytest.approx(np.log(4 / 3 * norm.cdf(-2)), rel=1e-3)  # the floor is 4 dB below it
    assert likely(-49, 0.0)[3] == pytest.approx(np.log(1 - 2 / 3 * norm.sf(1)), rel=1e-3)


def first_rows(count, data):
    """The first rows of a dataset."""
    values = {name: each[:count] for name, each in data.values.items()}
    return replace(data, names=data.names[:count], values=values, places=data.places[:count])


def test_level_of_another_device_is_estimated(hall, capsys):
    known, sent = first_rows(60, hall), hall.powers[60:]
    heard = np.where(sent - 6 < hall.floor_dbm, np.nan, sent - 6)
    places = bisplat.locate(known, heard)
    assert "6 dB weaker" in capsys.readouterr().err
    stated, wrong = (bisplat.locate(known, heard, level=each) for each in (-6, 0))
    first = [np.stack([each[0].position for each in found]) for found in (places, stated, wrong)]
    errors = [float(np.median(np.linalg.norm(each - hall.positions[60:], axis=1))) for each in first]
    np.testing.assert_array_equal(first[0], first[1])
    assert errors[0] < 0.8 * errors[2]


def test_transmitters_of_which_nothing_was_heard_have_no_place(hall, csi):
    found = bisplat.locate(hall, np.stack([hall.powers[60], np.full(4, -100.0)]), level=0)
    assert len(found[0]) == 1 and found[1] == []
    found = bisplat.locate(csi, np.stack([csi.uplink[3], 0 * csi.uplink[3]]))
    assert np.linalg.norm(found[0][0].position - csi.positions[3]) < 0.3
    assert found[0][0].misfit == pytest.approx(0, abs=1e-6) and found[1] == []


def test_command_locates_the_test_part_or_what_was_heard(hall, csi, bisplat_command):
    status, out, _ = bisplat_command("locate", hall.folder, "-o", "where.csv")
    assert status == 0 and "20 transmitters" in out and "fingerprint" in out
    with open("where.csv") as file:
        rows = list(csv.DictReader(file))
    assert {int(row["name"]) for row in rows} == set(hall.test.tolist()) and {row["part"] for row in rows} == {"test"}
    turned = "d,c,b,a\n" + ",".join(f"{each:g}" for each in np.nan_to_num(hall.powers[61][::-1], nan=-100)) + "\n"
    with open("heard.csv", "w") as file:
        file.write(turned)
    status, out, _ = bisplat_command("locate", hall.folder, "heard.csv", "--level", "0", "-o", "there.csv")
    assert status == 0 and "1 transmitters" in out and "fingerprint" not in out
    [place] = bisplat.locate(hall, hall.powers[[61]], level=0)[0]
    with open("there.csv") as file:
        [row] = csv.DictReader(file)
    assert float(row["x"]) == pytest.approx(place.position[0], abs=1e-3) and row["part"] == "new"
    _, out, err = bisplat_command("locate", csi.folder, "--split", "blocked", "-o", "csi.csv")
    assert "40 transmitters" in out and "fingerprint" in out and "2400 MHz is assumed" in err
    with open("csi.csv") as file:
        names = [int(row["name"]) for row in csv.DictReader(file)]
    assert names == [row for row in range(160) if row // 10 % 4 == 1]


def test_the_stated_level_is_that_of_the_simpler_methods_too(hall, bisplat_command):
    """A device that is 6 dB stronger, and said to be, is located as well by all methods as one of the same level."""
    tables = []
    for name, level in (("same", 0), ("stronger", 6)):
        bisplat.write_dataset(
            name, hall.positions[60:80], powers=hall.powers[60:80] + level, gateways=GATEWAYS, frequency="2.4 GHz"
        )
        status, out, _ = bisplat_command("locate", hall.folder, name, "--level", level, "-o", f"{name}.csv")
        assert status == 0 and "None" not in out
        tables.append([line for line in out.splitlines() if "fingerprint" in line])
    assert tables[0] == tables[1] and len(tables[0]) == 3


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("a,b,c\n-50,-50,-50\n", 'found "d" in hall alone'),
        ("a,b,c,d,e\n-50,-50,-50,-50,-50\n", 'found "e" in heard.csv alone'),
        ("a,b,c,d\n1e-6,1e-6,1e-6,1e-7\n", "expected powers in dBm, found 1e-07 to 1e-06"),
    ],
    ids=["too few gateways", "too many", "milliwatts"],
)
def test_heard_powers_of_other_gateways_are_refused(hall, bisplat_command, content, message):
    with open("heard.csv", "w") as file:
        file.write(content)
    status, _, err = bisplat_command("locate", hall.folder, "heard.csv", "-o", "where.csv")
    assert status == 1 and message in err.replace(str(hall.folder), "hall")


@pytest.mark.parametrize(
    ("up", "frequency", "message"), [(1, "2.4 GHz", "found one 1 m away"), (0, "5 GHz", "other: expected 2400 MHz")]
)
def test_gateways_elsewhere_or_of_another_frequency_are_refused(hall, bisplat_command, up, frequency, message):
    moved = {name: (x, y, z + up * (name == "b")) for name, (x, y, z) in GATEWAYS.items()}
    bisplat.write_dataset("other", hall.positions, powers=hall.powers, gateways=moved, frequency=frequency)
    status, _, err = bisplat_command("locate", hall.folder, "other", "-o", "where.csv")
    assert status == 1 and message in err.replace("2.4 GHz", "2400 MHz"), err


def test_fingerprint_is_largest_in_the_direction_of_a_wave():
    """Of the wave e^{jk u·a} from the direction u; 4 × 4 antennas in the x–y plane tell u but for the side."""
    places = 0.06 * np.stack([*np.meshgrid(np.arange(4), np.arange(4)), np.zeros((4, 4))], axis=-1).reshape(-1, 3)
    directions = ChannelFingerprints(places, WAVELENGTH, np.ones((1, 16, 26), complex)).directions
    for towards in directions[::11]:
        wave = np.exp(2j * np.pi / WAVELENGTH * places @ towards)[None, :, None] * np.ones(26)
        powers = ChannelFingerprints(places, WAVELENGTH, wave).of(wave).powers[0].reshape(len(directions), -1)
        found = directions[powers.max(axis=1).argmax()]
        np.testing.assert_allclose(found[:2], towards[:2], atol=0.2)


def test_level_phase_and_timing_of_channels_do_not_count(csi):
    known, sent = first_rows(120, csi), csi.uplink[120:]
    generator = np.random.default_rng(1)
    level, phase = generator.uniform(0.1, 10, (40, 1, 1)), generator.uniform(0, 2 * np.pi, (40, 1, 1))
    late = generator.uniform(-3, 3, (40, 1, 1)) / 26 * np.arange(26)
    other = sent * level * np.exp(1j * (phase - 2 * np.pi * late))
    for one, same in zip(bisplat.locate(known, sent), bisplat.locate(known, other), strict=True):
        np.testing.assert_allclose(one[0].position, same[0].position, atol=0.05)


def test_channels_without_positions_or_with_few_rows_are_refused(csi, tmp_path):
    write_links(tmp_path / "unplaced", np.ones((12, 8, 52), complex))
    with pytest.raises(InputError, match=r"tx_pos\.csv"):
        bisplat.locate(tmp_path / "unplaced", csi.uplink[:1])
    with pytest.raises(InputError, match="expected at least 10 known rows, found 9"):
        bisplat.locate(replace(csi, train=np.arange(9), test=np.arange(9, 12)))
    write_positions(tmp_path / "unplaced" / "tx_pos.csv", np.ones((12, 3)))
    with pytest.raises(InputError, match="expected at least two different positions"):
        bisplat.locate(tmp_path / "unplaced", csi.uplink[:1])


def test_plan_lowers_the_variance_of_powers(hall):
    planned = bisplat.plan(hall, 8)
    assert planned.positions.shape == (8, 3) and (np.diff(planned.open_variance) < 0).all()
    low, high = hall.positions.min(axis=0), hall.positions.max(axis=0)
    assert ((planned.positions > low - 1e-6) & (planned.positions < high + 1e-6)).all()
    with pytest.raises(bisplat.InputError, match="target: expected none"):
        bisplat.plan(hall, target=0.9)
