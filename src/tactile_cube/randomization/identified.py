"""What a model file says about the drive, as nominal constants, ranges and effects of the training world."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tactile_cube.drivetrain.effects import Effect, Stage, resolve
from tactile_cube.drivetrain.effects.catalogue import matching_joints
from tactile_cube.drivetrain.model_file import Estimate, ModelFile
from tactile_cube.errors import InputError
from tactile_cube.randomization.randomization import (
    Array,
    Constant,
    Distribution,
    EffectRange,
    Randomization,
    Uniform,
    UniformPerJoint,
)
from tactile_cube.simulation import EpisodeConstants
from tactile_cube.simulation.contact_effects import contact_catalogue

UNSEEN = 1e-4  # [rad] span of the offsets below which they were not observed: an axis along gravity shows none
PER_JOINT = ("kp", "kd", "stiffness", "static_friction", "reflected_inertia", "friction_creep")


def identified(
    model: ModelFile, constants: EpisodeConstants, randomization: Randomization, joints: Sequence[str]
) -> tuple[EpisodeConstants, Randomization, list[Effect]]:
    """The hand that was identified: values in place of nominal ones, intervals in place of ranges, effects added.

    A model of one finger (q1, q2, q3) stands for all four. Constants that were fitted are drawn from their intervals;
    those that were not keep the relative range of `randomization` around the model's value. `joints` are the hand's, in
    the order of the constants' vectors.

    Raises:
        InputError: joints, effects or limits that the hand does not have.
    """
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


def identified_contact(
    model: ModelFile, constants: EpisodeConstants, randomization: Randomization
) -> tuple[EpisodeConstants, Randomization]:
    """Fingertips and object that were identified: values in place of nominal ones, intervals in place of ranges.

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
    """Low end, value and high end (joints,); nominal where nothing is stated."""
    low, value, high = nominal.copy(), nominal.copy(), nominal.copy()
    for name, estimate in estimates.items():
        for joint in matching_joints(name, joints):
            index = list(joints).index(joint)
            low[index], value[index], high[index] = estimate.low, estimate.value, estimate.high
    return low, value, high


def _offsets(model: ModelFile, default: Distribution, joints: Sequence[str]) -> Distribution:
    """The span of the offsets over the robot's initialisations; `default` for joints whose recording shows none."""
    low, _, high = _on_joints(model.offsets, np.zeros(len(joints)), joints)
    seen = high - low > UNSEEN
    if not seen.any():
        return default
    usual = [default.quantile(np.full(len(joints), share)) for share in (0.025, 0.975)]
    return UniformPerJoint(tuple(np.where(seen, low, usual[0])), tuple(np.where(seen, high, usual[1])))
