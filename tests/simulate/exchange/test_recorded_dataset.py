"""Datasets from the files of a recording: what is recognised, what is asked for, what is refused."""

from pathlib import Path

import numpy as np
import pytest
import scipy.io

import bisplat
from scenes.checks.occupancy import element_positions
from scenes.files.errors import InputError
from scenes.scene.antennas import Gateway
from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.orientation import facing
from simulate.dataset.bearings import bearing_of
from simulate.exchange.hdf5_export import export_hdf5
from simulate.exchange.reading_options import Recording
from simulate.exchange.recorded_responses import record

GATEWAY = Gateway((0.5, 0.0, 1.5), facing((1, 0, 0)), rows=3, columns=5, spacing=0.5)
WAVELENGTH = SPEED_OF_LIGHT / 2.4e9
PLACES = np.random.default_rng(0).uniform([1.5, -4, -1], [4, 4, 4], (40, 3)).round(3)


def in_free_space(gateway: Gateway = GATEWAY) -> np.ndarray:
    """Responses to transmitters in sight of the array."""
    distance = np.linalg.norm(PLACES[:, None] - element_positions(gateway, WAVELENGTH), axis=-1)
    return np.exp(-2j * np.pi * distance / WAVELENGTH) / distance


RIGHT = in_free_space()
COLUMNS_FIRST = RIGHT.reshape(-1, 3, 5).swapaxes(1, 2).reshape(-1, 15)


TRACK = Gateway((0.5, 0.0, 1.5), facing((1, 0, 0)), rows=1, columns=15, spacing=0.1)
"""An antenna that moves along a track in small steps."""


def recorded(
    folder: Path, recording: Recording = Recording(), gateway: Gateway = GATEWAY, **arrays: np.ndarray
) -> tuple[bisplat.Dataset, str]:
    out = folder / f"out{len(list(folder.iterdir()))}"
    np.savez(folder / "log.npz", **arrays)
    said = record([folder / "log.npz"], out, gateway, "2.4 GHz", recording)
    return bisplat.read_dataset(out), "\n".join(said)


def same(made: bisplat.Dataset) -> bool:
    close = np.allclose(made.responses, RIGHT, rtol=1e-5)
    return close and np.allclose(made.positions, PLACES, atol=1e-6) and made.frequency.hertz == 2.4e9


@pytest.mark.parametrize(
    ("arrays", "sentence"),
    [
        ({"pos": PLACES, "H": RIGHT}, "positions: pos, 40 in m (assumed; or state --unit)\nresponses: H, 40 × 15"),
        ({"where": PLACES.T, "what": RIGHT.T}, "transposed where, which has 3 rows"),
        ({"xyz": PLACES, "csi": RIGHT.reshape(40, 3, 5)}, "took the axes of csi for positions, rows and columns"),
        ({"xyz": PLACES[None], "csi": RIGHT[..., None], "noise": np.ones((40, 15)) * 1j}, "responses: csi, 40 × 15"),
        ({"xyz": PLACES, "amplitude": np.abs(RIGHT), "phase": np.angle(RIGHT)}, "responses: amplitude and phase"),
        ({"xyz": PLACES, "amplitude": np.abs(RIGHT), "phase": np.degrees(np.angle(RIGHT))}, "took phase for degrees"),
        ({"xyz": PLACES, "rssi": 20 * np.log10(np.abs(RIGHT)), "phase": np.angle(RIGHT)}, "took rssi for decibels"),
        (
            {"pos": PLACES, "H": RIGHT.conj()},
            "and phases that rise with the distance: the strongest directions are then",
        ),
        ({"pos": PLACES, "H": COLUMNS_FIRST}, "took elements as numbered along y first, and phases that fall"),
        ({"pos": PLACES, "H": COLUMNS_FIRST.conj()}, "along y first, and phases that rise"),
    ],
)
def test_recognised_and_said(tmp_path, arrays, sentence):
    made, said = recorded(tmp_path, **arrays)
    assert sentence in said and "warning" not in said
    assert same(made)


