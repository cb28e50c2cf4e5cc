"""The reward of one policy step: one function a term, its weight apart.

A term is a function with `@term` and a line in `conf/reward/`, its weight. The environment puts the measured terms next
to the reward, so that a replay can weigh them anew when the weights follow a schedule.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_cube.env.task import CubePose
from tactile_cube.errors import InputError

TOUCH_FORCE = 0.02  # smallest normal force that counts as touching [N]: a twenty-fifth of the cube's weight
SUPPORTING_TIPS = 3  # fingertips that must touch the cube for it to count as supported by tips


@dataclass(frozen=True, slots=True)
class Step:
    """What happened in a policy step.

    Attributes:
        first: the object's pose where the episode began.
        before: at the begin of the step.
        after: at its end.
        direction: sense of rotation that is rewarded, +1 or -1.
        limit: largest rotation that earns [rad].
        lost: whether the step loses the object.
        proximal_angles: q1 of each finger at the end [rad].
        azimuths_before: of each fingertip about the object's middle, from where it began `(fingers,)` [rad].
        azimuths: the same at the end.
        forces: normal force on the object of each finger's other links and of its tip `(2, fingers)` [N].
    """

    first: CubePose
    before: CubePose
    after: CubePose
    direction: int
    limit: float
    lost: bool
    proximal_angles: list[float]
    azimuths_before: NDArray[np.float64]
    azimuths: NDArray[np.float64]
    forces: NDArray[np.float64]


class Term(NamedTuple):
    """A term's function, its sign in the reward, and whether a curriculum scales its penalty."""

    measure: Callable[[Step], float]
    sign: int
    scaled: bool


TERMS: dict[str, Term] = {}  # by name, which is that of the function and of the weight


def term(sign: int, scaled: bool = False) -> Callable[[Callable[[Step], float]], Callable[[Step], float]]:
    """Make a function of a step a term of the reward: +1 earns, -1 costs."""

    def register(measure: Callable[[Step], float]) -> Callable[[Step], float]:
        TERMS[measure.__name__] = Term(measure, sign, scaled)
        return measure

    return register


@term(+1)
def spin(step: Step) -> float:
    """Return the rotation in the rewarded direction, at most `limit` a step [rad]. Source: paper; website (clip)."""
    return min(step.direction * (step.after.theta - step.before.theta), step.limit)


@term(-1, scaled=True)
def height(step: Step) -> float:
    """Return the vertical motion |d_z| [m]."""
    return abs(step.after.z - step.before.z)


@term(-1, scaled=True)
def plane(step: Step) -> float:
    """Return the horizontal motion |d_xy| [m]."""
    return math.hypot(step.after.x - step.before.x, step.after.y - step.before.y)


@term(-1, scaled=True)
def tilt(step: Step) -> float:
    """Return the tilting motion |d_psi| + |d_phi| [rad]."""
    return abs(step.after.psi - step.before.psi) + abs(step.after.phi - step.before.phi)


@term(-1)
def proximal(step: Step) -> float:
    """Return the sum over the fingers of q1^4 [rad^4], which keeps them from twisting."""
    return sum(q**4 for q in step.proximal_angles)


@term(-1)
def off_centre(step: Step) -> float:
    """Return the squared horizontal distance from where the episode began [m^2]. Not in the paper.

    A cube that is dragged aside is lost some twenty steps later, beyond what the discount lets the agent foresee.
    """
    return (step.after.x - step.first.x) ** 2 + (step.after.y - step.first.y) ** 2


@term(-1)
def leaving(step: Step) -> float:
    """Return 1 in the step that loses the cube. Its weight must exceed what going on costs, or dropping pays."""
    return float(step.lost)


