"""Datasets from the files of a recording: what is recognised, what is asked for, what is refused."""

from pathlib import Path

import numpy as np
import pytest
import scipy.io

import bisplat
from bisplat.commands.scene_changes import array_option
from scenes.checks.occupancy import element_positions
from scenes.files.errors import InputError
from scenes.scene.antennas import Gateway
from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.orientation import facing
from simulate.dataset.bearings import bearing_of
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
MAGNITUDE, PHASE = np.abs(RIGHT), np.angle(RIGHT)
COLUMNS_FIRST = RIGHT.reshape(-1, 3, 5).swapaxes(1, 2).reshape(-1, 15)

BAND = RIGHT[..., None] * np.exp(-2j * np.pi * np.linspace(0, 0.4, 8))
"""Responses at eight subcarriers; number 4 is the carrier."""

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
        ({"xyz": PLACES, "amplitude": MAGNITUDE, "phase": PHASE}, "responses: amplitude and phase"),
        ({"xyz": PLACES, "mag": MAGNITUDE, "phase_deg": np.degrees(PHASE)}, "took phase_deg for degrees"),
        # unwrapped
        ({"xyz": PLACES, "mag": MAGNITUDE, "phase_rad": PHASE + 8 * np.pi}, "responses: mag and phase_rad"),
        ({"xyz": PLACES, "rssi": 20 * np.log10(MAGNITUDE), "phase": PHASE}, "took rssi for decibels"),
        # The log of a reader has the angle of its arm, too.
        ({"xyz": PLACES, "mag": MAGNITUDE, "phase": PHASE, "angle": np.ones(40)}, "took phase and left out angle"),
        ({"pos": PLACES, "H": RIGHT.conj()}, "phases that rise with the distance"),
        ({"pos": PLACES, "H": COLUMNS_FIRST}, "along y first, and phases that fall"),
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


@pytest.mark.parametrize(
    ("recording", "arrays", "message"),
    [
        (Recording(), {"pos": PLACES}, "expected responses, .* found pos"),
        (Recording(), {"H": RIGHT}, "expected positions, .* found H 40"),
        (Recording(), {"a": PLACES, "b": PLACES, "H": RIGHT}, "or --positions NAME, found a, b"),
        (Recording(), {"pos": PLACES, "e": RIGHT, "f": RIGHT}, "or --responses NAME, found e, f"),
        (Recording(positions="q"), {"pos": PLACES, "H": RIGHT}, "'q', found pos 40 × 3, H 40 × 15"),
        (Recording(), {"pos": PLACES, "H": RIGHT[:, :4]}, "H: expected responses of 40 positions × 15 elements, found"),
        (Recording(), {"pos": 1000 * PLACES, "H": RIGHT}, "found a spread of 7,.*; state --unit mm or cm"),
        (Recording(responses="H"), {"pos": PLACES, "H": MAGNITUDE}, "expected complex responses, found real"),
        (Recording(), {"pos": PLACES, "H": MAGNITUDE}, "powers alone"),
        (Recording(), {"pos": PLACES * 0 + 1, "H": RIGHT}, r"expected positions that differ, found \[1.0, 1.0, 1.0\]"),
        (Recording(), {"pos": PLACES, "H": BAND}, "--bandwidth"),
        (Recording(bandwidth="20 MHz", responses="H"), {"pos": PLACES, "H": RIGHT}, "15 elements × subcarriers"),
        (Recording(), {"pos": PLACES, "mag": MAGNITUDE, "phase": np.degrees(PHASE)}, "name it phase_deg or phase_rad"),
        (Recording(), {"pos": PLACES, "mag": 20 * np.log10(MAGNITUDE), "phase": PHASE}, "decibels, name it mag_db"),
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
    assert "response" not in made.values and made.metadata["phases"] == "per-position"
    assert (signs == signs[:, :1]).all()
    np.testing.assert_allclose(made.retrieved, signs * field, rtol=1e-4)


def test_rows_of_the_frequency_are_kept(tmp_path):
    hertz = np.where(np.arange(40) % 2, 2.4e9, 2.45e9)
    made, said = recorded(tmp_path, pos=PLACES, H=RIGHT, frequency=hertz)
    assert "kept the rows of 2.4 GHz: 20 of 40" in said
    np.testing.assert_allclose(made.responses, RIGHT[1::2], rtol=1e-5)
    with pytest.raises(InputError, match=r"frequency: .* found those of 2\.45 GHz"):
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


@pytest.mark.parametrize(
    ("axes", "sentence"),
    [((0, 1, 2), "responses: H, 40 × 15 × 8 subcarriers"), ((2, 0, 1), "of H for subcarriers, positions, elements")],
)
def test_responses_over_a_band(tmp_path, axes, sentence):
    made, said = recorded(tmp_path, Recording(bandwidth="20 MHz"), pos=PLACES, H=BAND.conj().transpose(axes))
    assert sentence in said and "phases that rise" in said
    np.testing.assert_allclose(made.band_responses, BAND, rtol=1e-5)
    assert made.band == bisplat.Band(20e6, 8)


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
        ({"rx_pos": APART}, Recording(receivers="rx_pos"), "receivers: expected none"),
        ({}, Recording(moving="both"), "receivers' positions, .* found pos"),
        ({"rx_pos": APART[:-1]}, Recording(moving="both"), "rx_pos: .* found 39"),
    ],
)
def test_receivers_that_do_not_fit_are_refused(arrays, recording, message, tmp_path):
    with pytest.raises(InputError, match=message):
        recorded(tmp_path, recording, pos=PLACES, H=RIGHT, **arrays)


