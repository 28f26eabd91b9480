"""Arrays of given element positions: against closed forms, and against the planar array at the same positions."""

import numpy as np
import pytest

from scenes.files.errors import InputError, ParameterError
from scenes.scene.antennas import Gateway
from scenes.scene.description import SPEED_OF_LIGHT
from simulate.dataset.bearings import turns_of
from simulate.spectra.angular_grid import AngularGrid, direction
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import ElementArray, array_of, uniform
from simulate.spectra.explanation import explain
from simulate.spectra.identification import identify, tells_little
from simulate.spectra.lags import fit_lags, lag_functions, lag_vectors
from simulate.spectra.phase_retrieval import retrieve_responses
from simulate.spectra.spectrum import normalise, picture
from tests.simulate.spectra.random_spectra import random_responses

FREQUENCY = 2.4e9
WAVELENGTH = SPEED_OF_LIGHT / FREQUENCY
PLANAR = PlanarArray(3, 4, 0.48)
SAME = ElementArray(PLANAR.positions * WAVELENGTH, FREQUENCY)  # The elements of ``PLANAR``, in metres

LINE = ElementArray(np.linspace(-0.1, 0.1, 5)[:, None] * [0.8, 0.5, 0.3], FREQUENCY)
CLOUD = ElementArray(np.random.default_rng(3).uniform(-0.06, 0.06, (12, 3)), FREQUENCY)


def test_the_manifold_of_a_circle_is_that_of_the_textbook():
    """[vantrees2002], chapter 4: e^{jk r cos θ cos(φ − 2πm/M)} with the elevation θ above the plane of the circle."""
    circle = ElementArray.circle(7, 0.11).at(FREQUENCY)
    phi, theta, m = np.radians(217.0), np.radians(38.0), np.arange(7)
    expected = np.exp(2j * np.pi * 0.11 / WAVELENGTH * np.cos(theta) * np.cos(phi - 2 * np.pi * m / 7))
    np.testing.assert_allclose(circle.manifold(phi, theta), expected, atol=1e-9)


def test_elements_at_the_places_of_a_planar_array_are_this_array():
    y = random_responses(3, 12)
    planar, same = Beamformer(PLANAR, AngularGrid(1.0)), Beamformer(SAME, AngularGrid(1.0))
    np.testing.assert_allclose(same.spectrum(y), planar.spectrum(y), atol=1e-9)
    np.testing.assert_allclose(lag_vectors(SAME), lag_vectors(PLANAR), atol=1e-9)
    spectra = normalise(planar.spectrum(y))
    found, expected = fit_lags(spectra, same), fit_lags(spectra, planar)
    np.testing.assert_allclose(found.lags, expected.lags, atol=1e-9)
    np.testing.assert_allclose(found.residual, expected.residual, atol=1e-9)
    assert [str(turn) for turn in turns_of(SAME)] == [str(turn) for turn in turns_of(PLANAR)]
    u, v = direction(np.radians([10.0, 200.0]), np.radians([20.0, 70.0]))
    assert SAME.angle_between(u, v) == PLANAR.angle_between(u, v)


@pytest.mark.parametrize("array", [ElementArray.circle(8, 0.05).at(FREQUENCY), CLOUD, LINE], ids=str)
def test_the_squared_spectrum_is_a_sum_of_the_lag_functions(array):
    generator = np.random.default_rng(1)
    azimuth, elevation = generator.uniform(0, 2 * np.pi, 900), generator.uniform(0, np.pi / 2, 900)
    functions = lag_functions(array, azimuth, elevation)
    power = np.abs(array.manifold(azimuth, elevation).conj() @ random_responses(1, array.elements)[0]) ** 2
    left = power - functions @ np.linalg.lstsq(functions, power, rcond=1e-12)[0]
    assert np.abs(left).max() < 1e-8 * power.max()


def test_lags_of_a_shape_without_regularity_and_of_a_circle():
    assert len(lag_vectors(CLOUD)) == 1 + 12 * 11 // 2
    assert len(lag_vectors(ElementArray.circle(8, 0.05).at(FREQUENCY))) == 1 + 8 * (8 - 2) // 4 + 4  # pairs repeat
    assert len(lag_vectors(LINE)) == 5


def test_pictures_are_explained_by_their_array_alone():
    grid, wide = AngularGrid(), ElementArray(3 * np.array(CLOUD.positions_m), FREQUENCY)
    pictures = picture(Beamformer(wide, grid).spectrum(random_responses(6, 12)))
    assert identify(pictures, wide, grid).residual < 0.4
    assert identify(pictures, wide).beamformer.grid == grid
    other = ElementArray(np.array(wide.positions_m)[:, [1, 0, 2]], FREQUENCY)
    assert identify(pictures, other, grid).residual > 1
    assert explain(pictures, wide, grid).scale == "magnitude"
    assert not tells_little(Beamformer(wide)) and tells_little(Beamformer(CLOUD))  # 12 elements within a wavelength


