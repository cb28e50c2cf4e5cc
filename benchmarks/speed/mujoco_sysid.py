"""Peer: mujoco.sysid on the same finger, commands and measurements."""

from __future__ import annotations

import contextlib
import io
from dataclasses import dataclass
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.fitting.unknowns import TOLERANCE
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.replay.model import nominal_model

Array = NDArray[np.float64]

FITTED = {"kd": "damping", "static_friction": "frictionloss", "reflected_inertia": "armature"}
"""Constants of the drive, and what MuJoCo calls them."""
ITERATIONS = 20


@dataclass
class FingerFit:
    """A fitted MuJoCo model.

    Attributes:
        mujoco: the package.
        model: compiled with the fitted values.
        step: of the simulation [s].
    """

    mujoco: ModuleType
    model: Any
    step: float

    def error(self, recording: Recording) -> float:
        """RMS of measured minus simulated positions over the trials [rad]."""
        errors = [self._simulate(trial) - _resample(trial, trial.position, self.step) for trial in recording.trials]
        return float(np.sqrt(np.mean(np.square(np.concatenate(errors)))))

    def _simulate(self, trial: Trial) -> Array:
        data = self.mujoco.MjData(self.model)
        data.qpos[:] = _with_coupled(trial.position[0])
        positions = []
        for command in _resample(trial, trial.command, self.step):
            data.ctrl[:] = command
            self.mujoco.mj_step(self.model, data)
            positions.append(data.sensordata.copy())  # as it was at the beginning of the step
        return np.array(positions)


def fit_finger(mujoco: ModuleType, sysid: ModuleType, recording: Recording, step: float) -> FingerFit:
    """Fit damping, dry friction and armature of each joint within the bounds that our own fit has.

    Args:
        mujoco: the package.
        sysid: its module of that name.
        recording: trials of a finger with rigid drives.
        step: of the simulation [s].
    """
    spec = _spec(mujoco, recording, step)
    sequences = [_sequence(mujoco, sysid, spec, trial, step) for trial in recording.trials]
    residual = sysid.build_residual_fn(models_sequences=sequences)
    with contextlib.redirect_stdout(io.StringIO()):
        found, _ = sysid.optimize(_parameters(sysid, recording), residual, verbose=False, max_iters=ITERATIONS)
    for parameter in found.values():
        parameter.apply_modifier(spec)
    return FingerFit(mujoco, spec.compile(), step)


def _spec(mujoco: ModuleType, recording: Recording, step: float) -> Any:
    spec = mujoco.MjSpec.from_string(recording.rig.text)
    spec.option.timestep, spec.option.gravity = step, recording.gravity
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT
    for index, name in enumerate(recording.joints):
        kp, limit = recording.gains.kp[index], recording.gains.torque_limit[index]
        spec.joint(name).damping[0] = recording.gains.kd[index]
        actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.gaintype, actuator.gainprm[0] = mujoco.mjtGain.mjGAIN_FIXED, kp
        actuator.biastype, actuator.biasprm[:2] = mujoco.mjtBias.mjBIAS_AFFINE, [0.0, -kp]
        actuator.forcelimited, actuator.forcerange = True, [-limit, limit]
        spec.add_sensor(
            name=f"{name}_position",
            type=mujoco.mjtSensor.mjSENS_JOINTPOS,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            objname=name,
        )
    return spec


def _parameters(sysid: ModuleType, recording: Recording) -> Any:
    nominal = nominal_model(recording).constants
    parameters = sysid.ParameterDict()
    for constant, attribute in FITTED.items():
        low, high = TOLERANCE[constant]
        for index, joint in enumerate(recording.joints):
            value = float(nominal[constant][index])
            modifier = partial(_set, joint, attribute)
            bounds = {"nominal": value, "min_value": low * value, "max_value": high * value}
            parameters.add(sysid.Parameter(f"{joint}_{constant}", **bounds, modifier=modifier))
    return parameters


def _set(joint: str, attribute: str, spec: Any, parameter: Any) -> None:
    value = float(parameter.value[0])
    if attribute == "damping":
        spec.joint(joint).damping[0] = value
    else:
        setattr(spec.joint(joint), attribute, value)


def _sequence(mujoco: ModuleType, sysid: ModuleType, spec: Any, trial: Trial, step: float) -> Any:
    model = spec.compile()
    command, position = (_resample(trial, values, step) for values in (trial.command, trial.position))
    time = step * np.arange(len(command))
    start = sysid.create_initial_state(model, _with_coupled(trial.position[0]), np.zeros(model.nv), np.zeros(0))
    measured = sysid.TimeSeries.from_names(time, position, model)
    return sysid.ModelSequences(trial.name, spec, trial.name, start, sysid.TimeSeries(time, command), measured)


def _resample(trial: Trial, values: Array, step: float) -> Array:
    """Values on the simulation's grid: each holds until the next."""
    count = round(trial.duration / step)
    index = np.minimum((step * np.arange(count) / trial.step + 1e-6).astype(int), len(values) - 1)
    return np.asarray(values[index])


def _with_coupled(angles: Array) -> Array:
    """Angles of q1..q4; q4 follows q3."""
    return np.append(angles, angles[-1])