def table(path, header: str, *columns: np.ndarray) -> None:
    np.savetxt(path, np.column_stack(columns), "%.9g", ",", header=header, comments="")


def test_square_responses_are_warned_of(tmp_path):
    assert "warning: H is square" in recorded(tmp_path, pos=PLACES[:15], H=RIGHT[:15])[1]


@pytest.mark.parametrize("names", [("real_g{:02}", "imag_g{:02}"), ("Re(h{})", "Im(h{})"), ("h{}_re", "h{}_im")])
def test_complex_columns_by_either_order_of_their_names(tmp_path, names):
    header = ",".join(["x [cm]", "y [cm]", *(name.format(n) for n in range(15) for name in names)])
    parts = np.stack([RIGHT.real, RIGHT.imag], axis=-1).reshape(40, 30)
    table(tmp_path / "log.csv", header, 100 * PLACES[:, :2], parts)
    said = "\n".join(record([tmp_path / "log.csv"], tmp_path / "out", GATEWAY, "2.4 GHz"))
    assert "took the height 0 for all positions" in said and "40 in cm" in said
    made = bisplat.read_dataset(tmp_path / "out")
    np.testing.assert_allclose(np.abs(made.responses), MAGNITUDE, rtol=1e-4)
    np.testing.assert_allclose(made.positions, np.column_stack([PLACES[:, :2], np.zeros(40)]), atol=1e-6)


@pytest.mark.parametrize(
    ("magnitudes", "phases", "said"),
    [
        ("mag{}", "phase{}", "responses: mag1 to mag15 and phase1 to phase15, 40 × 15"),
        ("rssi_{}_dbm", "phase_deg_{}", "took phase_deg for degrees, as its name says"),
        ("Amplitude [{}]", "angle({})", "responses: Amplitude [1] to Amplitude [15] and angle(1) to angle(15)"),
    ],
)
def test_a_magnitude_and_a_phase_column_for_each_element(tmp_path, magnitudes, phases, said):
    """The columns may be in any order: that of their numbers is that of the elements."""
    sizes = 20 * np.log10(MAGNITUDE) if "dbm" in magnitudes else MAGNITUDE
    angles = np.degrees(PHASE) if "deg" in phases else PHASE
    values = {f"{axis} [mm]": 1000 * PLACES[:, index] for index, axis in enumerate("xyz")}
    for n in np.random.default_rng(1).permutation(15):
        values |= {magnitudes.format(n + 1): sizes[:, n], phases.format(n + 1): angles[:, n]}
    table(tmp_path / "log.csv", ",".join(values), *values.values())
    told = record([tmp_path / "log.csv"], tmp_path / "out", GATEWAY, "2.4 GHz")
    assert any(said in each for each in told) and same(bisplat.read_dataset(tmp_path / "out"))


def test_blank_cells_of_a_table_are_missing_values(tmp_path):
    """As spreadsheets and pandas write them. Columns of other texts, and of nothing, are left out as ever."""
    parts = np.stack([RIGHT.real, RIGHT.imag], axis=-1).reshape(40, 30)
    rows = [[f"{each:.9g}" for each in row] for row in np.column_stack([PLACES, parts])]
    rows[2][1], rows[7][5:9] = "", [""] * 4
    header = ",".join(["x", "y", "z", *(f"h{n}_{part}" for n in range(15) for part in ("re", "im")), "note"])
    (tmp_path / "log.csv").write_text("\n".join([header, *(",".join([*row, ""]) for row in rows)]))
    said = "\n".join(record([tmp_path / "log.csv"], tmp_path / "out", GATEWAY, "2.4 GHz"))
    assert "left out 1 of 40 rows, which lack a finite position" in said
    assert "left out 1 of 40 rows, which lack a finite response at some element" in said
    kept = np.delete(np.arange(40), [2, 7])
    np.testing.assert_allclose(bisplat.read_dataset(tmp_path / "out").responses, RIGHT[kept], rtol=1e-4)


@pytest.mark.parametrize("header", ["x,y,z,h1_re,h1_im,x", "x [mm],y [cm],z [m],h1_re,h1_im,note"])
def test_columns_alike_and_of_several_units_are_refused(tmp_path, header):
    table(tmp_path / "log.csv", header, np.ones((2, 6)) * [[1], [2]])
    with pytest.raises(InputError, match=r"found 'x' twice|expected one unit for all columns"):
        record([tmp_path / "log.csv"], tmp_path / "out", GATEWAY, "2.4 GHz")


@pytest.mark.parametrize(
    ("name", "content", "found"),
    [
        ("layout.txt", "0 1\n2 3\n", r"a file of element positions whose name ends in \.csv"),
        ("layout.csv", "x [mm],y [mm],z [mm]\n0,0,0\n80,0,0\n", r"the header x,y,z, .* found 'x \[mm\]"),
        ("layout.csv", "x,y,z\n0,0,0\n160,0,0\n", r"found element 1 at \[160.0, 0.0, 0.0\]"),
    ],
)
def test_files_of_element_positions_that_are_none(tmp_path, name, content, found):
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=found):
        array_option(str(tmp_path / name))
