"""The reward of one policy step: one function a term, weighed apart from being measured.

The environment puts the measured terms next to the reward, so that a replay can weigh them anew when the weights
follow a schedule.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.env.cube_pose import CubePose
from tactile_cube.errors import InputError

REWARD_TERMS = ("spin", "height", "plane", "tilt", "proximal", "off_centre", "leaving", "advance")
"""Names and order of the terms in the key "reward_terms"; leaving is 1 in the step that loses the cube."""
BORNE_TERMS = ("climb", "link_spin", "tips", "links", "link_force")
"""Further terms, of how the object is held: measured, and part of that key, only where one of them has a weight."""


def spin(before: CubePose, after: CubePose, direction: int, limit: float) -> float:
    """Rotation in the rewarded direction, at most `limit` a step [rad]. Source: paper, section II; website (clip)."""
    return min(direction * (after.theta - before.theta), limit)


def height(before: CubePose, after: CubePose) -> float:
    """Vertical motion |d_z| [m]."""
    return abs(after.z - before.z)


def plane(before: CubePose, after: CubePose) -> float:
    """Horizontal motion |d_xy| [m]."""
    return math.hypot(after.x - before.x, after.y - before.y)


def tilt(before: CubePose, after: CubePose) -> float:
    """Tilting motion |d_psi| + |d_phi| [rad]."""
    return abs(after.psi - before.psi) + abs(after.phi - before.phi)


def proximal(joint_angles: Sequence[float], joints_per_finger: int = 3) -> float:
    """Sum over the fingers of q1^4 [rad^4] for joint angles (joints,): keeps the fingers from twisting."""
    return sum(q**4 for q in joint_angles[::joints_per_finger])


def off_centre(first: CubePose, after: CubePose) -> float:
    """Squared horizontal distance from where the episode began [m^2]. Not in the paper.

    A cube that is dragged aside is lost some twenty steps later, beyond what the discount lets the agent foresee.
    """
    return (after.x - first.x) ** 2 + (after.y - first.y) ** 2


def advance(turned: float, direction: int, before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    """How far the fingertips went ahead of the object, against its rotation, in sum [rad]. Not in the paper.

    A finger that turns with the object adds nothing, one that goes back to grasp anew adds its way at once, long before
    the turn that this makes possible. The sum over an episode is bounded by the fingers' reach unless the object turns:
    going to and fro earns nothing.

    Args:
        turned: rotation of the object in the rewarded direction, as in `spin` [rad].
        direction: that is rewarded, +1 or -1.
        before: azimuth of each fingertip about the object's middle `(fingers,)` [rad].
        after: the same after the step.
    """
    way = np.remainder(after - before + np.pi, 2.0 * np.pi) - np.pi
    return float(len(way) * turned - direction * way.sum())


def climb(first: CubePose, after: CubePose) -> float:
    """Squared height above where the episode began [m^2]. Not in the paper.

    A cube that climbs into the hand runs with its upper edge against links that are no fingertips.
    """
    return max(after.z - first.z, 0.0) ** 2


@dataclass(frozen=True)
class Reward:
    """Weights of the terms, all given as positive numbers. Source: website, table of the reward.

    Attributes:
        spin: lambda_spin [1/rad].
        height: lambda_z [1/m].
        plane: lambda_plane [1/m].
        tilt: lambda_rot [1/rad].
        proximal: lambda_proxy [1/rad^4].
        off_centre: penalty for a cube away from where it began [1/m^2]; 0 in the paper.
        leaving: penalty for losing the cube (size not published). Must exceed what going on costs, or dropping pays.
        advance: of fingertips that go ahead of the object [1/rad]; 0 in the paper.
        fastest: rotation above this rate earns nothing more [rad/s].
        climb: penalty for an object above where it began [1/m^2]; 0 in the paper, as all that follow.
        link_spin: penalty for rotation in a step at whose end another link than a fingertip touches the object [1/rad].
            Below `spin` a hand that rests has nothing to gain by it.
        tips: of a step at whose end three or more fingertips touch the object.
        links: penalty for one at whose end another link touches it.
        link_force: penalty for the share of these links in the normal force.
    """

    spin: float = 16.0
    height: float = 100.0
    plane: float = 300.0
    tilt: float = 50.0
    proximal: float = 25.0
    off_centre: float = 0.0
    leaving: float = 10.0
    advance: float = 0.0
    fastest: float = 1.0
    climb: float = 0.0
    link_spin: float = 0.0
    tips: float = 0.0
    links: float = 0.0
    link_force: float = 0.0

    def __post_init__(self) -> None:
        """Refuses values without a meaning."""
        for key in (*REWARD_TERMS, *BORNE_TERMS, "fastest"):
            value = getattr(self, key)
            if not isinstance(value, (int, float)) or not (math.isfinite(value) and value >= 0.0):
                raise InputError(f"reward.{key} is {value}; give a finite weight >= 0 (signs are built in)")

    @property
    def borne_terms(self) -> tuple[str, ...]:
        """BORNE_TERMS where one of them has a weight, else none."""
        return BORNE_TERMS if any(getattr(self, key) for key in BORNE_TERMS) else ()

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of the terms that are measured, in their order."""
        return REWARD_TERMS + self.borne_terms

    def weights(self, penalty_scale: float = 1.0) -> NDArray[np.float32]:
        """Signed weights in the order of `terms`: reward = reward_terms @ weights.

        Args:
            penalty_scale: factor on height, plane and tilt, from the curriculum.
        """
        motion = [-penalty_scale * w for w in (self.height, self.plane, self.tilt)]
        others = [-self.proximal, -self.off_centre, -self.leaving, self.advance]
        borne = [-self.climb, -self.link_spin, self.tips, -self.links, -self.link_force] if self.borne_terms else []
        return np.array([self.spin, *motion, *others, *borne], dtype=np.float32)
