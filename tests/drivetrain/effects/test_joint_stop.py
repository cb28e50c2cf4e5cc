"""An end stop pushes back, and one of rubber the more the deeper."""

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.drivetrain.signals import ANGLE, ROWS

STOP = find_effect("joint_stop")


def pushed(angle: float, **values: float) -> float:
    """Torque [N m] at an angle [rad], of a stop of 10 N m/rad at 0.5 rad, to a depth of 0.1 rad."""
    x = np.zeros((ROWS, 1))
    x[ANGLE, 0] = angle
    effect = STOP("a", **({"upper": 0.5, "lower": -1e9, "stiffness": 10.0, "depth": 0.1} | values))
    return float(effect.law(x, 0, np.array(list(effect.values.values())), np.zeros(0), 0.002))


@pytest.mark.parametrize(
    ("angle", "exponent", "torque"),
    [(0.49, 2.0, 0.0), (0.6, 1.0, -1.0), (0.7, 1.0, -2.0), (0.6, 2.0, -1.0), (0.7, 2.0, -4.0), (0.55, 2.0, -0.25)],
)
def test_a_stop_of_rubber_pushes_with_a_power_of_its_depth(angle: float, exponent: float, torque: float) -> None:
    assert pushed(angle, exponent=exponent) == pytest.approx(torque)
    assert pushed(-angle, upper=1e9, lower=-0.5, exponent=exponent) == pytest.approx(-torque)
