"""The mistakes that people make on import: each is told by the data and mended, warned of, or refused in a sentence."""

import numpy as np
import pytest

import bisplat
from scenes.checks.occupancy import element_positions
from scenes.files.errors import InputError
from simulate.exchange.reading_options import Recording
from simulate.exchange.recorded_responses import record
from tests.simulate.exchange.test_recorded_dataset import GATEWAY, PLACES, RIGHT, WAVELENGTH, recorded, same

MAGNITUDE, PHASE = np.abs(RIGHT), np.angle(RIGHT)


def table(path, header: str, *columns: np.ndarray) -> None:
    np.savetxt(path, np.column_stack(columns), "%.9g", ",", header=header, comments="")


@pytest.mark.parametrize(
    ("arrays", "sentence"),
    [
        ({"pos": PLACES, "H": RIGHT.T}, "transposed H, which has 15 rows"),
        ({"pos": PLACES, "mag": MAGNITUDE, "phase": np.degrees(PHASE)}, "took phase for degrees, since some are above"),
        (
            {"pos": PLACES, "mag": MAGNITUDE, "phase_deg": np.degrees(PHASE)},
            "took phase_deg for degrees, as its name says",
        ),
        (
            {"pos": PLACES, "mag": MAGNITUDE, "phase_rad": PHASE + 8 * np.pi},
            "responses: mag and phase_rad",
        ),  # unwrapped
        ({"pos": PLACES, "H": RIGHT.conj()}, "phases that rise with the distance"),
        ({"pos": PLACES, "mag": 20 * np.log10(MAGNITUDE), "phase": PHASE}, "took mag for decibels, since some are neg"),
        (
            {"pos": PLACES, "gain_db": 20 * np.log10(MAGNITUDE), "phase": PHASE},
            "took gain_db for decibels, as its name says",
        ),
        (
            {"pos": PLACES, "mag": MAGNITUDE, "phase": PHASE, "angle": np.ones(40)},
            "took phase and left out angle",  # the log of a reader has the angle of its arm, too
        ),
    ],
)
def test_what_the_data_tell_is_mended_and_said(tmp_path, arrays, sentence):
    made, said = recorded(tmp_path, **arrays)
    assert sentence in said and "warning" not in said
    assert same(made)


def test_positive_decibels_by_name(tmp_path):
    louder, said = recorded(tmp_path, pos=PLACES, power_db=20 * np.log10(MAGNITUDE) + 60, phase=PHASE)
    assert "took power_db for decibels, as its name says" in said
    np.testing.assert_allclose(louder.responses, 1000 * RIGHT, rtol=1e-4)


@pytest.mark.parametrize(
    ("recording", "arrays", "sentence"),
    [
        (
            Recording(),
            {"pos": PLACES[:15], "H": RIGHT[:15]},
            "warning: H is square, so its shape does not tell its axes",
        ),
        (Recording(), {"pos": 100 * PLACES, "H": RIGHT}, "m from the array (median): are they in metres? State --unit"),
        (
            Recording(unit="mm"),
            {"pos": PLACES / 5, "H": RIGHT},
            "mm only, at a wavelength of 125 mm: is their unit right",
        ),
    ],
)
def test_what_they_only_hint_at_is_a_warning(tmp_path, recording, arrays, sentence):
    _, said = recorded(tmp_path, recording, **arrays)
    assert sentence in said and "warning: " in said


def test_a_stated_unit_is_believed(tmp_path):
    _, said = recorded(tmp_path, Recording(unit="m"), pos=100 * PLACES, H=RIGHT)
    assert "are they in metres" not in said


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        (
            {"pos": PLACES[:30], "H": RIGHT},
            r"H: expected responses of 30 positions × 15 elements, found shape \(40, 15\)",
        ),
        (
            {"pos": 1000 * PLACES, "H": RIGHT},
            "pos: expected positions in metres, found a spread of .*; state --unit mm",
        ),
        (
            {"pos": PLACES * 0 + 1, "H": RIGHT},
            r"expected positions that differ, found \[1.0, 1.0, 1.0\] in all 40 rows",
        ),
        ({"pos": PLACES, "H": MAGNITUDE}, "there are neither complex numbers nor phases, and powers alone"),
    ],
)
def test_what_cannot_be_right_is_refused(tmp_path, arrays, message):
    with pytest.raises(InputError, match=message):
        recorded(tmp_path, **arrays)