def test_a_line_tells_only_the_angle_to_it():
    assert LINE.is_line and "not on which side" in LINE.cannot_tell
    np.testing.assert_allclose(LINE.axis, np.array([0.8, 0.5, 0.3]) / np.linalg.norm([0.8, 0.5, 0.3]), atol=1e-12)
    u = direction(np.radians(50.0), np.radians(30.0))
    mirrored = 2 * (u @ LINE.axis) * LINE.axis - u  # turned by 180° about the line
    assert LINE.angle_between(u, mirrored) == pytest.approx(0, abs=1e-5)
    v = direction(np.radians(150.0), np.radians(70.0))
    expected = abs(np.degrees(np.arccos(u @ LINE.axis) - np.arccos(v @ LINE.axis)))
    assert LINE.angle_between(u, v) == pytest.approx(expected)


def test_a_plane_that_stands_up_does_not_tell_its_two_sides():
    standing = ElementArray([[0, 0, 0], [0.05, 0, 0], [0, 0, 0.05], [0.05, 0, 0.07]], FREQUENCY)
    assert np.abs(standing.mirror).round(9).tolist() == [0, 1, 0] and "two sides" in standing.cannot_tell
    left, right = direction(np.radians([40.0, -40.0]), np.radians([30.0, 30.0]))
    assert standing.angle_between(left, right) == pytest.approx(0, abs=1e-5)
    np.testing.assert_allclose(standing.manifold(*np.radians([40, 30])), standing.manifold(*np.radians([-40, 30])))
    assert CLOUD.mirror is None and SAME.mirror is None and CLOUD.cannot_tell is None and CLOUD.axis is None


@pytest.mark.parametrize(
    ("array", "count"),
    [
        (ElementArray.circle(8, 0.05).at(FREQUENCY), 16),
        (ElementArray.circle(7, 0.05).at(FREQUENCY), 14),
        (CLOUD, 1),
        (ElementArray([[0.3, 0, 0], [0.4, 0.05, 0]], FREQUENCY), 4),  # a line off the centre
    ],
    ids=str,
)
def test_turns_map_the_elements_onto_themselves(array, count):
    turns = turns_of(array)
    assert str(turns[0]) == "" and len(turns) == count
    azimuth, elevation = np.radians([12.0, 34.0]), np.radians([50.0, 20.0])
    places = array.positions - array.positions.mean(axis=0)
    for turn in turns:
        turned = np.radians(turn.by) + (-azimuth if turn.mirrored else azimuth)
        phases = (np.sort((direction(at, elevation) @ places.T).round(6), axis=1) for at in (azimuth, turned))
        np.testing.assert_allclose(*phases, atol=1e-5)


@pytest.mark.parametrize(
    ("positions", "message"),
    [
        ([[0, 0, 0], [0, 0, 1e-7]], "elements 0 and 1"),
        ([[0, 0, 0], [160, 0, 0]], "element 1"),
        ([[0, 0, np.nan]], "element 0"),
        (np.zeros((0, 3)), "found 0"),
        ([[0, 0]], "found shape"),
    ],
)
def test_positions_that_are_refused(positions, message):
    with pytest.raises(ParameterError, match=message):
        ElementArray(positions)


def test_without_a_frequency_there_are_no_wavelengths():
    array = ElementArray([[0, 0, 0], [0.1, 0, 0]])
    with pytest.raises(ParameterError, match=r"frequency .* array.at\(frequency\)"):
        Beamformer(array)
    assert array.at("2.4 GHz") == ElementArray(array.positions_m, FREQUENCY) and hash(array.at(FREQUENCY))


def test_the_array_of_a_gateway():
    gateway = Gateway((0, 0, 1), (0, 0, 0, 1), elements=SAME.positions_m)
    assert array_of(gateway, FREQUENCY) == SAME and gateway.count == 12
    assert array_of(Gateway((0, 0, 1), (0, 0, 0, 1), 3, 4, 0.48), FREQUENCY) == PLANAR
    with pytest.raises(ParameterError, match="rows, columns and spacing"):
        PlanarArray.of(gateway)
    with pytest.raises(ParameterError, match="found both"):
        Gateway((0, 0, 1), (0, 0, 0, 1), rows=3, elements=SAME.positions_m)


def test_a_uniform_planar_array_is_recognised_however_it_is_given():
    spectra = normalise(Beamformer(PLANAR).spectrum(random_responses(2, 12)))
    assert uniform(SAME) == PLANAR and uniform(CLOUD) is None and uniform(LINE) is None
    moved = ElementArray(np.add(SAME.positions_m, [0.3, 0, 0.1]), FREQUENCY)
    assert uniform(moved) == PLANAR and uniform(ElementArray(SAME.positions_m[::-1], FREQUENCY)) is None
    assert retrieve_responses(spectra, Beamformer(moved)).residual.max() < 0.5
    with pytest.raises(InputError, match="uniform planar array, found 12 elements"):
        retrieve_responses(np.zeros((1, 90, 360)), Beamformer(CLOUD))


def test_an_array_of_too_many_lags_is_not_fitted():
    many = ElementArray(np.random.default_rng(0).uniform(-0.5, 0.5, (70, 3)), FREQUENCY)
    with pytest.raises(ParameterError, match=r"70 elements .* 4831"):
        fit_lags(np.zeros((1, 90, 360)), Beamformer(many))
    assert identify(np.zeros((1, 90, 360), np.uint8), many, AngularGrid()).residual is None
