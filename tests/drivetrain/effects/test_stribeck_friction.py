import math

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import FRICTION, VELOCITY
from tactile_cube.drivetrain.effects.coulomb_friction import CoulombFriction
from tactile_cube.drivetrain.effects.stribeck_friction import StribeckFriction
from tactile_cube.drivetrain.signals import ROWS


@pytest.mark.parametrize(
    ("speed", "exponent", "share"),
    [
        (0.0, 2.0, 1.0),
        (0.3, 2.0, math.exp(-1.0)),
        (-0.3, 2.0, math.exp(-1.0)),
        (3.0, 2.0, 0.0),
        (-0.6, 1.0, math.exp(-2.0)),
        (1.2, 0.5, math.exp(-2.0)),
        (0.0, 0.5, 1.0),
    ],
)
def test_stiction_falls_with_speed_in_both_directions(speed: float, exponent: float, share: float) -> None:
    x = np.zeros((ROWS, 1))
    x[VELOCITY, 0], x[FRICTION, 0] = speed, 0.02
    limit = StribeckFriction.law(x, 0, np.array([0.08, 0.3, exponent]), np.zeros(0), 0.002)
    assert limit == pytest.approx(0.02 + 0.08 * share, abs=1e-12)


def test_coulomb_friction_adds_to_the_friction_that_is_there() -> None:
    x = np.zeros((ROWS, 1))
    x[FRICTION, 0] = 0.02
    assert CoulombFriction.law(x, 0, np.array([0.03]), np.zeros(0), 0.002) == pytest.approx(0.05)
