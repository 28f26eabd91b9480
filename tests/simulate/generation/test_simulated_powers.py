"""Simulated received powers against closed forms and against the responses of spectra."""

import dataclasses

import numpy as np
import pytest

import bisplat
from scenes.files.errors import InputError
from scenes.scene.description import SPEED_OF_LIGHT
from simulate.engines.rays_engine import Rays
from simulate.generation import simulated_powers
from simulate.generation.listening_gateways import read_gateways
from tests.folders import contents
from tests.small_scene import small_scene

SIGHT = bisplat.Propagation(max_depth=0)
ROOM = bisplat.Propagation(max_depth=1, diffraction=False, rays=5_000)
GATEWAYS = {"north": (0.0, 2.0, 1.5), "south": (0.5, -2.0, 2.0)}
PLACES = np.array([[2.0, 0.0, 1.2], [2.5, 0.3, 1.4], [2.9, -0.4, 1.1], [2.2, 0.5, 1.5]])


def test_free_space_is_that_of_friis(tmp_path):
    scene = small_scene()
    made = bisplat.simulate_rssi(
        scene, tmp_path / "x", GATEWAYS, positions=PLACES, propagation=SIGHT, tx_power_dbm=17, quantisation_db=0
    )
    friis = 17 + 20 * np.log10(scene.wavelength / (4 * np.pi * made.distances))
    np.testing.assert_allclose(made.powers, friis, atol=2e-4)
    assert made.frequency.wavelength == pytest.approx(SPEED_OF_LIGHT / 915e6)


def test_a_gateway_receives_what_one_element_of_simulate_does(tmp_path):
    turned = bisplat.Gateway((0, 2, 1.5), bisplat.facing((1, -1, 0.2)), pattern="tr38901")
    made = bisplat.simulate_rssi(
        small_scene(), tmp_path / "x", {"a": turned}, positions=PLACES, propagation=ROOM, quantisation_db=0, seed=3
    )
    alone = dataclasses.replace(small_scene(), gateway=dataclasses.replace(turned, rows=1, columns=1))
    spectra = bisplat.simulate(alone, tmp_path / "y", positions=PLACES, propagation=ROOM, seed=3)
    np.testing.assert_allclose(made.powers, 20 * np.log10(np.abs(spectra.responses)), atol=1e-3)
    np.testing.assert_array_equal(made.positions, spectra.positions)


def test_a_dipole_hears_nothing_along_its_axis(tmp_path):
    """The second is turned by −90° about z, so that its y axis, the dipole's, is along the line to the transmitter."""
    along = bisplat.Gateway((0, 0, 1.5), (0.5, 0.5, 0.5, 0.5), pattern="dipole")
    axis = np.array([[3.0, 0.0, 1.5], [2.0, 0.0, 1.5]])
    lying = dataclasses.replace(along, orientation=(0, 0, -(0.5**0.5), 0.5**0.5))
    both, exact = {"up": along, "lying": lying}, {"propagation": SIGHT, "quantisation_db": 0}
    made = bisplat.simulate_rssi(small_scene(), tmp_path / "x", both, positions=axis, **exact)
    upright = 20 * np.log10(small_scene().wavelength / (4 * np.pi * made.distances[:, 0])) + 10 * np.log10(1.5)
    np.testing.assert_allclose(made.powers[:, 0], upright, atol=1e-3)
    assert np.isnan(made.powers[:, 1]).all()


def test_the_folder_states_how_it_was_made_and_is_the_same_again(tmp_path):
    options = {"n": 10, "propagation": ROOM, "shadowing_db": 3, "floor_dbm": -60, "placement": "grid"}
    first = bisplat.simulate_rssi(small_scene(), tmp_path / "x", GATEWAYS, **options)
    bisplat.simulate_rssi(small_scene(), tmp_path / "y", GATEWAYS, **options)
    assert contents(tmp_path / "x") == contents(tmp_path / "y")
    stated = first.metadata
    assert stated["receiver"] == {
        "tx_power_dbm": 0.0, "floor_dbm": -60, "shadowing_db": 3, "quantisation_db": 1.0, "seed": 0,
    }  # fmt: skip
    assert stated["gateways"]["south"]["position"] == [0.5, -2.0, 2.0]
    assert stated["placement"] == "grid, seed 0" and stated["propagation"]["max_depth"] == 1
    assert bisplat.load_scene(tmp_path / "x" / "scene" / "scene.yaml").objects == small_scene().objects
    assert first.floor_dbm == -60 and bisplat.check(tmp_path / "x").valid


def test_positions_that_were_changed_afterwards_are_warned_of(tmp_path):
    bisplat.simulate_rssi(small_scene(), tmp_path / "x", GATEWAYS, n=6, propagation=SIGHT)
    assert not any("changed" in each for each in bisplat.check(tmp_path / "x").warnings)
    path = tmp_path / "x" / "tx_pos.csv"
    header, first, *others = path.read_text().splitlines()
    path.write_text("\n".join([header, *others, first, ""]))  # the rows of another order
    assert any(each.startswith("tx_pos.csv changed") for each in bisplat.check(tmp_path / "x").warnings)


