"""A torque that bends over its command keeps its size at the reference."""

import numpy as np
import pytest

from tactile_cube.drivetrain.effects.torque_curve import TorqueCurve
from tactile_cube.drivetrain.signals import DAMPING, ROWS, TORQUE


def bent(torque: float, bend: float, gain: float = 0.0) -> tuple[float, float]:
    """Torque and what is left of a damping of 1, about a reference of 0.2 N m."""
    x = np.zeros((ROWS, 1))
    x[TORQUE, 0], x[DAMPING, 0] = torque, 1.0
    return TorqueCurve.law(x, 0, np.array([bend, gain, 0.2]), np.zeros(0), 0.002), x[DAMPING, 0]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_concave_curve_gives_less_beyond_its_reference_and_more_below(sign: float) -> None:
    assert sign * bent(0.2 * sign, -0.3)[0] == pytest.approx(0.2)
    assert sign * bent(0.4 * sign, -0.3)[0] == pytest.approx(0.4 * 2.0**-0.3)
    assert sign * bent(0.1 * sign, -0.3)[0] == pytest.approx(0.1 * 0.5**-0.3)
    assert sign * bent(0.4 * sign, -0.3, gain=0.1)[0] == pytest.approx(1.1 * 0.4 * 2.0**-0.3)


def test_damping_goes_with_the_slope_of_the_curve() -> None:
    step = 1e-6
    slope = (bent(0.3 + step, -0.3)[0] - bent(0.3 - step, -0.3)[0]) / (2.0 * step)
    assert bent(0.3, -0.3)[1] == pytest.approx(slope, rel=1e-5)


def test_no_torque_stays_none() -> None:
    assert bent(0.0, -0.5) == (0.0, pytest.approx(100.0**0.5))
