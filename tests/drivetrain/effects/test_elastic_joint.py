"""Rotor, spring and link against two masses that are integrated each by itself, fifty times as finely."""

from math import sin

import numpy as np
import pytest

from tactile_cube.drivetrain import DrivetrainConstants
from tactile_cube.drivetrain.effects.elastic_joint import ElasticJoint
from tactile_cube.drivetrain.signals import MOTOR_POSITION, POSITION
from tests.drivetrain.effects.test_motions import DT, INERTIA, KD, KP, STEPS, T, plant

FINE = 50
COMMAND = 0.4 * np.sin(15.0 * T) + 0.2 * np.sin(47.0 * T)
FRICTION, WEIGHT = 0.15, 0.2 * 9.81 * 0.1  # [N m]
SPRUNG = {"compliance": 0.05, "rotor": 1e-3, "damping": 0.01}
GAP = {"compliance": 1.0 / 60.0, "rotor": 1e-3, "damping": 0.05, "gap": 0.02}


def ours(values: dict[str, float], q: float = 0.0, command: np.ndarray = COMMAND, gravity: float = 9.81) -> np.ndarray:
    """Positions (STEPS, 2) of link and rotor of the pendulum `b`."""
    drive = {"kp": KP, "kd": KD, "stiffness": np.inf, "static_friction": FRICTION, "torque_limit": np.inf}
    constants = DrivetrainConstants(**drive, reflected_inertia=1e-3)
    memory = plant().memory(constants, gravity=(0.0, 0.0, -gravity), effects=[ElasticJoint("b", **values)])
    plant().reset(memory, q)
    out = np.zeros((STEPS, 2, 3))
    commands = np.ascontiguousarray(np.tile(command[:, None], 3))
    plant().kernel.rollout(commands, 0, 1, memory, np.array([POSITION, MOTOR_POSITION]), out)
    return out[:, :, 1]


def rubbed(speed: float, friction: float) -> float:
    """A speed after dry friction has taken up to `friction` from it."""
    return max(abs(speed) - friction, 0.0) * (1.0 if speed > 0.0 else -1.0)


def two_masses(
    compliance: float, rotor: float, damping: float, gap: float = 0.0, motor_share: float = 0.0,
    motor_damping: float = 0.0,
) -> np.ndarray:  # fmt: skip
    """Positions (STEPS, 2) of link and rotor that start at rest at zero, each with friction of its own."""
    h, link, rows = DT / FINE, INERTIA - rotor, np.zeros((STEPS, 2))
    q = v = th = w = 0.0
    for k, command in enumerate(COMMAND.tolist()):
        for i in range(FINE):
            if i == FINE // 2:  # a step's speed is that of its middle, so its position is reached half a step later
                rows[k] = q, th
            beyond = th - q - min(max(th - q, -0.5 * gap), 0.5 * gap)
            spring = beyond / compliance + damping * (w - v) if beyond != 0.0 or gap == 0.0 else 0.0
            torque = KP * (command - th) - KD * w - motor_damping * w
            w = rubbed(w + h * (torque - spring) / rotor, h * motor_share * FRICTION / rotor)
            v = rubbed(v + h * (spring - WEIGHT * sin(q)) / link, h * (1.0 - motor_share) * FRICTION / link)
            q, th = q + h * v, th + h * w
    return rows


CASES = (
    SPRUNG,
    SPRUNG | {"motor_share": 0.4},
    SPRUNG | {"motor_share": 1.0},
    SPRUNG | {"motor_share": 1.0, "motor_damping": 0.1},
    GAP,
    GAP | {"motor_share": 0.7},
)


@pytest.mark.parametrize("values", CASES, ids=str)
def test_rotor_and_link_move_as_two_masses_with_friction_on_either_side(values: dict[str, float]) -> None:
    assert np.max(np.abs(ours(values) - two_masses(**values))) < 1e-4


@pytest.mark.parametrize("motor_share", [0.5, 1.0])
def test_friction_on_either_side_is_the_same_to_the_motion_of_a_stiff_joint(motor_share: float) -> None:
    stiff = ours({"compliance": 1e-7, "rotor": 1e-3, "damping": 0.01, "motor_share": motor_share})
    assert np.max(np.abs(stiff - ours({"compliance": 0.0}))) < 2e-4


def test_a_joint_with_a_gap_rests_on_the_side_of_its_load_where_its_rotor_sticks() -> None:
    still = ours(GAP | {"motor_share": 1.0}, q=0.3, command=np.full(STEPS, 0.3))
    assert np.max(np.ptp(still, axis=0)) < 1e-12
    assert still[0, 1] - still[0, 0] == pytest.approx(0.5 * 0.02 + WEIGHT * sin(0.3) / 60.0, abs=1e-9)
