"""Transmitters are found from channels over subcarriers, whatever their level, common phase and timing."""

import csv

import numpy as np
import pytest

import bisplat
from learn.localisation.baseline_positions import by_channels, error_rows
from learn.localisation.channel_regression import (
    DIRECTIONS,
    MOST_DIRECTIONS,
    ChannelFingerprints,
    _over_a_sphere,
)
from learn.localisation.locate_channels import locate_channels
from scenes.files.errors import InputError
from simulate.positions.positions import write_positions
from tests.folders import write_links

KNOWN, TEST = np.arange(120), np.arange(120, 160)
WAVELENGTH = 0.125


def channels_at(places: np.ndarray, scatterers: np.ndarray, antennas: np.ndarray) -> np.ndarray:
    """Channels over 52 subcarriers of 20 MHz: the line of sight, and a path by way of each scatterer."""
    frequencies = 299_792_458 / WAVELENGTH + np.linspace(-10e6, 10e6, 52)
    ways = [np.linalg.norm(places[:, None] - antennas, axis=2)]
    for each in scatterers:
        ways.append(np.linalg.norm(places - each, axis=1)[:, None] + np.linalg.norm(antennas - each, axis=1) + 1)
    return sum(np.exp(-2j * np.pi * way[..., None] * frequencies / 299_792_458) / way[..., None] for way in ways)


@pytest.fixture(scope="module")
def csi(tmp_path_factory) -> bisplat.Dataset:
    generator = np.random.default_rng(0)
    places = generator.uniform((2, -1.5, 1), (5, 1.5, 1.5), (160, 3))
    folder = tmp_path_factory.mktemp("csi") / "links"
    antennas = np.array([[0, 0.06 * number, 2] for number in range(8)])
    write_links(folder, channels_at(places, np.array([[4.0, 4, 1], [7, -1, 2]]), antennas))
    write_positions(folder / "tx_pos.csv", places)
    return bisplat.read_dataset(folder)


@pytest.fixture(scope="module")
def places(csi):
    return locate_channels(csi, csi.uplink[TEST], known=KNOWN)


def test_errors_are_smaller_than_those_of_similar_rows(csi, places):
    rows = error_rows(places, csi.positions[TEST], by_channels(csi, KNOWN, csi.uplink[TEST], 0), csi.positions[KNOWN])
    found = {row["method"]: row["median, m"] for row in rows}
    assert found["locate"] < 0.8 * min(each for name, each in found.items() if name != "locate")
    assert rows[0]["within 90 % region"] >= 0.75


def test_fingerprint_is_largest_in_the_direction_of_a_wave():
    """Of the wave e^{jk u·a} from the direction u; 4 × 4 antennas in the x–y plane tell u but for the side."""
    places = 0.06 * np.stack([*np.meshgrid(np.arange(4), np.arange(4)), np.zeros((4, 4))], axis=-1).reshape(-1, 3)
    directions = _over_a_sphere(min(DIRECTIONS * 16, MOST_DIRECTIONS))
    for towards in directions[::11]:
        wave = np.exp(2j * np.pi / WAVELENGTH * places @ towards)[None, :, None] * np.ones(26)
        powers = ChannelFingerprints(places, WAVELENGTH, wave).of(wave).powers[0].reshape(len(directions), -1)
        found = directions[powers.max(axis=1).argmax()]
        np.testing.assert_allclose(found[:2], towards[:2], atol=0.2)


def test_level_phase_and_timing_do_not_count(csi, places):
    generator = np.random.default_rng(1)
    level, phase = generator.uniform(0.1, 10, (40, 1, 1)), generator.uniform(0, 2 * np.pi, (40, 1, 1))
    late = generator.uniform(-3, 3, (40, 1, 1)) / 26 * np.arange(26)
    other = locate_channels(csi, csi.uplink[TEST] * level * np.exp(1j * (phase - 2 * np.pi * late)), known=KNOWN)
    for one, same in zip(places, other, strict=True):
        np.testing.assert_allclose(one[0].position, same[0].position, atol=0.05)


def test_known_row_is_found_at_its_place_and_zeros_nowhere(csi):
    found = locate_channels(csi, np.stack([csi.uplink[3], 0 * csi.uplink[3]]))
    assert np.linalg.norm(found[0][0].position - csi.positions[3]) < 0.3
    assert found[0][0].misfit == pytest.approx(0, abs=1e-6) and found[1] == []


def test_positions_at_one_height_stay_there(csi, tmp_path):
    places = csi.positions[:40].copy()
    places[:, 2] = 1.2
    write_links(tmp_path / "flat", np.concatenate([csi.uplink, csi.downlink], axis=2)[:40])
    write_positions(tmp_path / "flat" / "tx_pos.csv", places)
    [found] = locate_channels(tmp_path / "flat", csi.uplink[50:51])[0]
    assert found.position[2] == pytest.approx(1.2, abs=1e-6) and found.covariance[2, 2] < 1e-5
    assert np.linalg.eigvalsh(found.covariance).min() > 0


def test_folders_without_positions_or_with_few_rows_are_refused(csi, tmp_path):
    write_links(tmp_path / "unplaced", np.ones((12, 8, 52), complex))
    with pytest.raises(InputError, match=r"tx_pos\.csv"):
        locate_channels(tmp_path / "unplaced", csi.uplink[:1])
    with pytest.raises(InputError, match="expected at least 10 known rows, found 9"):
        locate_channels(csi, csi.uplink[:1], known=np.arange(9))
    write_positions(tmp_path / "unplaced" / "tx_pos.csv", np.ones((12, 3)))
    with pytest.raises(InputError, match="expected at least two different positions"):
        locate_channels(tmp_path / "unplaced", csi.uplink[:1])


def test_command(csi, bisplat_command):
    _, out, err = bisplat_command("locate", csi.folder, "--split", "blocked", "-o", "where.csv")
    assert "40 transmitters" in out and "fingerprint" in out and "2400 MHz is assumed" in err
    with open("where.csv") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["name"]) for row in rows] == [row for row in range(160) if row // 10 % 4 == 1]
