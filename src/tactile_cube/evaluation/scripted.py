"""A hand-crafted gait: twist the cube with all fingers, then move one opposing pair after the other to the next face.

The paper compares with such a trajectory (11 rad, then the cube drops). This one follows a clock and feels nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.env import RotationEnv
from tactile_cube.evaluation.episode_record import Array
from tactile_cube.evaluation.policies import SQUEEZE, action_of
from tactile_cube.hand import HandModel, grasp_angles

PAIRS = ((0, 2), (1, 3))
"""Opposing fingers: ring and fore, middle and thumb."""


@dataclass(frozen=True)
class Gait:
    """Shape of one cycle, which turns the cube by `2 * swing`.

    Attributes:
        swing: the fingers twist from +swing to -swing about the vertical [rad].
        twist_steps: policy steps of the twist.
        lift_steps: policy steps for each of lifting a pair, carrying it over and landing it.
        lift: how far a lifted tip keeps off its face [m].
        squeeze: how far the tips' targets lie inside the faces [m].
    """

    swing: float = 0.42
    twist_steps: int = 20
    lift_steps: int = 8
    lift: float = 0.018
    squeeze: float = SQUEEZE


class ScriptedPolicy:
    """Plays the gait from the pose in which the cube starts."""

    def __init__(self, gait: Gait | None = None) -> None:
        self._gait = gait or Gait()

    def start(self, env: RotationEnv, seed: int) -> None:
        """Work out the actions of the first grasp and of one cycle."""
        size, direction = np.asarray(env.constants.cube_size), env.task.direction
        yaw = float(Rotation.from_quat(env.world.cube_quaternion).as_euler("ZYX")[0])
        grasp = [_angles(env.hand, size, yaw, np.full(4, -self._gait.squeeze))] * self._gait.lift_steps
        first = self._twist(env.hand, size, yaw, direction * self._gait.swing)
        self._opening = action_of(env.hand, np.array(grasp + first))
        self._cycle = action_of(env.hand, np.array(self._one_cycle(env.hand, size, direction)))

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return the action of the clock's step."""
        if step < len(self._opening):
            return np.asarray(self._opening[step])
        return np.asarray(self._cycle[(step - len(self._opening)) % len(self._cycle)])

    def _twist(self, hand: HandModel, size: Array, begin: float, end: float) -> list[Array]:
        pressed = np.full(4, -self._gait.squeeze)
        return [_angles(hand, size, yaw, pressed) for yaw in np.linspace(begin, end, self._gait.twist_steps)]

    def _one_cycle(self, hand: HandModel, size: Array, direction: int) -> list[Array]:
        """Angles of one cycle: each pair goes back to the start of the twist, then all twist."""
        gait, end = self._gait, direction * self._gait.swing
        clearance, yaw = np.full(4, -gait.squeeze), np.full(4, end)
        frames: list[Array] = []
        for pair in PAIRS:
            for stage in ("lift", "carry", "land"):
                clearance[list(pair)] = -gait.squeeze if stage == "land" else gait.lift
                yaw[list(pair)] = end if stage == "lift" else -end
                frames += [_mixed(hand, size, yaw, clearance)] * gait.lift_steps
        return frames + self._twist(hand, size, -end, end)


def _angles(hand: HandModel, size: Array, yaw: float, clearance: Array) -> Array:
    """Return joint angles `(12,)` for a cube turned by `yaw`, each finger with its own clearance `(4,)` [m]."""
    return _mixed(hand, size, np.full(4, yaw), clearance)


def _mixed(hand: HandModel, size: Array, yaw: Array, clearance: Array) -> Array:
    """Return joint angles where each finger has its own idea of the cube's yaw `(4,)` and its clearance `(4,)`."""
    angles = np.empty(12)
    for finger in range(4):
        mine = slice(3 * finger, 3 * finger + 3)
        quaternion = Rotation.from_euler("z", yaw[finger]).as_quat()
        angles[mine] = grasp_angles(hand, size, np.zeros(3), quaternion, float(clearance[finger]))[mine]
    return angles
