"""Both lags follow a ramp late by their time constant, whatever the step."""

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.drivetrain.signals import DAMPING, MEASURED_VELOCITY, ROWS, TORQUE

LATE = 0.012  # [s]


@pytest.mark.parametrize("dt", [0.0005, 0.002, 0.004])
@pytest.mark.parametrize(("name", "row"), [("actuator_lag", TORQUE), ("velocity_filter_lag", MEASURED_VELOCITY)])
def test_a_ramp_comes_out_late_by_the_time_constant(name: str, row: int, dt: float) -> None:
    effect = find_effect(name)
    state, x = np.zeros(effect.state_size(dt)), np.zeros((ROWS, 1))
    for k in range(round(20 * LATE / dt)):
        x[row, 0] = 3.0 * k * dt
        out = effect.law(x, 0, np.array([LATE, 0.0]), state, dt)
    assert x[row, 0] - out == pytest.approx(3.0 * LATE, rel=1e-3)


@pytest.mark.parametrize("second", [0.0, 0.005, LATE])
def test_the_speed_remembered_of_a_step_is_that_of_its_end(second: float) -> None:
    """A speed that grows steadily is late by the time constants alone, and not by half a step more."""
    dt, effect = 0.002, find_effect("velocity_filter_lag")
    state, x = np.zeros(effect.state_size(dt)), np.zeros((ROWS, 1))
    x[2, 0] = 3.0  # acceleration
    for k in range(150):
        x[MEASURED_VELOCITY, 0] = 3.0 * (k - 0.5) * dt
        x[DAMPING, 0] = 1.0
        out = effect.law(x, 0, np.array([LATE, second]), state, dt)
    share = x[DAMPING, 0]  # of the present speed, which the midpoint damping carries on
    assert 3.0 * 149 * dt - out - share * 3.0 * 0.5 * dt == pytest.approx(3.0 * (LATE + second), rel=1e-3)
