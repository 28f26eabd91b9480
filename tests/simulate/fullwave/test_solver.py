"""Our solver against gprMax, an independent one, and what its fields may not depend on."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, sheet
from simulate.fullwave.all_elements import stored_field
from simulate.fullwave.run_plan import Plan, plan


@pytest.fixture(scope="module")
def corner() -> Scene:
    """A lossy floor that runs out into the absorbing boundary, a thin board, and the edges of a metal box."""
    floor = SceneObject("floor", sheet((0, 0, 0), (0.6, 0, 0), (0, 0.5, 0)), "concrete", 0.4)
    board = SceneObject("board", sheet((0.1, 0.4, 0.0), (0.4, 0, 0), (0, 0, 0.3)), "wood", 0.01)
    case = SceneObject("case", box((0.3, 0.1, 0.1), (0.4, 0.2, 0.3)), "metal")
    gateway = Gateway((0.55, 0.25, 0.2), facing((-1, 0, 0)), rows=1, columns=3, spacing=0.15, pattern="dipole")
    region = Transmitter((0.1, 0.2, 0.15), (0.2, 0.3, 0.25), pattern="dipole")
    materials = p2040_materials(["concrete", "wood", "metal"], 915e6)
    return Scene("corner", 915e6, gateway, region, (floor, board, case), materials)


@pytest.fixture(scope="module")
def planned(corner) -> Plan:
    return plan(corner, corner.transmitter.region, 0.025)


@pytest.mark.slow
def test_same_field_as_by_gprmax(corner, planned, tmp_path):
    pytest.importorskip("gprMax", reason="gprMax is an extra: make setup")
    ours = stored_field(planned, tmp_path / "ours")
    theirs = stored_field(planned, tmp_path / "theirs", at_once=2, solver="gprMax")
    for element in range(3):
        difference = np.linalg.norm(ours.values[element] - theirs.values[element])
        assert difference < 10 ** (-55 / 20) * np.linalg.norm(theirs.values[element])


def test_element_does_not_depend_on_those_beside_it(corner, planned, tmp_path):
    together = stored_field(planned, tmp_path / "together", at_once=1)
    apart = stored_field(planned, tmp_path / "apart", at_once=3)
    assert np.array_equal(together.values, apart.values)
    assert np.array_equal(together.unsettled, apart.unsettled)


@pytest.mark.slow
def test_echo_from_afar_is_waited_for(corner, planned, tmp_path):
    """A field may hardly change before its echo arrives: it is not judged before waves have crossed the scene twice."""
    assert planned.earliest * planned.grid.time_step > 2 * np.linalg.norm(np.ptp(corner.bounds, axis=0)) / 3e8
    hasty = replace(planned, steps=20 * planned.steps, earliest=0)
    assert stored_field(hasty, tmp_path / "hasty").steps >= planned.steps
    patient = replace(hasty, earliest=5 * planned.steps)
    assert stored_field(patient, tmp_path / "patient").steps >= 5 * planned.steps


def test_settled_field_hardly_changes_any_more(corner, planned, tmp_path):
    """The estimated rest of a field is about what longer runs change, and stays below 60 dB where it says so."""
    settled = stored_field(planned, tmp_path / "settled")
    assert settled.steps < planned.steps and settled.unsettled.max() < 1e-3
    later = replace(planned, steps=3 * planned.steps, earliest=2 * planned.steps)
    longer = stored_field(later, tmp_path / "longer")
    change = np.linalg.norm(longer.values - settled.values) / np.linalg.norm(longer.values)
    assert change < 2e-3
