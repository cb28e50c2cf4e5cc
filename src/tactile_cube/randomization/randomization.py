"""What differs from episode to episode: constants, start and disturbances, drawn from distributions that are values.

A distribution is known by its quantile function, so one uniform number drawn anywhere (numpy in a world, torch in a
transform) becomes one draw.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects import Effect, Stage, resolve
from tactile_cube.drivetrain.effects.catalogue import matching_joints, named_joints
from tactile_cube.drivetrain.model_file import Estimate, ModelFile
from tactile_cube.errors import InputError, warn
from tactile_cube.simulation import EpisodeConstants
from tactile_cube.simulation.contact_effects import contact_catalogue

Array = NDArray[np.float64]


@runtime_checkable
class Distribution(Protocol):
    """A random quantity, given by its quantile function."""

    def quantile(self, u: Array) -> Array:
        """Return the values below which the fractions `u` in [0, 1) of all draws lie, same shape as `u`."""


def sample(distribution: Distribution, rng: np.random.Generator, shape: tuple[int, ...] = ()) -> Array:
    """Return independent draws of `shape`."""
    return distribution.quantile(rng.random(shape))


@dataclass(frozen=True)
class Constant:
    """Always `value`."""

    value: float

    def quantile(self, u: Array) -> Array:
        """Return `value` in the shape of `u`."""
        return np.full(np.shape(u), self.value)


@dataclass(frozen=True)
class Uniform:
    """Equally likely everywhere in [low, high)."""

    low: float
    high: float

    def __post_init__(self) -> None:
        if not self.low <= self.high:
            raise InputError(f"Uniform: low {self.low} is above high {self.high}; give low <= high")

    def quantile(self, u: Array) -> Array:
        """Return the quantile, linear between the bounds."""
        return self.low + (self.high - self.low) * np.asarray(u)


@dataclass(frozen=True)
class UniformPerJoint:
    """Equally likely between bounds of each joint's own, low (joints,) and high (joints,)."""

    low: tuple[float, ...]
    high: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.low) != len(self.high) or not np.all(np.asarray(self.low) <= np.asarray(self.high)):
            raise InputError(f"UniformPerJoint: low {self.low} and high {self.high}; give low <= high for each joint")

    def quantile(self, u: Array) -> Array:
        """Return the quantile, linear between the bounds; the last axis of `u` is the joints'."""
        low, high = np.asarray(self.low), np.asarray(self.high)
        return np.asarray(low + (high - low) * np.asarray(u))


@dataclass(frozen=True)
class Choice:
    """One of `values`, all equally likely."""

    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if not len(self.values):
            raise InputError("Choice: values is empty; give at least one number")

    def quantile(self, u: Array) -> Array:
        """Return the value in whose equal share of [0, 1) each number of `u` lies."""
        values = np.asarray(self.values, dtype=np.float64)
        return np.asarray(values[(np.asarray(u) * len(values)).astype(np.int64)])


@dataclass(frozen=True)
class LogUniform:
    """Equally likely in every factor: the logarithm is uniform in [log low, log high)."""

    low: float
    high: float

    def __post_init__(self) -> None:
        if not 0.0 < self.low <= self.high:
            raise InputError(f"LogUniform: needs 0 < low <= high, got low {self.low}, high {self.high}")

    def quantile(self, u: Array) -> Array:
        """Return the quantile, geometric between the bounds."""
        return np.asarray(self.low * (self.high / self.low) ** np.asarray(u), dtype=np.float64)


@dataclass(frozen=True)
class EffectRange:
    """One effect at one joint, e.g. `ring_q2`; each episode draws its parameters, in SI units.

    Not for effects that change the mechanism, whose bodies are built once.
    """

    effect: type[Effect]
    joint: str
    parameters: Mapping[str, Distribution]

    def draw(self, rng: np.random.Generator) -> Effect:
        """Draw the effect of one episode."""
        return self.effect(self.joint, **{key: float(sample(one, rng)) for key, one in self.parameters.items()})


PARTS = 8  # equally likely parts of the range of each constant
RATE = 0.05  # weight of one more episode: a part remembers its last twenty or so


