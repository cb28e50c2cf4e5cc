"""Episodes made up by hand: a cube that turns steadily, fingers that stand still in the world and let go in turn."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.evaluation.episode_record import Array, ContactTable, EpisodeRecord
from tactile_cube.hand import DLR_HAND2

SPOTS = 0.04 * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""Where the four fingers touch the cube at the start, in the world."""


def contacts(touch: np.ndarray, spots: np.ndarray, force: float = 1.0, distance: float = -1e-4) -> ContactTable:
    """Contacts of fingertips for a mask `(n + 1, 4)` at places `(n + 1, 4, 3)`."""
    step, finger = np.nonzero(touch)
    position = spots[step, finger]
    inwards = -position / np.linalg.norm(position, axis=1, keepdims=True)
    forces = np.full(len(step), force)
    tips = np.ones(len(step), dtype=bool)
    return ContactTable(step, finger, tips, position, force * inwards, forces, np.full(len(step), distance))


def episode(
    angle: float = 4.0, steps: int = 100, carried: bool = False, touch: np.ndarray | None = None, **changes: Any
) -> EpisodeRecord:
    """The cube turns by `angle` in -z, the rewarded direction.

    Args:
        angle: final angle [rad].
        steps: policy steps.
        carried: the fingers turn with the cube instead of standing still.
        touch: which finger touches when `(steps + 1, 4)`; always by default.
        changes: replace fields of the record.
    """
    time = 0.1 * np.arange(steps + 1, dtype=np.float64)
    theta = angle * time / time[-1]
    turn = Rotation.from_rotvec(np.outer(-theta, [0.0, 0.0, 1.0]))
    spots = np.stack([turn.apply(spot) if carried else np.tile(spot, (steps + 1, 1)) for spot in SPOTS], axis=1)
    touch = np.ones((steps + 1, 4), dtype=bool) if touch is None else touch
    angles = np.tile(DLR_HAND2.start_angles, (steps + 1, 1))
    record: dict[str, Any] = {
        "time": time,
        "theta": theta,
        "joint_position": angles,
        "filtered_target": angles,
        "target": angles[1:],
        "cube_position": np.zeros((steps + 1, 3)),
        "cube_quaternion": turn.as_quat(),
        "reward": np.ones(steps),
        "reward_terms": {"spin": np.full(steps, 1.5), "plane": np.full(steps, -0.5)},
        "contacts": contacts(touch, spots),
        "ending": "time_limit",
        "direction": -1,
        "cube_size": np.full(3, 0.08),
        "constants": {"filter_time": 0.5, "gravity_scale": 1.0},
        "trace": trace(steps, angles[0]),
    }
    return EpisodeRecord(**record | changes)


def trace(steps: int, angles: Array) -> dict[str, Array]:
    """Signals at 500 Hz of a hand that does not move."""
    samples = 50 * steps
    constant = {name: np.tile(angles, (samples, 1)) for name in ("q", "q_m", "q_d", "torque")}
    pose = {"cube_position": np.zeros((samples, 3)), "cube_quaternion": np.tile([0.0, 0.0, 0.0, 1.0], (samples, 1))}
    return {"time": 0.002 * np.arange(samples, dtype=np.float64), **constant, **pose}
