"""The numbers of one simulation of a rig: nominal, from a model file, or drawn from the intervals."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.model_file import Estimate, ModelFile
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.recording import Recording

Array = NDArray[np.float64]
DEFAULTS = {"stiffness": np.inf, "static_friction": 0.0, "reflected_inertia": 0.0, "friction_creep": 0.0}
CONTROLLER = ("kp", "kd", "torque_limit")
TORQUE_MODE_GAIN = 1e-6  # [N m/rad] a commanded torque u is the position u / gain at this gain


@dataclass(frozen=True)
class Parameters:
    """Every number that a simulation of a rig needs beside its URDF.

    Attributes:
        constants: kp, kd, torque_limit, stiffness, static_friction, reflected_inertia and friction_creep (how fast a
            sticking joint gives way, rad/s per N m), each (joints,).
        effects: (`NAME@JOINT`, parameter -> value) of each effect.
        offset: (joints,) true minus measured angle [rad], the negative joint offset.
    """

    constants: dict[str, Array]
    effects: tuple[tuple[str, dict[str, float]], ...]
    offset: Array


def nominal_parameters(recording: Recording, model: ModelFile | None) -> Parameters:
    """What the owner believes, or what the model file says where it says anything."""
    estimates = _estimates(recording, model)
    constants = {key: np.array([one.value for one in row]) for key, row in estimates.items()}
    effects = model.drive_effects if model is not None else []
    values = tuple((one.effect, {key: e.value for key, e in one.parameters.items()}) for one in effects)
    return Parameters(constants, values, np.zeros(len(recording.joints)))


def draw_parameters(
    recording: Recording, model: ModelFile | None, spread: Mapping[str, float], rng: np.random.Generator
) -> Parameters:
    """One randomised simulation.

    Args:
        recording: its owner's values are the centre.
        model: values with an interval are drawn from the interval.
        spread: relative half width for a constant without an interval; `offset` is the half width [rad] of joint
            offsets.
        rng: source of randomness.
    """
    constants = {
        key: np.array([_drawn(one, spread.get(key, 0.0), rng) for one in row])
        for key, row in _estimates(recording, model).items()
    }
    effects = tuple(
        (one.effect, {key: _drawn(value, 0.0, rng) for key, value in one.parameters.items()})
        for one in (model.drive_effects if model is not None else [])
    )
    return Parameters(constants, effects, _offset(recording, model, spread.get("offset", 0.0), rng))


def _offset(recording: Recording, model: ModelFile | None, width: float, rng: np.random.Generator) -> Array:
    offsets = model.offsets if model is not None else {}
    bounds = [(offsets[j].low, offsets[j].high) if j in offsets else (-width, width) for j in recording.joints]
    return -np.array([rng.uniform(low, high) for low, high in bounds])


def _drawn(estimate: Estimate, spread: float, rng: np.random.Generator) -> float:
    """Uniform in the interval, or within the relative spread where there is none."""
    if not np.isfinite(estimate.value):
        return estimate.value
    if estimate.high > estimate.low:
        return float(rng.uniform(estimate.low, estimate.high))
    return estimate.value * float(rng.uniform(1 - spread, 1 + spread))


def _estimates(recording: Recording, model: ModelFile | None) -> dict[str, list[Estimate]]:
    believed = {key: getattr(recording.gains, key) for key in CONTROLLER}
    if recording.torque_controlled:
        believed |= {"kp": np.full(len(recording.joints), TORQUE_MODE_GAIN), "kd": np.zeros(len(recording.joints))}
    for key, value in DEFAULTS.items():
        believed[key] = recording.nominal.get(key, np.full(len(recording.joints), value))
    rows = {key: [Estimate(value=float(v), low=float(v), high=float(v)) for v in row] for key, row in believed.items()}
    for key, by_joint in (model.values if model is not None else {}).items():
        if key not in rows:
            raise InputError(f"model: key 'values.{key}': not a constant of the drivetrain; known: {sorted(rows)}")
        for index, joint in enumerate(recording.joints):
            rows[key][index] = by_joint.get(joint, rows[key][index])
    return rows


def require_same_joints(recording: Recording, model: ModelFile) -> None:
    """Refuse a model of another rig.

    Raises:
        InputError: the model's joints are not the recording's.
    """
    if set(model.joints) != set(recording.joints):
        raise InputError(f"model: joints {model.joints} are not those of the recording, {list(recording.joints)}")
