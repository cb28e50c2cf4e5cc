"""Both lags follow a ramp late by their time constant, whatever the step."""

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.drivetrain.signals import MEASURED_VELOCITY, ROWS, TORQUE

LATE = 0.012  # [s]


@pytest.mark.parametrize("dt", [0.0005, 0.002, 0.004])
@pytest.mark.parametrize(("name", "row"), [("actuator_lag", TORQUE), ("velocity_filter_lag", MEASURED_VELOCITY)])
def test_a_ramp_comes_out_late_by_the_time_constant(name: str, row: int, dt: float) -> None:
    effect = find_effect(name)
    state, x = np.zeros(effect.state_size(dt)), np.zeros((ROWS, 1))
    for k in range(round(20 * LATE / dt)):
        x[row, 0] = 3.0 * k * dt
        out = effect.law(x, 0, np.array([LATE]), state, dt)
    assert x[row, 0] - out == pytest.approx(3.0 * LATE, rel=1e-3)


def test_the_speed_remembered_of_a_step_is_that_of_its_end() -> None:
    """A speed that grows steadily is late by the time constant alone, and not by half a step more."""
    dt, effect = 0.002, find_effect("velocity_filter_lag")
    state, x = np.zeros(effect.state_size(dt)), np.zeros((ROWS, 1))
    x[2, 0] = 3.0  # acceleration
    for k in range(120):
        x[MEASURED_VELOCITY, 0] = 3.0 * (k - 0.5) * dt
        out = effect.law(x, 0, np.array([LATE]), state, dt)
    share = state[3]  # of the present speed, which the midpoint damping carries on
    assert 3.0 * 119 * dt - out - share * 3.0 * 0.5 * dt == pytest.approx(3.0 * LATE, rel=1e-3)
