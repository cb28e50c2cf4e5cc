"""Dry friction on bristles: a spring below break-away, Coulomb's friction beyond, drag only while the bristles bend."""

import numpy as np
import pytest

from tactile_cube.drivetrain.effects.presliding_friction import PreslidingFriction
from tactile_cube.drivetrain.signals import DAMPING, FRICTION, JOINT_TORQUE, ROWS, VELOCITY

DT = 1e-4


def torques(speeds: list[float], *p: float) -> tuple[np.ndarray, np.ndarray]:
    """Joint torque and damping at each step of a motion with 0.1 N m of friction stated."""
    bristle, shown = np.zeros(1), []
    for speed in speeds:
        x = np.zeros((ROWS, 1))
        x[FRICTION, 0], x[VELOCITY, 0] = 0.1, speed
        assert PreslidingFriction.law(x, 0, np.array(p), bristle, DT) == 0.0, "no rigid friction is left"
        shown.append((x[JOINT_TORQUE, 0], x[DAMPING, 0]))
    return np.array(shown)[:, 0], np.array(shown)[:, 1]


def test_bristles_are_a_spring_first_and_slide_at_the_limit() -> None:
    torque, damping = torques([0.1] * 10_000, 0.01, 0.02, 0.0)
    assert torque[9] == pytest.approx(-0.12 * 0.1 * 10 * DT / 0.01, rel=0.01), "stiffness (limit + excess) / breakaway"
    assert torque[-1] == pytest.approx(-0.12, rel=1e-3)
    assert not damping.any()


def test_damped_bristles_drag_where_they_bend_and_not_where_they_slide() -> None:
    there_and_back = [0.1] * 10_000 + [-0.1]
    bare, damped = torques(there_and_back, 0.01, 0.0, 0.0)[0], torques(there_and_back, 0.01, 0.0, 0.5)[0]
    drag = bare - damped
    assert drag[0] == pytest.approx(0.5 * 0.1, rel=0.01)
    assert drag[9_999] == pytest.approx(0.0, abs=1e-4)
    assert drag[-1] == pytest.approx(-2.0 * 0.5 * 0.1, rel=0.01), "bristles bent forwards yield twice as fast"