def test_places_far_outside_the_scene_are_warned_of(tmp_path, capsys):
    far = {"near": (0.0, 2.0, 1.5), "in millimetres": (500.0, -2000.0, 2000.0)}
    bisplat.simulate_rssi(small_scene(), tmp_path / "x", far, positions=PLACES, propagation=SIGHT)
    said = capsys.readouterr().err
    assert "warning: gateways: 1 of 2 positions" in said and "warning: positions" not in said


FILES = {
    "positions alone": ("door: [0, 0, 2]\n", None),
    "all keys": ("door: {position: [0, 0, 2], boresight: [0, 1, 0], pattern: dipole, polarization: H}\n", None),
    "empty": ("", "expected the gateways by name, .*, found nothing"),
    "two directions": ("door: {position: [0, 0, 2], boresight: [0, 1, 0], orientation: [0, 0, 0, 1]}", "found both"),
    "unknown key": ("door: {position: [0, 0, 2], height: 2}", '"door": expected a known key, found .height'),
    "unknown pattern": ("door: {position: [0, 0, 2], pattern: dipol}", '"door": .*"dipole"'),
    "inside an object": ("door: [0, 0, 0]\n", '"door": '),
}


@pytest.mark.parametrize("case", FILES)
def test_gateways_from_a_file(case, tmp_path):
    content, sentence = FILES[case]
    (tmp_path / "file.yml").write_text(content)
    call = (small_scene(), tmp_path / "x", tmp_path / "file.yml")
    if sentence is None:
        read = read_gateways(tmp_path / "file.yml")["door"]
        assert (read.rows, read.columns, read.position) == (1, 1, (0, 0, 2))
        np.testing.assert_allclose(read.boresight, [1, 0, 0] if case == "positions alone" else [0, 1, 0], atol=1e-9)
        bisplat.simulate_rssi(*call, positions=PLACES, propagation=SIGHT)
        return
    with pytest.raises(InputError, match=sentence):
        bisplat.simulate_rssi(*call, positions=PLACES, propagation=SIGHT)
    assert not (tmp_path / "x").exists()


def test_gateway_of_given_elements_has_one_of_them(tmp_path):
    """The element at the gateway's position, as of any other array."""
    circle = bisplat.ElementArray.circle(4, radius_m=0.1)
    of_four = bisplat.Gateway((0, 0, 1.5), bisplat.facing((1, 0, 0)), elements=circle.positions_m)
    of_one = bisplat.Gateway((0, 0, 1.5), bisplat.facing((1, 0, 0)), rows=1, columns=1)
    found = [
        bisplat.simulate_rssi(small_scene(), tmp_path / name, {"door": gateway}, n=3, propagation=SIGHT).powers
        for name, gateway in (("four", of_four), ("one", of_one))
    ]
    assert (found[0] == found[1]).all()


def test_an_interrupted_simulation_continues(tmp_path, monkeypatch):
    """Stopped in the second gateway: the first one is not traced again, and the files are those of a whole run."""
    monkeypatch.setattr(simulated_powers, "AT_ONCE", 3)
    call = {"positions": PLACES, "propagation": SIGHT, "shadowing_db": 2.0, "seed": 1}
    bisplat.simulate_rssi(small_scene(), tmp_path / "whole", GATEWAYS, **call)
    traced, tracer_of = [], Rays.tracer

    class Stopped:
        def __init__(self, tracer, most):
            self._tracer, self._most = tracer, most

        def responses(self, positions):
            if len(traced) == self._most:
                raise KeyboardInterrupt
            traced.append(len(positions))
            return self._tracer.responses(positions)

    most = 3
    monkeypatch.setattr(Rays, "tracer", lambda *given: Stopped(tracer_of(*given), most))
    folder = tmp_path / "stopped"
    with pytest.raises(KeyboardInterrupt):
        bisplat.simulate_rssi(small_scene(), folder, GATEWAYS, **call)
    assert traced == [3, 1, 3]
    with pytest.raises(InputError, match="found an unfinished one"):
        bisplat.read_dataset(folder)
    with pytest.raises(InputError, match=r"found a dataset whose seed is 1, not 2"):
        bisplat.simulate_rssi(small_scene(), folder, GATEWAYS, **call | {"seed": 2})
    next((folder / "parts").glob("*-0000003.npy")).write_bytes(b"damaged")
    most = 5
    bisplat.simulate_rssi(small_scene(), folder, GATEWAYS, **call)
    assert traced == [3, 1, 3, 1, 1]
    bisplat.simulate_rssi(small_scene(), folder, GATEWAYS, **call)  # finished: nothing is traced
    assert contents(folder) == contents(tmp_path / "whole")