class Learnability:
    """The share of cubes lost in each part of the range of each constant.

    A part is drawn in proportion to p (1 - p), where p is that share: little where the policy holds every cube already
    or cannot hold one yet. So the worlds widen as it masters them, and what it has mastered makes room. The rest of
    the draws is uniform. Source: Rutherford et al., *No Regrets: Investigating and Improving Regret Approximations for
    Curriculum Discovery* (sampling for learnability), NeurIPS 2024; there for whole levels, here for each constant.

    Attributes:
        ranges: names of the constants, and what they are drawn from.
        share: part of the draws that follow p (1 - p).
        lost: the share p `(constants, PARTS)`; one half where nothing is known.
    """

    def __init__(self, ranges: Mapping[str, Distribution], share: float):
        self.ranges, self.share = dict(ranges), share
        self.lost: Array = np.full((len(self.ranges), PARTS), 0.5)

    def add(self, places: Array, lost: NDArray[np.bool_]) -> None:
        """Take over episodes `(n,)`: where in the ranges their constants lay `(n, constants)`, each in [0, 1)."""
        rows = np.arange(len(self.ranges))
        for place, one in zip(places, lost, strict=True):
            parts = np.minimum((place * PARTS).astype(np.int64), PARTS - 1)
            self.lost[rows, parts] += RATE * (float(one) - self.lost[rows, parts])

    @property
    def odds(self) -> Array:
        """Probability of each part `(constants, PARTS)`; rows sum to 1."""
        score = self.lost * (1.0 - self.lost) + 1e-6
        return np.asarray(self.share * score / score.sum(axis=1, keepdims=True) + (1.0 - self.share) / PARTS)


def drawn_places(odds: Array, rng: np.random.Generator) -> Array:
    """Draw each constant's place in its range `(constants,)` in [0, 1), with the probabilities `odds` of its parts."""
    parts = [int(rng.choice(PARTS, p=row)) for row in odds]
    return np.asarray((np.array(parts) + rng.random(len(odds))) / PARTS)


DRAWN_ONCE = ("cube_size",)
"""Constants with several numbers that share one draw: a cube stays a cube. All others are drawn per joint."""

FIELDS = tuple(f.name for f in dataclasses.fields(EpisodeConstants))


@dataclass(frozen=True)
class Randomization:
    """Distributions of everything that an episode draws.

    The three mappings have a field of EpisodeConstants as key; vectors over the joints are drawn joint by joint.

    Attributes:
        values: what replaces a constant.
        factors: what multiplies a constant.
        shifts: what is added to a constant.
        effects: effects of the drivetrain that draw their numbers; the world must have them.
        cube_position: distributions (3,) of the cube's displacement at the start [m].
        cube_rotation: distributions (3,) of its rotation about x, y, z at the start [rad].
        start_angles: distribution of each joint's displacement at the start [rad].
        joint_offset: distribution of each encoder's zero error [rad].
        sensor_noise: standard deviation of the noise on q_m [rad].
        sticky_probability: probability that a step repeats the previous action.
        steered: part of the episodes whose `values` are drawn by what a policy can learn from (`Learnability`).
    """

    values: Mapping[str, Distribution] = field(default_factory=dict)
    factors: Mapping[str, Distribution] = field(default_factory=dict)
    shifts: Mapping[str, Distribution] = field(default_factory=dict)
    effects: Sequence[EffectRange] = ()
    cube_position: tuple[Distribution, ...] = (Constant(0.0),) * 3
    cube_rotation: tuple[Distribution, ...] = (Constant(0.0),) * 3
    start_angles: Distribution = field(default_factory=lambda: Constant(0.0))
    joint_offset: Distribution = field(default_factory=lambda: Constant(0.0))
    sensor_noise: float = 0.0
    sticky_probability: float = 0.0
    steered: float = 0.0

    def __post_init__(self) -> None:
        for group in ("values", "factors", "shifts"):
            for key, drawn in getattr(self, group).items():
                if key not in FIELDS:
                    raise InputError(f"randomization.{group}.{key}: no such constant; choose from {', '.join(FIELDS)}")
                _require_distribution(f"{group}.{key}", drawn)
        for group in ("cube_position", "cube_rotation"):
            if len(getattr(self, group)) != 3:
                raise InputError(f"randomization.{group} has {len(getattr(self, group))} entries; give 3, for x, y, z")
            for index, drawn in enumerate(getattr(self, group)):
                _require_distribution(f"{group}.{index}", drawn, one=True)
        for group in ("start_angles", "joint_offset"):
            _require_distribution(group, getattr(self, group))
        for key, end in (("sensor_noise", np.inf), ("sticky_probability", 1.0), ("steered", 1.0)):
            if not 0.0 <= getattr(self, key) < end:
                raise InputError(f"randomization.{key} is {getattr(self, key)}; give a number in [0, {end:g})")

    def learnability(self, nominal: EpisodeConstants) -> Learnability:
        """Return the initial `Learnability` of the `values` of one number each; of none unless `steered`."""
        single = {k: d for k, d in self.values.items() if k in DRAWN_ONCE or not np.shape(getattr(nominal, k))}
        return Learnability(single if self.steered else {}, self.steered)

    def constants(
        self, nominal: EpisodeConstants, rng: np.random.Generator, places: Mapping[str, float] | None = None
    ) -> EpisodeConstants:
        """Draw the constants of one episode around `nominal`; `places`: where in [0, 1) of its range a value lies."""
        known = places or {}
        changed: dict[str, Any] = {}
        groups: Any = ((self.values, None), (self.factors, np.multiply), (self.shifts, np.add))
        for group, combine in groups:
            for key, distribution in group.items():
                value = changed.get(key, getattr(nominal, key))
                if value is None:
                    raise InputError(f"randomization of {key}: the nominal value is None, there is nothing to vary")
                shape = () if key in DRAWN_ONCE else np.shape(value)
                given = group is self.values and key in known
                drawn = distribution.quantile(np.array(known[key])) if given else sample(distribution, rng, shape)
                combined = combine(value, drawn) if combine else np.broadcast_to(drawn, np.shape(value))
                changed[key] = float(combined) if np.ndim(combined) == 0 else np.array(combined, dtype=np.float64)
        changed["force_seed"] = int(rng.integers(2**31))
        changed["effects"] = tuple(effect.draw(rng) for effect in self.effects)
        return dataclasses.replace(nominal, **changed)


