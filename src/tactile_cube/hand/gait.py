"""A hand-crafted gait: fingertips walk on a circle around the cube, one pair holds while the other goes back.

The paper compares with a hand-crafted trajectory (11 rad, then the cube drops). This one follows a clock and feels
nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.hand.kinematics import finger_angles
from tactile_cube.hand.model import HandModel

Array = NDArray[np.float64]

PLACES = np.radians([-90.0, 0.0, 90.0, 180.0])
"""Where ring, middle, fore and thumb stand around the cube."""
PHASES = np.array([0.0, 0.5, 0.0, 0.5])
"""Part of the cycle by which each finger is ahead: opposing fingers move together."""


@dataclass(frozen=True)
class Gait:
    """Shape of the walk.

    Found by cross-entropy searches at full weight, T_s 0.25 and 0.5 s; about -z is what this hand pose turns best.

    Attributes:
        swing: a finger walks from +swing to -swing about its place, and back in the air, to turn the cube in -z [rad].
        shift: of the middle of the swing from the finger's place [rad].
        period: policy steps of a cycle.
        air_share: part of the cycle in which a finger is in the air.
        pressed: distance of a holding tip's target from the vertical axis; 54 mm would just touch the faces [m].
        lifted: the same in the air [m].
        height: of the tips' targets over the middle of the cube [m].
        closing: policy steps in which all fingers close around the cube before they begin to walk.
    """

    swing: float = 0.82
    shift: float = -0.15
    period: int = 54
    air_share: float = 0.34
    pressed: float = 0.046
    lifted: float = 0.0954
    height: float = 0.009
    closing: int = 6

    def tips(self, step: int, direction: int = -1) -> Array:
        """Return the targets of the fingertips `(4, 3)` [m] at a policy step; direction +1 turns about +z."""
        holding = 1.0 - self.air_share
        phase = ((step - self.closing) / self.period + PHASES) % 1.0 if step >= self.closing else np.zeros(4)
        on_cube = phase < holding
        forth = 1.0 - 2.0 * phase / holding
        back = -1.0 + 2.0 * (phase - holding) / self.air_share
        walk = -direction * self.swing * np.where(on_cube, forth, back) if step >= self.closing else np.zeros(4)
        angle, radius = PLACES - direction * self.shift + walk, np.where(on_cube, self.pressed, self.lifted)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(4, self.height)], axis=1)

    def action(self, hand: HandModel, step: int, direction: int = -1) -> Array:
        """Return the action `(12,)` in [-1, 1] of a policy step."""
        return hand.action_of(joint_angles(hand, self.tips(step, direction)))


def joint_angles(hand: HandModel, tips: Array) -> Array:
    """Return the joint angles `(12,)` [rad] that bring the tips to their targets `(4, 3)` [m]."""
    return np.concatenate([finger_angles(hand, finger, tip[None])[0] for finger, tip in enumerate(tips)])


def similar_gaits(hand: HandModel, number: int, steps: int, direction: int, seed: int = 0) -> Array:
    """Return actions `(number, steps, 12)` of gaits that turn the cube.

    They lie around the best of 216 gaits that a cross-entropy search tried at full weight and T_s 0.25 s.
    """
    rng = np.random.default_rng(seed)
    actions = np.empty((number, steps, len(hand.joint_names)))
    for episode in actions:
        gait = Gait(
            swing=rng.uniform(0.74, 0.87),
            shift=rng.uniform(-0.18, -0.1),
            period=int(rng.integers(40, 49)),
            air_share=rng.uniform(0.28, 0.36),
            pressed=rng.uniform(0.0455, 0.0486),
            lifted=rng.uniform(0.089, 0.098),
            height=rng.uniform(0.005, 0.0085),
            closing=int(rng.integers(5, 7)),
        )
        episode[:] = [gait.action(hand, step, direction) for step in range(steps)]
    return actions
