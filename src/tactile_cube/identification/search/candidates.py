"""What may be missing: every effect in every form, at one joint or at all, with values to start from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.identification.fitting.model import Model, Term, Unknown
from tactile_cube.measurement.recordings.recording import Recording

Array = NDArray[np.float64]
EffectClass = type[Effect]
MOST_SHOWN = 4  # fitted parameters that a label lists
USUAL, SELDOM, OFTEN = 0.9, 0.999, 0.5  # quantiles of the torques that a recording asks for
LEVELS = 9  # between often and seldom, by equal factors, where a saturation starts
CUBIC = (0.01, 0.1, 1.0)  # parts of the usual torque at which a cubic spring takes over
DEAD = (0.1, 0.4)  # parts of the usual torque at which a dead zone of the torque starts


@dataclass(frozen=True)
class Candidate:
    """One effect in one form at one or more joints.

    Attributes:
        effect: its class.
        joints: where it acts.
        form: parameters that are fitted, and their starts.
    """

    effect: EffectClass
    joints: tuple[str, ...]
    form: Mapping[str, float]

    @property
    def label(self) -> str:
        """Readable and unique: `backlash(play)@q2`."""
        fitted = ", ".join(self.form) if len(self.form) <= MOST_SHOWN else f"{len(self.form)} values"
        return f"{self.effect.name}({fitted})@{'+'.join(self.joints)}"

    @property
    def size(self) -> int:
        """Fitted numbers."""
        return len(self.form) * len(self.joints)

    def added_to(self, model: Model, values: Mapping[str, float] | None = None) -> tuple[Model, tuple[Unknown, ...]]:
        """The model with the effect at its start (or at `values`), and the unknowns that this adds."""
        known = {p.name: p.neutral for p in self.effect.parameters} | dict(self.form) | dict(values or {})
        terms = tuple(Term(self.effect, joint, known, tuple(self.form)) for joint in self.joints)
        first = len(model.terms)
        unknowns = tuple(u for k, term in enumerate(terms) for u in term_unknowns(term, first + k, self.form))
        return replace(model, terms=(*model.terms, *terms)), unknowns


def term_unknowns(term: Term, place: int, form: Mapping[str, float]) -> tuple[Unknown, ...]:
    """The unknowns of a term; where a parameter does not say otherwise, the size of its start is the scale."""
    parameters = {p.name: p for p in term.effect.parameters}
    sizes = {name: abs(form.get(name, 0.0)) or abs(parameters[name].typical) for name in term.fitted}
    fallback = max([size for size in sizes.values() if size > 0.0], default=1.0)
    return tuple(
        Unknown("effect", name, place, p.low, p.high, p.scale or sizes[name] or fallback)
        for name, p in ((name, parameters[name]) for name in term.fitted)
    )


def model_unknowns(model: Model) -> tuple[Unknown, ...]:
    """The unknowns of all effects that a model has."""
    return tuple(
        u
        for place, term in enumerate(model.terms)
        for u in term_unknowns(term, place, {k: v for k, v in term.values.items() if abs(v) < 1e6})
    )


def forms(effect: EffectClass) -> tuple[Mapping[str, float], ...]:
    """The forms of an effect; all its parameters at their typical values if it names none."""
    return effect.forms or ({p.name: p.typical for p in effect.parameters},)


def candidates(recording: Recording, effects: Sequence[EffectClass]) -> list[Candidate]:
    """Every effect in every form at every single joint where it can act."""
    seen = [_Seen(recording, j) for j in range(len(recording.joints))]
    return [
        Candidate(effect, (joint,), start)
        for effect in effects
        for j, joint in enumerate(recording.joints)
        if _possible(effect, recording, joint)
        for form in forms(effect)
        if "harmonic" not in form and "torque_0" not in form  # those start from the residual: see residual_starts
        for start in (*_starts(effect.name, form, seen[j]), *_mirrored(effect, form))
    ]


def _possible(effect: EffectClass, recording: Recording, joint: str) -> bool:
    if effect.name == "coupling_error":
        return any(coupling.joint == joint for coupling in recording.coupled.values())
    if effect.name in ("torque_crosstalk", "joint_coupling"):
        return len(recording.joints) > 1
    return True


class _Seen:
    """What a recording shows of a joint, to place thresholds where they matter."""

    def __init__(self, recording: Recording, joint: int) -> None:
        self.position = np.concatenate([trial.position[:, joint] for trial in recording.trials])
        self.low, self.high = np.quantile(self.position, [0.002, 0.998])
        speeds = [np.abs(np.diff(trial.command[:, joint])) / trial.step for trial in recording.trials]
        self.command_speed = float(np.quantile(np.concatenate(speeds), 0.995))
        if recording.torque_controlled:
            torques = [np.abs(trial.command[:, joint]) for trial in recording.trials]
        else:
            kp, kd = recording.gains.kp[joint], recording.gains.kd[joint]
            torques = [
                np.abs(kp * (trial.command - trial.position)[:, joint] - kd * trial.velocity()[:, joint])
                for trial in recording.trials
            ]
        often, usual, seldom = np.maximum(np.quantile(np.concatenate(torques), (OFTEN, USUAL, SELDOM)), 1e-6)
        self.torques, self.usual_torque = np.geomspace(often, seldom, LEVELS), float(usual)

    def cubic_stiffness(self, compliance: float) -> list[float]:
        """Stiffness [N m/rad^3] of a cubic spring that bends as far as a linear one at parts of the usual torque."""
        return [float(1.0 / (compliance**3 * (part * self.usual_torque) ** 2)) for part in CUBIC]


def _starts(name: str, form: Mapping[str, float], seen: _Seen) -> list[Mapping[str, float]]:
    span = seen.high - seen.low
    if name == "torque_saturation":
        return [{"limit": float(level)} for level in seen.torques]
    if name == "command_dead_zone" and "torque" in form:
        return [{"torque": share * seen.usual_torque} for share in DEAD]
    if name == "rate_limit":
        return [{"speed": share * seen.command_speed} for share in (0.8, 0.4, 0.15)]
    if name == "stiffening_elasticity":
        # the cubic part is as large as the linear one at a part of, at about, or only beyond what is seen
        return [{**form, "cubic": cubic} for cubic in seen.cubic_stiffness(form["compliance"])]
    if name == "joint_stop":
        side, edge = ("upper", seen.high) if "upper" in form else ("lower", seen.low)
        sign = 1.0 if side == "upper" else -1.0
        return [{**form, side: edge - sign * share * span} for share in (0.03, 0.12, 0.3)]
    return [form]


def _mirrored(effect: EffectClass, form: Mapping[str, float]) -> list[Mapping[str, float]]:
    """The form with the other sign of its first size that may have either, where a first look cannot turn it about.

    A first look scales a whole effect; with several numbers the sign of one of them is not that of the whole.
    """
    signed = [p.name for p in effect.parameters if p.neutral == 0.0 and p.low < 0.0 and form.get(p.name)]
    return [{**form, signed[0]: -form[signed[0]]}] if signed and len(form) > 1 else []


def placed(candidate: Candidate, recording: Recording) -> dict[str, float]:
    """Values of parameters that the recording sets: the range of a position-dependent torque."""
    if candidate.effect.name != "position_torque":
        return {}
    first, last = position_range(recording, candidate.joints[0])
    return {"first": first, "last": last}


def position_range(recording: Recording, joint: str) -> tuple[float, float]:
    """Lowest and highest angle of a joint, but for a few samples [rad]."""
    seen = _Seen(recording, recording.joints.index(joint))
    return float(seen.low), float(seen.high)