def _require_distribution(place: str, drawn: Any, one: bool = False) -> None:
    if not isinstance(drawn, Distribution):
        raise InputError(f"randomization.{place} is {drawn!r}; give a distribution, such as Uniform")
    if one and np.shape(drawn.quantile(np.array(0.5))):
        raise InputError(f"randomization.{place} is {drawn!r}; give a distribution of one number")


UNSEEN = 1e-4  # [rad] span of the offsets below which they were not observed: an axis along gravity shows none
PER_JOINT = ("kp", "kd", "stiffness", "static_friction", "reflected_inertia", "friction_creep")


def identified(
    model: ModelFile, constants: EpisodeConstants, randomization: Randomization, joints: Sequence[str]
) -> tuple[EpisodeConstants, Randomization, list[Effect]]:
    """Return the identified hand: fitted values as nominal ones, intervals as ranges, effects added.

    A model of one finger (q1, q2, q3) applies to all four, that of a single servo to every joint. Constants that were
    fitted are drawn from their intervals; those that were not keep the relative range of `randomization` around the
    model's value. What is infinite in the model, as of a rigid rig without a limit, stays the hand's own.

    `joints` are the hand's, in the order of the constants' vectors.

    Raises:
        InputError: joints, effects or limits that the hand does not have.
    """
    model = of_every_joint(model.of_a_hand(), joints)
    nominal: dict[str, Any] = {key: np.array(getattr(constants, key)) for key in PER_JOINT}
    ranges: dict[str, Distribution] = dict(randomization.values)
    factors, shifts = dict(randomization.factors), dict(randomization.shifts)
    for key in PER_JOINT:
        if key not in model.values:
            continue
        low, nominal[key], high = _on_joints(model.values[key], nominal[key], joints)
        if np.any(high > low):
            ranges[key] = UniformPerJoint(tuple(low), tuple(high))
            factors.pop(key, None)
            shifts.pop(key, None)
    limits = {estimate.value for estimate in model.values.get("torque_limit", {}).values()}
    if len(limits) > 1:
        raise InputError(f"model of {model.rig}: torque limits {sorted(limits)} N m differ; the hand has one for all")
    limit = min(limits, default=constants.torque_limit)

    def drawn(estimate: Estimate) -> Distribution:
        return Uniform(estimate.low, estimate.high) if estimate.high > estimate.low else Constant(estimate.value)

    placed = [(one, *place) for one in model.drive_effects for place in resolve([one.effect], joints)]
    changed = dataclasses.replace(
        randomization,
        values=ranges,
        factors=factors,
        shifts=shifts,
        effects=[
            EffectRange(effect, joint, {key: drawn(estimate) for key, estimate in one.parameters.items()})
            for one, effect, joint in placed
            if effect.stage is not Stage.MECHANISM
        ],
        joint_offset=_offsets(model, randomization.joint_offset, joints),
    )
    effects = [effect(joint, **{k: e.value for k, e in one.parameters.items()}) for one, effect, joint in placed]
    known = dataclasses.replace(constants, torque_limit=limit, **nominal)
    return *identified_contact(model, known, changed), effects


