"""Viscous friction may differ between the directions."""

import numpy as np
import pytest

from tactile_cube.drivetrain.effects.viscous_friction import ViscousFriction
from tactile_cube.drivetrain.signals import DAMPING, JOINT_TORQUE, ROWS, VELOCITY


@pytest.mark.parametrize(("speed", "slope"), [(2.0, 0.07), (-2.0, 0.03)])
def test_each_direction_has_its_own_damping(speed: float, slope: float) -> None:
    x = np.zeros((ROWS, 1))
    x[VELOCITY, 0] = speed
    assert ViscousFriction.law(x, 0, np.array([0.05, 0.04]), np.zeros(0), 0.002) == pytest.approx(-slope * speed)
    assert (x[DAMPING, 0], x[JOINT_TORQUE, 0]) == (pytest.approx(slope), 0.0)
