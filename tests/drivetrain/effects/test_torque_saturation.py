"""A torque limit, hard or neared softly, and the slope that the midpoint step needs."""

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.drivetrain.signals import DAMPING, ROWS, TORQUE

LIMIT = 0.3


def law(asked: float, softness: float) -> tuple[float, float]:
    """Torque [N m] for a torque asked for, and what is left of the damping."""
    x = np.zeros((ROWS, 1))
    x[TORQUE, 0], x[DAMPING, 0] = asked, 1.0
    torque = find_effect("torque_saturation").law(x, 0, np.array([LIMIT, softness]), np.zeros(0), 0.002)
    return float(torque), float(x[DAMPING, 0])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_hard_limit_lets_through_what_is_below_it(sign: float) -> None:
    assert law(sign * 0.2, 0.0) == (sign * 0.2, 1.0)
    assert law(sign * 0.5, 0.0) == (sign * LIMIT, 0.0)


@pytest.mark.parametrize("softness", [0.021, 0.2, 0.4, 1.0])
def test_a_soft_limit_is_neared_and_never_passed(softness: float) -> None:
    asked = np.linspace(0.01, 3.0, 60)
    torque = np.array([law(one, softness)[0] for one in asked])
    assert (torque <= np.minimum(asked, LIMIT) + 1e-12).all()
    assert (np.diff(torque) >= -1e-12).all()
    step = 1e-6
    slope = (law(0.25 + step, softness)[0] - law(0.25 - step, softness)[0]) / (2.0 * step)
    assert law(0.25, softness)[1] == pytest.approx(slope, rel=1e-5)


def test_a_softness_of_two_fifths_is_close_to_a_hyperbolic_tangent() -> None:
    asked = np.linspace(0.01, 1.5, 60)
    torque = np.array([law(one, 0.4)[0] for one in asked])
    assert np.abs(torque - LIMIT * np.tanh(asked / LIMIT)).max() < 0.03 * LIMIT
