"""What a decision asks of an explanation beside its fit, answered by simulations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.intervals import Fitted, final_fit
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.search.evidence import Judgement
from tactile_cube.identification.search.explanation import Explanation
from tactile_cube.identification.search.residual_shape import Shape, black_box, missing_torques, shapes
from tactile_cube.identification.search.search import Search
from tactile_cube.identification.verdict import Questions, unexplained_joints
from tactile_cube.measurement.comparing.error import ErrorSummary, free_run_error
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor
from tactile_cube.measurement.replay.model import Model
from tactile_cube.measurement.replay.simulator import Engine, free_run

SHOWN_SHAPES = 6


@dataclass(frozen=True)
class Unexplained:
    """What is left at a joint.

    Attributes:
        joint: its name.
        shapes: the missing torque over signals, most telling first.
        black_box: share of the rest that a black box could still explain beside the recommended model.
        explained: share of the torque missing beside the base model that the recommended model accounts for.
    """

    joint: str
    shapes: list[Shape] = field(repr=False)
    black_box: float
    explained: float = 0.0

    @property
    def of_explainable(self) -> float:
        """Share that the effects explain of what they and a black box explain together."""
        together = self.explained + (1.0 - self.explained) * self.black_box
        return self.explained / together if together > 0.0 else 0.0


class Simulations(Questions):
    """Answers what a decision asks of an explanation, each question once."""

    def __init__(self, search: Search, base: Explanation, floor: NoiseFloor, engine: Engine, step: float) -> None:
        self.search, self.base, self.floor, self.engine, self.step = search, base, floor, engine, step
        self.problem = Problem(search.shooting, search.all_windows)
        self._final: dict[str, Fitted] = {}
        self._errors: dict[str, ErrorSummary] = {}

    def as_repeats(self, one: Explanation) -> bool:
        """See `Questions`."""
        most = self.search.criteria.adequate * self.floor.overall
        return self.floor.source == "repeats" and self.free_error(one).overall <= most

    def follows_signals(self, one: Explanation) -> bool:
        """See `Questions`."""
        return follows_signals(self.unexplained(one), self.search.criteria)

    def alike(self, one: Explanation, other: Explanation) -> bool:
        """See `Questions`."""
        validation = self.search.validation
        first, second = validation.predictions([one.judgement.model, other.judgement.model])
        difference = validation.limited(first - second) * validation.weight
        return bool(np.mean(difference[validation.weight > 0.0] ** 2) < self.search.criteria.alike**2)

    def final(self, one: Explanation) -> Fitted:
        """An explanation refitted on all fitted trials, with intervals."""
        if one.label not in self._final:
            self._final[one.label] = final_fit(self.problem, one.fit.model, self.search.unknowns(one.fit.model))
        return self._final[one.label]

    def free_error(self, one: Explanation) -> ErrorSummary:
        """Error of its free run on the held-out trials [rad]."""
        if one.label not in self._errors:
            self._errors[one.label] = self.simulated_error(one)
        return self._errors[one.label]

    def simulated_error(self, one: Explanation) -> ErrorSummary:
        """The same, simulated anew."""
        model = with_offsets(self.final(one).model, one.judgement.model)
        return free_run_error(self.search.held_out, free_run(self.search.held_out, model, self.engine, self.step))

    def unexplained(self, one: Explanation, beside_base: bool = False) -> list[Unexplained]:
        """What is left at each joint that is not explained; `beside_base`, also beside the base model.

        Effects that help and are not the cause blur the shape of what is missing.
        """
        search = self.search
        joints = unexplained_joints(one, search.fitted.joints, search.criteria)
        judgements = {"the recommended model": one.judgement}
        judgements["the model with refitted constants"] = self.base.judgement
        return _unexplained(search, joints, judgements, beside_base) if joints else []


def follows_signals(unexplained: Sequence[Unexplained], criteria: Criteria = STANDARD) -> bool:
    """Whether what is left is a function of the signals, and so no noise: what was named is not the whole of it."""
    return any(one.black_box > criteria.large_gain for one in unexplained)


def with_offsets(model: Model, judged: Model) -> Model:
    """The final model with the joint offsets that were found for the held-out initialisations."""
    return Model(model.constants, model.terms, {**judged.offsets, **model.offsets})


def _unexplained(
    search: Search, joints: Sequence[str], beside: Mapping[str, Judgement], beside_base: bool
) -> list[Unexplained]:
    missing = {
        name: missing_torques(search.validation, search.held_out, judged.model, judged.residual)
        for name, judged in beside.items()
    }
    recommended, base = missing.values()
    found = []
    for j, joint in enumerate(search.fitted.joints):
        if joint in joints:
            shown = missing.items() if beside_base else [*missing.items()][:1]
            curves = [[replace(one, beside=name) for one in shapes(torques[j])] for name, torques in shown]
            clearest = max(curves, key=lambda curve: curve[0].explained)
            explained = 1.0 - recommended[j].torque.var() / max(base[j].torque.var(), 1e-30)
            left = black_box(recommended[j])
            found.append(Unexplained(joint, clearest[:SHOWN_SHAPES], left, max(0.0, float(explained))))
    return found