def test_rows_of_other_positions_do_not_tell_the_order(tmp_path):
    """All strongest directions are one, near those of all transmitters, whichever row they are of."""
    places = np.column_stack([np.full(40, 4.0), 3.0 + PLACES[:, 1] / 1.5, 0.7 + np.zeros(40)])
    towards = np.array([3.5, 3.0, -0.8]) / np.linalg.norm([3.5, 3.0, -0.8])
    elements = element_positions(GATEWAY, WAVELENGTH) - np.array(GATEWAY.position)
    one = np.exp(2j * np.pi * elements @ towards / WAVELENGTH)
    _, said = recorded(tmp_path, pos=places, H=np.tile(one, (40, 1)))
    assert "The strongest directions do not tell whether that is right" in said


def test_fingerprints_without_phases(tmp_path):
    """Such as the columns of UJIIndoorLoc or of the BLE data of a library."""
    powers = 20 * np.log10(MAGNITUDE[:, :12])
    table(tmp_path / "wifi.csv", ",".join([*(f"WAP{n:03}" for n in range(12)), "LONGITUDE"]), powers, PLACES[:, :1])
    found = r"found 13 columns of 40 numbers \(WAP000, .*, WAP007, …\); .* bisplat.write_rssi makes a folder of them"
    with pytest.raises(InputError, match=f"expected positions, an array of K × 3 real numbers .*, {found}"):
        record([tmp_path / "wifi.csv"], tmp_path / "out", GATEWAY, "2.4 GHz")


@pytest.mark.parametrize("names", [("real_g{:02}", "imag_g{:02}"), ("Re(h{})", "Im(h{})"), ("h{}_re", "h{}_im")])
def test_complex_columns_by_either_order_of_their_names(tmp_path, names):
    header = ",".join(["x [cm]", "y [cm]", *(name.format(n) for n in range(15) for name in names)])
    parts = np.stack([RIGHT.real, RIGHT.imag], axis=-1).reshape(40, 30)
    table(tmp_path / "log.csv", header, 100 * PLACES[:, :2], parts)
    said = "\n".join(record([tmp_path / "log.csv"], tmp_path / "out", GATEWAY, "2.4 GHz"))
    assert "took the height 0 for all positions, since there are only x and y (x [cm], y [cm])" in said
    assert "40 in cm" in said
    made = bisplat.read_dataset(tmp_path / "out")
    np.testing.assert_allclose(np.abs(made.responses), MAGNITUDE, rtol=1e-4)


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


def test_element_positions_in_a_text_file(tmp_path):
    from bisplat.commands.scene_changes import array_option

    (tmp_path / "layout.txt").write_text("0 1\n2 3\n")
    with pytest.raises(
        InputError, match=r"expected a file of element positions whose name ends in \.csv, with the head"
    ):
        array_option(str(tmp_path / "layout.txt"))


def test_element_positions_of_another_unit(tmp_path):
    from bisplat.commands.scene_changes import array_option

    (tmp_path / "layout.csv").write_text("x [mm],y [mm],z [mm]\n0,0,0\n80,0,0\n")
    with pytest.raises(InputError, match=r"the header x,y,z, of numbers in metres, found 'x \[mm\],y"):
        array_option(str(tmp_path / "layout.csv"))
    (tmp_path / "layout.csv").write_text("x,y,z\n0,0,0\n160,0,0\n")
    with pytest.raises(InputError, match=r"found element 1 at \[160.0, 0.0, 0.0\]; are they in metres\?"):
        array_option(str(tmp_path / "layout.csv"))
