import math

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import FRICTION, VELOCITY
from tactile_cube.drivetrain.effects.coulomb_friction import CoulombFriction
from tactile_cube.drivetrain.effects.stribeck_friction import StribeckFriction
from tactile_cube.drivetrain.signals import ROWS


@pytest.mark.parametrize(("speed", "share"), [(0.0, 1.0), (0.3, math.exp(-1.0)), (-0.3, math.exp(-1.0)), (3.0, 0.0)])
def test_stiction_falls_with_speed_in_both_directions(speed: float, share: float) -> None:
    x = np.zeros((ROWS, 1))
    x[VELOCITY, 0], x[FRICTION, 0] = speed, 0.02
    limit = StribeckFriction.law(x, 0, np.array([0.08, 0.3]), np.zeros(0), 0.002)
    assert limit == pytest.approx(0.02 + 0.08 * share, abs=1e-12)


def test_coulomb_friction_adds_to_the_friction_that_is_there() -> None:
    x = np.zeros((ROWS, 1))
    x[FRICTION, 0] = 0.02
    assert CoulombFriction.law(x, 0, np.array([0.03]), np.zeros(0), 0.002) == pytest.approx(0.05)