@pytest.mark.parametrize(
    ("recording", "arrays"),
    [
        (Recording(unit="mm"), {"pos": 1000 * PLACES, "H": RIGHT}),
        (Recording(positions="b", responses="d"), {"a": PLACES + 1, "b": PLACES, "c": 2 * RIGHT, "d": RIGHT}),
        (Recording(columns_first=True), {"pos": PLACES, "H": COLUMNS_FIRST}),
        (Recording(columns_first=False, conjugate=True), {"pos": PLACES, "H": RIGHT.conj()}),
    ],
)
def test_stated(tmp_path, recording, arrays):
    made, _ = recorded(tmp_path, recording, **arrays)
    assert same(made)


def test_what_sight_does_not_tell_is_asked_for(tmp_path):
    noise = np.random.default_rng(1).normal(size=(2, 40, 15))
    made, said = recorded(tmp_path, pos=PLACES, H=noise[0] + 1j * noise[1])
    assert "warning: took elements as numbered along x first, and phases that fall with the distance" in said
    np.testing.assert_allclose(made.responses, noise[0] + 1j * noise[1], rtol=1e-5)


def test_files_together_with_units_in_the_names_of_columns(tmp_path):
    np.savetxt(tmp_path / "places.csv", 100 * PLACES, delimiter=",", header="X [cm],Y [cm],Z [cm]", comments="")
    scipy.io.savemat(tmp_path / "usrp.mat", {"iq": RIGHT.T})
    said = record([tmp_path / "places.csv", tmp_path / "usrp.mat"], tmp_path / "out", GATEWAY, "2.4 GHz")
    assert "positions: X [cm], Y [cm], Z [cm], 40 in cm" in said
    assert same(bisplat.read_dataset(tmp_path / "out"))


def test_phases_of_their_own(tmp_path):
    made, _ = recorded(tmp_path, Recording(phases="per-position"), pos=PLACES, H=RIGHT)
    assert made.responses is None and made.retrieved is not None


@pytest.mark.parametrize(
    ("recording", "arrays", "message"),
    [
        (Recording(), {"pos": PLACES}, r"expected responses, an array of 40 positions × 15 complex numbers, found pos"),
        (
            Recording(),
            {"H": RIGHT},
            r"expected positions, an array of K × 3 real numbers or columns x, y, z, found H 40",
        ),
        (Recording(), {"a": PLACES, "b": PLACES, "H": RIGHT}, "or --positions NAME, found a, b"),
        (Recording(), {"pos": PLACES, "e": RIGHT, "f": RIGHT}, "or --responses NAME, found e, f"),
        (Recording(positions="q"), {"pos": PLACES, "H": RIGHT}, "expected an array 'q', found pos 40 × 3, H 40 × 15"),
        (Recording(), {"pos": PLACES[:30], "H": RIGHT}, r"H: expected responses of 30 positions × 15 elements, found"),
        (
            Recording(),
            {"pos": PLACES, "H": RIGHT[:, :4]},
            r"H: expected responses of 40 positions × 15 elements, found",
        ),
        (Recording(), {"pos": 1000 * PLACES, "H": RIGHT}, "found a spread of 7,.*; state --unit mm or cm"),
        (Recording(responses="H"), {"pos": PLACES, "H": np.abs(RIGHT)}, "expected complex responses, found real"),
    ],
)
def test_what_is_not_told_is_a_sentence(tmp_path, recording, arrays, message):
    with pytest.raises(InputError, match=message):
        recorded(tmp_path, recording, **arrays)
    assert not (tmp_path / "out").exists()


def test_tag_that_the_same_antenna_reads(tmp_path):
    """The root is known up to a sign at each position."""
    field = in_free_space(TRACK)
    made, said = recorded(tmp_path, Recording(round_trip=True), TRACK, pos=PLACES, H=field**2)
    signs = np.sign((made.retrieved / field).real)
    assert "took the roots of the responses" in said and "the sign of the root may be wrong" not in said
    assert made.responses is None and made.metadata["phases"] == "per-position"
    assert (signs == signs[:, :1]).all()
    np.testing.assert_allclose(made.retrieved, signs * field, rtol=1e-4)