def of_every_joint(model: ModelFile, joints: Sequence[str]) -> ModelFile:
    """Return the model of a single servo, identified on a bench, as that of each joint of a hand; others as they are.

    Its offset is that unit's own and is left out.
    """
    if len(model.joints) != 1 or named_joints(model.joints[0], joints):
        return model
    (servo,) = model.joints
    warn(f"model of '{servo}', which the hand does not have: taken for the drive of each of its {len(joints)} joints")
    effects = [
        one.model_copy(update={"effect": f"{one.name}@{joint}"}) for one in model.drive_effects for joint in joints
    ]
    return model.model_copy(
        update={
            "joints": list(joints),
            "values": {key: dict.fromkeys(joints, row[servo]) for key, row in model.values.items()},
            "effects": [*effects, *model.object_effects],
            "offsets": {},
        }
    )


def identified_contact(
    model: ModelFile, constants: EpisodeConstants, randomization: Randomization
) -> tuple[EpisodeConstants, Randomization]:
    """Return fingertips and object that were identified: values in place of nominal ones, intervals in place of ranges.

    What a model says of an object is how it differs from what was stated of it; the same is put on the world's object.
    """
    values, shifts, factors = dict(randomization.values), dict(randomization.shifts), dict(randomization.factors)
    for one in model.object_effects:
        effect = contact_catalogue()[one.name]
        constants = effect.apply(constants, {key: estimate.value for key, estimate in one.parameters.items()})
        estimates = [one.parameters[p.name] for p in effect.parameters if p.name in one.parameters]
        if len(estimates) < len(effect.parameters) or not any(e.high > e.low for e in estimates):
            continue
        for group in (values, shifts, factors):
            group.pop(effect.constant, None)
        centre = [e.value if effect.added else 0.0 for e in estimates]
        low = tuple(e.low - c for e, c in zip(estimates, centre, strict=True))
        high = tuple(e.high - c for e, c in zip(estimates, centre, strict=True))
        interval: Distribution = Uniform(low[0], high[0]) if len(low) == 1 else UniformPerJoint(low, high)
        (shifts if effect.added else values)[effect.constant] = interval
    return constants, dataclasses.replace(randomization, values=values, shifts=shifts, factors=factors)


def _on_joints(estimates: Mapping[str, Estimate], nominal: Array, joints: Sequence[str]) -> tuple[Array, Array, Array]:
    """Return the low end, value and high end (joints,); nominal where nothing is stated."""
    low, value, high = nominal.copy(), nominal.copy(), nominal.copy()
    for name, estimate in estimates.items():
        for joint in matching_joints(name, joints):
            index = list(joints).index(joint)
            low[index], value[index], high[index] = estimate.low, estimate.value, estimate.high
    return low, value, high


def _offsets(model: ModelFile, default: Distribution, joints: Sequence[str]) -> Distribution:
    """Return the span of the offsets over the robot's initialisations; `default` where a joint shows none."""
    low, _, high = _on_joints(model.offsets, np.zeros(len(joints)), joints)
    seen = high - low > UNSEEN
    if not seen.any():
        return default
    usual = [default.quantile(np.full(len(joints), share)) for share in (0.025, 0.975)]
    return UniformPerJoint(tuple(np.where(seen, low, usual[0])), tuple(np.where(seen, high, usual[1])))
