"""Friction that differs between the directions, by an amount or by factors."""

import numpy as np
import pytest

from tactile_cube.drivetrain.effects.asymmetric_friction import AsymmetricFriction
from tactile_cube.drivetrain.signals import DIRECTION, FRICTION, ROWS


def level(direction: float, *p: float) -> float:
    """Friction limit [N m] with 0.1 N m of all other friction; `p` is difference, ratio, friction."""
    x = np.zeros((ROWS, 1))
    x[FRICTION, 0], x[DIRECTION, 0] = 0.1, direction
    return AsymmetricFriction.law(x, 0, np.array(p), np.zeros(0), 0.002)


def test_a_difference_lies_half_on_either_side() -> None:
    assert (level(1.0, 0.04, 0.0, 0.0), level(-1.0, 0.04, 0.0, 0.0)) == pytest.approx((0.12, 0.08))


def test_a_ratio_takes_all_friction_with_it() -> None:
    assert (level(1.0, 0.0, 0.3, 0.02), level(-1.0, 0.0, 0.3, 0.02)) == pytest.approx((0.156, 0.084))
