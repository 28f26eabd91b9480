"""What a gateway reports of a power: shadowing, floor and steps."""

import numpy as np
import pytest

from scenes.files.errors import ParameterError
from simulate.generation.power_receiver import PowerReceiver

GAINS = np.linspace(-110, -20, 2000).reshape(1000, 2)


def test_nothing_is_received_below_the_floor():
    reported = PowerReceiver(floor_dbm=-80, quantisation_db=0).reported(GAINS, seed=0)
    np.testing.assert_array_equal(np.isnan(reported), GAINS < -80)
    assert np.isnan(PowerReceiver().reported(np.array([[-np.inf]]), seed=0)).all()


@pytest.mark.parametrize("step", [0.5, 1, 2])
def test_powers_come_in_steps(step):
    reported = PowerReceiver(quantisation_db=step).reported(GAINS, seed=0)
    heard = ~np.isnan(reported)
    np.testing.assert_allclose(reported[heard] / step, (reported[heard] / step).round(), atol=1e-9)
    assert np.abs(reported - GAINS)[heard].max() <= step / 2
    assert reported[heard].min() > -100  # the mark of what was not received


def test_the_floor_acts_on_the_power_and_not_on_the_step_that_is_reported():
    gains = np.array([[-79.6, -80.4]])
    assert PowerReceiver(floor_dbm=-80).reported(gains, seed=0).tolist()[0][0] == -80
    assert np.isnan(PowerReceiver(floor_dbm=-80).reported(gains, seed=0)[0, 1])


def test_shadowing_is_normal_and_independent():
    level = np.full((20_000, 3), -50.0)
    drawn = PowerReceiver(shadowing_db=4, quantisation_db=0).reported(level, seed=3) - level
    assert drawn.mean() == pytest.approx(0, abs=0.06) and drawn.std() == pytest.approx(4, rel=0.02)
    assert (np.abs(drawn) < 4).mean() == pytest.approx(0.683, abs=0.01)
    correlations = np.corrcoef(drawn.T) - np.eye(3)
    assert np.abs(correlations).max() < 0.03
    assert abs(np.corrcoef(drawn[:-1, 0], drawn[1:, 0])[0, 1]) < 0.03


def test_the_draws_of_a_gateway_depend_on_no_other_gateway():
    level = np.full((50, 3), -50.0)
    shadowed = PowerReceiver(shadowing_db=4, quantisation_db=0)
    three = shadowed.reported(level, seed=3)
    np.testing.assert_array_equal(three[:, :2], shadowed.reported(level[:, :2], seed=3))
    assert not np.array_equal(three, shadowed.reported(level, seed=4))


@pytest.mark.parametrize("wrong", [{"floor_dbm": -101}, {"shadowing_db": -1}, {"tx_power_dbm": 1000}])
def test_values_out_of_range_are_refused(wrong):
    with pytest.raises(ParameterError, match=next(iter(wrong))):
        PowerReceiver(**wrong)
