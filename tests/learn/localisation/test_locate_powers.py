"""Transmitters are found from received powers, by Bayes' rule over what a survey predicts."""

import csv

import numpy as np
import pytest
from scipy.stats import norm

import bisplat
from learn.localisation.baseline_positions import by_powers, error_rows
from learn.localisation.locate_powers import PowerLikelihood, locate_powers, posterior_places
from learn.quantities.quantity import Prediction
from tests.folders import write_hall

GATEWAYS = {"a": (0.0, 0, 2), "b": (9.0, 0, 2), "c": (0.0, 6, 2), "d": (9.0, 6, 1)}
KNOWN, TEST = np.arange(60), np.arange(60, 100)


@pytest.fixture(scope="module")
def hall(tmp_path_factory) -> bisplat.RssiDataset:
    """A hundred positions and four gateways with 2 dB of noise; what lies below −66 dBm is not received."""
    folder = tmp_path_factory.mktemp("powers") / "hall"
    made = write_hall(folder, [(0, 0, 0.5), (9, 6, 1.5)], 100, GATEWAYS, floor_dbm=-66)
    assert 0.01 < np.isnan(made.rssi_dbm).mean() < 0.2
    return made


def test_likelihood_by_hand():
    predicted = Prediction(np.array([[-50.0]]), np.array([[-50 - 2 * 1.6449]]), np.array([[-50 + 1.6449]]))
    likelihood = PowerLikelihood(predicted, floor=-53)
    at = {power: likelihood(np.array([power]), 1.0)[0] for power in (-49.0, -47.0, -51.0, np.nan)}
    assert at[-49.0] - at[-47.0] == pytest.approx(2, rel=1e-3)  # two deviations of 1 dB above the median
    assert at[-49.0] - at[-51.0] == pytest.approx(0.5, rel=1e-3)  # one of 2 dB below it
    assert at[np.nan] == pytest.approx(np.log(4 / 3 * norm.cdf(-2)), rel=1e-3)  # the floor is 4 dB below it
    weak = PowerLikelihood(predicted, floor=-49)(np.array([np.nan]), 0.0)[0]
    assert weak == pytest.approx(np.log(1 - 2 / 3 * norm.sf(1)), rel=1e-3)
    assert likelihood.misfit(np.array([-47.0]), 1.0)[0] == pytest.approx(4, rel=1e-3)


def test_errors_are_smaller_than_those_of_simpler_methods(hall):
    places = locate_powers(hall, hall.rssi_dbm[TEST], known=KNOWN, level=0)
    rows = error_rows(
        places, hall.positions[TEST], by_powers(hall, KNOWN, hall.rssi_dbm[TEST], 0), hall.positions[KNOWN]
    )
    found = {row["method"]: row["median, m"] for row in rows}
    assert found["locate"] < 0.9 * min(each for name, each in found.items() if name != "locate")
    assert rows[0]["within 90 % region"] >= 0.8


def test_level_of_another_device_is_estimated(hall, capsys):
    sent = hall.rssi_dbm[TEST]
    heard = np.where(sent - 6 < hall.floor_dbm, np.nan, sent - 6)
    places = locate_powers(hall, heard, known=KNOWN)
    assert "6 dB weaker" in capsys.readouterr().err
    stated, wrong = (locate_powers(hall, heard, known=KNOWN, level=each) for each in (-6, 0))
    first = [np.stack([each[0].position for each in found]) for found in (places, stated, wrong)]
    errors = [float(np.median(np.linalg.norm(each - hall.positions[TEST], axis=1))) for each in first]
    np.testing.assert_array_equal(first[0], first[1])
    assert errors[0] < 0.8 * errors[2]


def test_transmitter_that_nobody_hears_has_no_place(hall):
    heard = np.stack([hall.rssi_dbm[60], np.full(4, -100.0)])
    found = locate_powers(hall, heard, level=0)
    assert len(found[0]) == 1 and found[1] == []


