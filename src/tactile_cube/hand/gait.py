"""A scripted gait: fingertips walk on a circle around the cube, some hold while the others go back.

The paper compares with a hand-crafted trajectory (11 rad, then the cube drops). This one follows a clock and feels
nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from tactile_cube.errors import InputError
from tactile_cube.hand.hand import Hand
from tactile_cube.hand.urdf import Array

PLACES = np.radians([-90.0, 0.0, 90.0, 180.0])
"""Where ring, middle, fore and thumb of the DLR-Hand II stand around the cube."""
SEARCH_KEYS = ("name", "steps", "cpu_hours", "wall_hours", "commit")
"""Keys that describe the search behind a range of gaits."""


def places(hand: Hand) -> Array:
    """Return the azimuths of the fingers of a hand around the object (fingers,) [rad]."""
    return np.array([np.arctan2(finger.face[1], finger.face[0]) for finger in hand.fingers])


@dataclass(frozen=True)
class Gait:
    """Parameters of a scripted gait.

    The defaults were found by cross-entropy searches at full weight, T_s 0.25 and 0.5 s, and the published 0.1 m of
    spinning friction; `python -m benchmarks.gait` searches again. About -z is what this hand pose turns best.

    Attributes:
        swing: a finger walks from +swing to -swing about its place, and back in the air, to turn the cube in -z [rad].
        shift: of the middle of the swing from the finger's place [rad].
        period: policy steps of a cycle.
        air_share: part of the cycle in which a finger is in the air.
        pressed: distance of a holding tip's target from the vertical axis; 54 mm would just touch the faces [m].
        lifted: the same in the air [m].
        height: of the tips' targets over the middle of the cube [m].
        closing: policy steps in which all fingers close around the cube before they begin to walk.
        phases: part of the cycle by which each finger is ahead; here, of four, opposing ones move together.
    """

    swing: float = 0.82
    shift: float = -0.15
    period: int = 54
    air_share: float = 0.34
    pressed: float = 0.046
    lifted: float = 0.0954
    height: float = 0.009
    closing: int = 6
    phases: tuple[float, ...] = (0.0, 0.5, 0.0, 0.5)

    def __post_init__(self) -> None:
        for key, value in vars(self).items():
            for number in value if key == "phases" else (value,):
                if not (isinstance(number, int | float) and math.isfinite(number)):
                    raise InputError(f"gait.{key} is {value!r}; give finite numbers")
        if not (self.period >= 1 and 0.0 < self.air_share < 1.0):
            raise InputError(
                f"gait.period is {self.period}, air_share is {self.air_share}; give at least 1, and a share of 0 to 1"
            )

    def of(self, hand: Hand) -> Gait:
        """Return this gait for a hand; if its fingers and the phases differ in number, they move back in turn."""
        fingers = len(hand.fingers)
        if fingers == len(self.phases):
            return self
        return replace(self, phases=tuple(finger / fingers for finger in range(fingers)))

    def tips(self, step: int, direction: int = -1, around: Array = PLACES) -> Array:
        """Return the targets of the fingertips `(fingers, 3)` [m] at a policy step; direction +1 turns about +z.

        `around` (fingers,) [rad] is where the fingers stand, see `places`.
        """
        holding = 1.0 - self.air_share
        cycle = ((step - self.closing) / self.period + np.array(self.phases)) % 1.0
        phase = cycle if step >= self.closing else np.zeros(len(around))
        on_cube = phase < holding
        forth = 1.0 - 2.0 * phase / holding
        back = -1.0 + 2.0 * (phase - holding) / self.air_share
        walk = -direction * self.swing * np.where(on_cube, forth, back) * (step >= self.closing)
        angle, radius = around - direction * self.shift + walk, np.where(on_cube, self.pressed, self.lifted)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(len(around), self.height)], axis=1)

    def action(self, hand: Hand, step: int, direction: int = -1) -> Array:
        """Return the action `(joints,)` in [-1, 1] of a policy step."""
        return hand.action_of(hand.angles_at(self.of(hand).tips(step, direction, places(hand))[None])[0])

    def actions(self, hand: Hand, steps: int, direction: int = -1) -> Array:
        """Return the actions `(steps, joints)` of an episode; a cycle's inverse kinematics is solved once."""
        gait, around = self.of(hand), places(hand)
        tips = [gait.tips(step, direction, around) for step in range(min(steps, self.closing + self.period))]
        first = hand.action_of(hand.angles_at(np.array(tips)))
        cycle = self.closing + (np.arange(steps) - self.closing) % self.period
        return first[np.where(np.arange(steps) < self.closing, np.arange(steps), cycle)]


@dataclass(frozen=True)
class GaitRanges:
    """Ranges of gaits that perform alike: each parameter lies between two bounds.

    Attributes:
        low: the smallest of each number, by the names of `Gait`.
        high: the largest.
        phases: of every one of them.
        search: what the search for them cost, for the cards of the policies that they teach: `name` of its folder,
            `steps` of the environment, `cpu_hours`, `wall_hours` and `commit`, as far as they were recorded.
    """

    low: Mapping[str, float]
    high: Mapping[str, float]
    phases: tuple[float, ...] = Gait.phases
    search: Mapping[str, float | str] | None = None

    def __post_init__(self) -> None:
        known = {field.name for field in fields(Gait)} - {"phases"}
        for name in {*self.low, *self.high}:
            if name not in known or name not in self.low or name not in self.high:
                raise InputError(f"exploration.gaits.{name}: give low and high for one of {', '.join(sorted(known))}")
            if self.low[name] > self.high[name]:
                raise InputError(f"exploration.gaits.{name}: low {self.low[name]} is above high {self.high[name]}")
        for name in set(self.search or {}) - set(SEARCH_KEYS):
            raise InputError(f"exploration.gaits.search.{name}: not one of {', '.join(SEARCH_KEYS)}")

    def draw(self, rng: np.random.Generator) -> Gait:
        """Draw one of them, all equally likely."""
        values = {name: rng.uniform(low, self.high[name]) for name, low in self.low.items()}
        whole = {name: round(values[name]) for name in ("period", "closing") if name in values}
        return Gait(**values | whole, phases=tuple(self.phases))  # type: ignore[arg-type]


def similar_gaits(hand: Hand, ranges: GaitRanges, number: int, steps: int, direction: int, seed: int = 0) -> Array:
    """Return actions `(number, steps, joints)` of gaits drawn from ranges."""
    rng = np.random.default_rng(seed)
    return np.stack([ranges.draw(rng).actions(hand, steps, direction) for _ in range(number)])