@term(+1)
def advance(step: Step) -> float:
    """Return the fingertips' total motion ahead of the object, against its rotation [rad]. Not in the paper.

    A finger that turns with the object adds nothing; one that moves back to regrasp adds its motion at once, long
    before the rotation that this makes possible. The sum over an episode is bounded unless the object rotates: moving
    to and fro earns nothing, nor does circling the axis, which is taken back once it is half round.
    """
    way = step.azimuths - step.azimuths_before
    return float(len(way) * spin(step) - step.direction * way.sum())


@term(-1)
def climb(step: Step) -> float:
    """Return the squared height above where the episode began [m^2]. Not in the paper, as all that follow.

    A cube that climbs into the hand runs with its upper edge against links that are no fingertips.
    """
    return max(step.after.z - step.first.z, 0.0) ** 2


@term(-1)
def link_spin(step: Step) -> float:
    """Return the rotation in a step at whose end another link than a fingertip touches the object [rad].

    With a weight below that of `spin` a hand that rests has nothing to gain by it.
    """
    return max(spin(step), 0.0) * links(step)


@term(+1)
def tips(step: Step) -> float:
    """Return 1 if three or more fingertips touch the object at the end of the step, else 0."""
    return float(int((step.forces[1] > TOUCH_FORCE).sum()) >= SUPPORTING_TIPS)


@term(-1)
def links(step: Step) -> float:
    """Return 1 if a link other than a fingertip touches the object at the end of the step, else 0."""
    return float((step.forces[0] > TOUCH_FORCE).any())


@term(-1)
def link_force(step: Step) -> float:
    """Return the share of these links in the normal force; 0 without any."""
    total = float(step.forces.sum())
    return float(step.forces[0].sum()) / total if total > 0.0 else 0.0


PUBLISHED = {
    "spin": 16.0,  # lambda_spin [1/rad]
    "height": 100.0,  # lambda_z [1/m]
    "plane": 300.0,  # lambda_plane [1/m]
    "tilt": 50.0,  # lambda_rot [1/rad]
    "proximal": 25.0,  # lambda_proxy [1/rad^4]
    "off_centre": 0.0,  # [1/m^2]
    "leaving": 10.0,  # size not published
    "advance": 0.0,  # [1/rad]
}
"""Source: website, table of the reward."""


@dataclass(frozen=True, init=False)
class Reward:
    """Weights of the terms by name, all given as positive numbers: `Reward(tips=0.2)` adds one to the published ones.

    All terms that are named are measured, also with a weight of 0: so runs with other weights can take over a replay.

    Attributes:
        weight: by term, in the order of `TERMS`.
        fastest: rotation above this rate earns nothing more [rad/s].
    """

    weight: dict[str, float]
    fastest: float

    def __init__(self, fastest: float = 1.0, **weights: float):
        """Refuse unknown terms and invalid weights."""
        given = PUBLISHED | weights
        for key, value in (given | {"fastest": fastest}).items():
            if key not in (*TERMS, "fastest"):
                raise InputError(f"reward.{key[:40]}: no such term; there are {', '.join(TERMS)}")
            if not isinstance(value, (int, float)) or not (math.isfinite(value) and value >= 0.0):
                raise InputError(f"reward.{key} is {value}; give a finite weight >= 0 (signs are built in)")
        object.__setattr__(self, "weight", {name: given[name] for name in TERMS if name in given})
        object.__setattr__(self, "fastest", fastest)

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of the terms that are measured, in their order."""
        return tuple(self.weight)

    def measure(self, step: Step) -> NDArray[np.float64]:
        """Return the terms of a step before weighting, in the order of `terms`."""
        return np.array([TERMS[name].measure(step) for name in self.weight])

    def weights(self, penalty_scale: float = 1.0) -> NDArray[np.float32]:
        """Return the signed weights in the order of `terms`: reward = reward_terms @ weights.

        Args:
            penalty_scale: factor on height, plane and tilt, from the curriculum.
        """
        known = [(TERMS[name], weight) for name, weight in self.weight.items()]
        signed = [one.sign * (penalty_scale if one.scaled else 1.0) * weight for one, weight in known]
        return np.array(signed, dtype=np.float32)