def test_two_clusters_far_apart_are_two_places():
    generator = np.random.default_rng(0)
    points = np.concatenate([generator.normal((0, 0, 0), 0.2, (30, 3)), generator.normal((4, 0, 0), 0.2, (10, 3))])
    two = posterior_places(points, np.zeros(40), np.zeros(40), 0.0)
    assert [round(place.probability, 2) for place in two] == [0.75, 0.25]
    np.testing.assert_allclose(two[1].position, points[30:].mean(axis=0))
    np.testing.assert_allclose(two[0].covariance, np.cov(points[:30].T, bias=True))
    [one] = posterior_places(generator.uniform(0, 1, (500, 3)), np.zeros(500), np.zeros(500), 0.0)
    assert one.probability == 1


def test_command_locates_the_test_part_or_what_was_heard(hall, bisplat_command):
    status, out, _ = bisplat_command("locate", hall.folder, "-o", "where.csv")
    assert status == 0 and "20 transmitters" in out and "log-distance" in out
    with open("where.csv") as file:
        rows = list(csv.DictReader(file))
    assert {int(row["name"]) for row in rows} == set(hall.test.tolist()) and {row["part"] for row in rows} == {"test"}
    turned = "d,c,b,a\n" + ",".join(f"{each:g}" for each in np.nan_to_num(hall.rssi_dbm[61][::-1], nan=-100)) + "\n"
    with open("heard.csv", "w") as file:
        file.write(turned)
    status, out, _ = bisplat_command("locate", hall.folder, "--heard", "heard.csv", "--level", "0", "-o", "there.csv")
    assert status == 0 and "1 transmitters" in out and "log-distance" not in out
    [place] = locate_powers(hall, hall.rssi_dbm[[61]], level=0)[0]
    with open("there.csv") as file:
        [row] = csv.DictReader(file)
    assert float(row["x"]) == pytest.approx(place.position[0], abs=1e-3) and row["part"] == "new"


def test_the_stated_level_is_that_of_the_simpler_methods_too(hall, bisplat_command):
    """A device that is 6 dB stronger, and said to be, is located as well by all methods as one of the same level."""
    tables = []
    for name, level in (("same", 0), ("stronger", 6)):
        bisplat.write_rssi(name, hall.positions[60:80], hall.rssi_dbm[60:80] + level, GATEWAYS, "2.4 GHz")
        status, out, _ = bisplat_command("locate", hall.folder, "--heard", name, "--level", level, "-o", f"{name}.csv")
        assert status == 0 and "None" not in out
        tables.append([line for line in out.splitlines() if "fingerprint" in line or "log-distance" in line])
    assert tables[0] == tables[1] and len(tables[0]) == 4


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
    status, _, err = bisplat_command("locate", hall.folder, "--heard", "heard.csv", "-o", "where.csv")
    assert status == 1 and message in err.replace(str(hall.folder), "hall")


@pytest.mark.parametrize(
    ("up", "frequency", "message"), [(1, "2.4 GHz", "found one 1 m away"), (0, "5 GHz", "other: expected 2400 MHz")]
)
def test_gateways_elsewhere_or_of_another_frequency_are_refused(hall, bisplat_command, up, frequency, message):
    moved = {name: (x, y, z + up * (name == "b")) for name, (x, y, z) in GATEWAYS.items()}
    bisplat.write_rssi("other", hall.positions, hall.rssi_dbm, moved, frequency)
    status, _, err = bisplat_command("locate", hall.folder, "--heard", "other", "-o", "where.csv")
    assert status == 1 and message in err.replace("2.4 GHz", "2400 MHz"), err


def test_plan_lowers_the_variance_of_powers(hall):
    planned = bisplat.plan(hall, 8)
    assert planned.positions.shape == (8, 3) and (np.diff(planned.open_variance) < 0).all()
    low, high = hall.positions.min(axis=0), hall.positions.max(axis=0)
    assert ((planned.positions > low - 1e-6) & (planned.positions < high + 1e-6)).all()
    with pytest.raises(bisplat.InputError, match="target: expected none"):
        bisplat.plan(hall, target=0.9)
