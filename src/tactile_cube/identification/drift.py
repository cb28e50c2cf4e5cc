"""What has changed between two identifications of one machine: every number that both know, with its interval."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import stats

from tactile_cube.drivetrain.model_file import Estimate, ModelFile
from tactile_cube.identification.fitting.intervals import NORMAL_95


@dataclass(frozen=True)
class Drift:
    """One number of a model, before and now.

    Attributes:
        name: `PARAMETER@JOINT`, or `EFFECT@JOINT: PARAMETER`.
        before: of the reference.
        now: of the newest recording.
    """

    name: str
    before: Estimate
    now: Estimate

    @property
    def difference(self) -> float:
        """Now less before, in the parameter's unit."""
        return self.now.value - self.before.value

    @property
    def half_width(self) -> float:
        """Of the 95 % interval of the difference: two recordings err independently."""
        halves = [0.5 * (one.high - one.low) for one in (self.before, self.now)]
        return float(np.hypot(halves[0], halves[1]))

    @property
    def p_value(self) -> float:
        """Probability of a difference as large if nothing has changed."""
        return float(2.0 * stats.norm.sf(NORMAL_95 * abs(self.difference) / self.half_width))


def drifts(before: ModelFile, now: ModelFile) -> list[Drift]:
    """Every number with an interval in both models, the least probable difference first.

    Joint offsets are left out: they are others after each initialisation of a robot.
    """
    known = dict(_estimates(before))
    pairs = [Drift(name, known[name], one) for name, one in _estimates(now) if name in known]
    return sorted((one for one in pairs if one.half_width > 0.0), key=lambda one: one.p_value)


def changed(found: list[Drift], significance: float) -> list[Drift]:
    """Those that are no chance; `significance` holds for all of them together (Bonferroni)."""
    return [one for one in found if one.p_value * len(found) < significance]


def _estimates(model: ModelFile) -> Iterator[tuple[str, Estimate]]:
    for key, joints in model.values.items():
        yield from ((f"{key}@{joint}", one) for joint, one in joints.items() if one.high > one.low)
    for effect in model.drive_effects:
        yield from ((f"{effect.effect}: {key}", one) for key, one in effect.parameters.items() if one.high > one.low)