def test_phase_that_jumps_is_warned_of(tmp_path):
    _, said = recorded(tmp_path, Recording(round_trip=True), pos=PLACES, H=RIGHT**2)
    assert "between two elements, so that the sign of the root may be wrong there" in said


def test_rows_of_the_frequency_are_kept(tmp_path):
    hertz = np.where(np.arange(40) % 2, 2.4e9, 2.45e9)
    made, said = recorded(tmp_path, pos=PLACES, H=RIGHT, frequency=hertz)
    assert "kept the rows of 2.4 GHz: 20 of 40 (frequency has 2.4 GHz, 2.45 GHz)" in said
    np.testing.assert_allclose(made.responses, RIGHT[1::2], rtol=1e-5)
    with pytest.raises(InputError, match=r"frequency: expected rows of 2\.4 GHz, found those of 2\.45 GHz"):
        recorded(tmp_path, pos=PLACES, H=RIGHT, frequency=np.full(40, 2.45e9))


def test_rows_that_lack_a_response_are_left_out(tmp_path):
    broken = RIGHT.copy()
    broken[[3, 7], 2] = np.nan
    made, said = recorded(tmp_path, pos=PLACES, H=broken)
    assert "left out 2 of 40 rows, which lack a finite response at some element" in said and len(made) == 38
    lost = PLACES.copy()
    lost[[2, 3], 1] = np.nan
    made, said = recorded(tmp_path, pos=lost, H=broken)
    assert "left out 2 of 40 rows, which lack a finite position" in said and len(made) == 37
    with pytest.raises(InputError, match="and a finite response at every element, found none among 40"):
        recorded(tmp_path, pos=PLACES, H=np.full((40, 15), np.nan + 0j))


def test_positions_in_a_plane(tmp_path):
    made, said = recorded(tmp_path, position=PLACES[:, :2], H=RIGHT)
    assert "took the height 0 for all positions, since there are only x and y (position)" in said
    np.testing.assert_allclose(made.positions, np.column_stack([PLACES[:, :2], np.zeros(40)]))


BAND = RIGHT[..., None] * np.exp(-2j * np.pi * np.linspace(0, 0.4, 8))
"""Responses at eight subcarriers; number 4 is the carrier."""


@pytest.mark.parametrize(
    ("axes", "sentence"),
    [((0, 1, 2), "responses: H, 40 × 15 × 8 subcarriers"), ((2, 0, 1), "of H for subcarriers, positions, elements")],
)
def test_responses_over_a_band(tmp_path, axes, sentence):
    made, said = recorded(tmp_path, Recording(bandwidth="20 MHz"), pos=PLACES, H=BAND.conj().transpose(axes))
    assert sentence in said and "phases that rise" in said
    np.testing.assert_allclose(made.band_responses, BAND, rtol=1e-5)
    assert made.band == bisplat.Band(20e6, 8)


def test_responses_over_a_band_with_the_columns_first(tmp_path):
    other = BAND.reshape(-1, 3, 5, 8).swapaxes(1, 2).reshape(-1, 15, 8)
    made, said = recorded(tmp_path, Recording(bandwidth="20 MHz"), pos=PLACES, H=other)
    assert "along y first" in said
    np.testing.assert_allclose(made.band_responses, BAND, rtol=1e-5)


def test_band_whose_width_is_not_stated_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"× 15 elements, found shape .*; --bandwidth says that one axis"):
        recorded(tmp_path, pos=PLACES, H=BAND)
    with pytest.raises(InputError, match="expected responses of 40 positions × 15 elements × subcarriers, complex"):
        recorded(tmp_path, Recording(bandwidth="20 MHz", responses="H"), pos=PLACES, H=RIGHT)


