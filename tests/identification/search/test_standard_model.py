"""The standard model, regressed on the torque that a model lacks."""

import numpy as np
import pytest

from tactile_cube.identification.search.residual_shape import Missing
from tactile_cube.identification.search.together import regressed

RNG = np.random.default_rng(0)


def test_friction_by_direction_offset_and_gain_come_back_from_the_missing_torque() -> None:
    speed, drive = RNG.normal(size=5000), 30.0 * RNG.normal(size=5000)
    torque = -20.4 * np.sign(speed) - np.where(speed > 0, 167.0, 240.0) * speed - 3.2 + 0.05 * drive
    signals = {"velocity of slide [rad/s]": speed, "torque of slide [N m]": drive}
    blocks = np.zeros(5000, dtype=np.int64)
    found = regressed(Missing("slide", torque + RNG.normal(size=5000), signals, blocks, blocks))
    assert found["coulomb_friction"]["friction"] == pytest.approx(20.4, rel=0.01)
    assert found["viscous_friction"]["damping"] == pytest.approx(0.5 * (167.0 + 240.0), rel=0.01)
    assert found["viscous_friction"]["difference"] == pytest.approx(167.0 - 240.0, rel=0.02)
    assert found["torque_bias"]["bias"] == pytest.approx(-3.2, rel=0.05)
    assert found["torque_gain"]["error"] == pytest.approx(0.05, rel=0.05)
