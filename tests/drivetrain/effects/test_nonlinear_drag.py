"""Drag by a power of the speed, and its slope, which the midpoint step needs."""

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.drivetrain.signals import DAMPING, ROWS, VELOCITY

DRAG = find_effect("nonlinear_drag")


def law(speed: float, power: float) -> tuple[float, float]:
    """Torque [N m] and slope [N m s/rad] of a drag of 0.1 N m at 2 rad/s."""
    x = np.zeros((ROWS, 1))
    x[VELOCITY, 0] = speed
    values = DRAG("a", coefficient=0.025, power=power, speed=2.0).values
    torque = DRAG.law(x, 0, np.array(list(values.values())), np.zeros(0), 0.002)
    return float(torque), float(x[DAMPING, 0])


@pytest.mark.parametrize("power", [1.5, 2.0, 3.0])
def test_drag_grows_with_a_power_of_the_speed(power: float) -> None:
    assert law(2.0, power)[0] == pytest.approx(-0.1)
    assert law(-4.0, power)[0] == pytest.approx(0.1 * 2.0**power)
    assert law(0.0, power) == (0.0, 0.0)
    step = 1e-5
    slope = (law(3.0 - step, power)[0] - law(3.0 + step, power)[0]) / (2.0 * step)
    assert law(3.0, power)[1] == pytest.approx(slope, rel=1e-6)