def test_array_that_moves_past_a_transmitter(tmp_path):
    """The same pairs of places as those of a transmitter that moves, seen from the other end."""
    turned = 2 * np.array(GATEWAY.position) - PLACES
    made, said = recorded(tmp_path, Recording(moving="receiver"), pos=turned, H=RIGHT.conj())
    assert made.moving == "receiver" and "and phases that rise with the distance: the strongest directions are" in said
    np.testing.assert_allclose(made.responses, RIGHT, rtol=1e-5)


APART = np.random.default_rng(3).uniform(-9, 9, (40, 3)).round(3)
"""Where the array of each pair of places is, relative to the gateway's place."""


@pytest.mark.parametrize(
    ("arrays", "recording", "sentence"),
    [
        ({"tx_pos": PLACES + APART, "rx_pos": APART + GATEWAY.position}, {}, "receivers: rx_pos, 40 in m (assumed"),
        ({"there": PLACES + APART, "here": APART + GATEWAY.position}, {"receivers": "here"}, "positions: there, 40"),
        ({"here": PLACES + APART, "rx": APART + GATEWAY.position}, {"positions": "here"}, "receivers: rx, 40 in m"),
        (
            {"tx_pos": 1e3 * (PLACES + APART), "rx_pos": 1e3 * (APART + GATEWAY.position)},
            {"unit": "mm"},
            "receivers: rx_pos, 40 in mm\n",
        ),
        (
            {f"tx_{axis}": (PLACES + APART)[:, n] for n, axis in enumerate("xyz")}
            | {f"rx_{axis}": (APART + GATEWAY.position)[:, n] for n, axis in enumerate("xyz")},
            {},
            "receivers: rx_x, rx_y, rx_z, 40 in m",
        ),
    ],
)
def test_both_ends_move(arrays, recording, sentence, tmp_path):
    """The same directions and distances as those of a transmitter that moves before a fixed array."""
    made, said = recorded(tmp_path, Recording(moving="both", **recording), H=RIGHT.conj(), **arrays)
    assert made.moving == "both" and sentence in said and "and phases that rise with the distance: the" in said
    np.testing.assert_allclose(made.responses, RIGHT, rtol=1e-5)
    np.testing.assert_allclose(made.transmitters - made.receivers, PLACES - GATEWAY.position, atol=1e-5)
    assert bearing_of(made).error < 5


@pytest.mark.parametrize(
    ("arrays", "recording", "message"),
    [
        ({"rx_pos": APART}, {}, "receivers: expected none unless both ends move, found some beside moving transmitter"),
        ({}, {}, "expected an array of the receivers' positions, or --receivers NAME, beside --moving both, found pos"),
        ({"rx_pos": APART[:-1]}, {}, "rx_pos: expected a row for each of the 40 positions, found 39"),
        ({"rx_pos": 1e3 * APART}, {}, "rx_pos: expected positions in metres, found a spread of"),
        ({}, {"receivers": "rx"}, "expected an array 'rx', found pos 40 × 3, H 40 × 15"),
        ({"rx_x": APART[:, 0]}, {}, "expected positions, an array of K × 3 real numbers"),
    ],
)
def test_receivers_that_do_not_fit_are_refused(arrays, recording, message, tmp_path):
    moving = "transmitter" if message.startswith("receivers") else "both"
    stated = {"receivers": "rx_pos", **recording} if moving == "transmitter" else recording
    with pytest.raises(InputError) as refused:
        recorded(tmp_path, Recording(moving=moving, **stated), pos=PLACES, H=RIGHT, **arrays)
    assert str(refused.value).startswith(message)


def test_exported_pairs_are_a_recording(tmp_path):
    made, _ = recorded(tmp_path, Recording(moving="both"), tx=PLACES + APART, rx=APART + GATEWAY.position, H=RIGHT)
    export_hdf5(made, tmp_path / "pairs.h5")
    record([tmp_path / "pairs.h5"], tmp_path / "again", GATEWAY, "2.4 GHz", Recording(moving="both", conjugate=False))
    again = bisplat.read_dataset(tmp_path / "again")
    np.testing.assert_array_equal(again.receivers, made.receivers)
    np.testing.assert_array_equal(again.responses, made.responses)
