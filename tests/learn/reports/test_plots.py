"""Spectra and distributions on an axis: where things are drawn, on a given axis and on a new one."""

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.figure import Figure

from learn.reports import figures
from learn.reports.figures import draw_reliability
from learn.reports.plots import plot_spectrum
from scenes.files.errors import InputError
from simulate.spectra.angular_grid import AngularGrid

AZIMUTH, ELEVATION = 250, 40


@pytest.fixture
def spectrum():
    """Bright at one direction, and half as bright at azimuth 0°."""
    values = np.zeros((90, 360))
    values[ELEVATION, AZIMUTH], values[ELEVATION, 0] = 1, 0.5
    return values


@pytest.fixture(autouse=True)
def no_figure_is_left():
    yield
    pyplot.close("all")


def colours_at(ax, *points) -> list[float]:
    """Values that are drawn at points of an axis, in its own units."""
    image = ax.images[0]
    (left, right, bottom, top), values = image.get_extent(), image.get_array()
    rows, columns = values.shape
    return [
        float(values[int((y - bottom) / (top - bottom) * rows), int((x - left) / (right - left) * columns)])
        for x, y in points
    ]


def test_spectrum_is_at_its_angles_and_azimuth_0_at_both_ends(spectrum):
    ax = plot_spectrum(spectrum, Figure().subplots())
    found = colours_at(ax, (AZIMUTH, ELEVATION), (0, ELEVATION), (360, ELEVATION), (AZIMUTH + 1, ELEVATION))
    assert found == [1, 0.5, 0.5, 0]
    assert ax.get_xlim() == (0, 360) and ax.get_ylim() == (-0.5, 89.5)


def test_spectrum_of_part_of_the_turn_is_not_closed(spectrum):
    grid = AngularGrid(elevation_first_deg=10, elevation_step_deg=0.5, azimuth_step_deg=0.5)
    ax = plot_spectrum(spectrum, Figure().subplots(), grid)
    assert colours_at(ax, (AZIMUTH / 2, 10 + ELEVATION / 2), (0, 10 + ELEVATION / 2)) == [1, 0.5]
    assert ax.get_xlim() == (0, 180) and ax.images[0].get_array().shape == (90, 360)


def test_polar_spectrum_has_boresight_in_the_centre(spectrum):
    ax = plot_spectrum(spectrum, Figure().add_subplot(projection="polar"))
    mesh = ax.collections[0]
    corners = mesh.get_coordinates()[ELEVATION : ELEVATION + 2, AZIMUTH : AZIMUTH + 2].reshape(-1, 2)
    np.testing.assert_allclose(np.degrees(corners[:, 0].mean()), AZIMUTH)
    np.testing.assert_allclose(corners[:, 1].mean(), 90 - ELEVATION)
    assert mesh.get_array().reshape(90, 360)[ELEVATION, AZIMUTH] == 1
    assert ax.get_ylim() == (0, 90)


@pytest.mark.parametrize("projection", [None, "polar"])
def test_a_given_axis_is_returned_and_alone_and_a_new_one_has_a_colour_bar(projection, spectrum):
    ax = Figure().add_subplot(projection=projection)
    assert plot_spectrum(spectrum, ax) is ax and ax.figure.axes == [ax]
    assert not pyplot.get_fignums()
    new = plot_spectrum(spectrum)
    assert [each.get_ylabel() for each in new.figure.axes if each is not new] == ["normalised magnitude"]
    new = plot_spectrum(spectrum - 0.5, difference=True)
    assert [each.get_ylabel() for each in new.figure.axes if each is not new] == ["difference"]


def test_what_is_no_spectrum_is_refused(spectrum):
    for wrong, words in (
        (spectrum.astype(np.uint8), "expected numbers from 0 to 1"),
        (spectrum[None], "expected one spectrum of 90 x 360"),
        (spectrum.T, "expected spectra of 90 x 360"),
    ):
        with pytest.raises(InputError, match=f"spectrum: {words}"):
            plot_spectrum(wrong)


def test_spectra_without_a_stated_deviation_are_no_misses(tmp_path, monkeypatch):
    curves = []
    monkeypatch.setattr(figures, "save", lambda figure, *_: curves.append(figure.axes[0].lines[1].get_ydata()))
    errors = np.abs(np.random.default_rng(0).normal(size=(50, 20)))
    for given in (errors, np.vstack([errors, np.full((50, 20), np.nan)])):
        draw_reliability(given, tmp_path / "reliability.png")
    np.testing.assert_array_equal(*curves)
    np.testing.assert_allclose(curves[0], np.linspace(0.01, 0.99, 99), atol=0.03)  # normal errors, rightly stated
