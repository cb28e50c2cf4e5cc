"""The plain method that a diagnosis has to beat: least squares of one joint in windows of 1 s with a soft-L1 loss.

Torque constant, inertia, gravity, viscous and Coulomb friction and offset from where they are stated, nothing else.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial

Array = NDArray[np.float64]
WINDOW = 1.0  # [s]
LOSS = 0.05  # of the range of motion, where the loss turns from squares to absolute values
STEPS = 30  # of least squares
LONGEST_STEP = 0.005  # [s] of the simulation
SPEED_WINDOW = 0.03  # [s] from whose samples a speed is read


def simulated(numbers: Array, trial: Trial, starts: NDArray[np.int64], rows: int, torque_controlled: bool) -> Array:
    """Positions (S, rows) [rad] from the measured states at some rows of a trial; semi-implicit Euler."""
    gain, inertia, gravity, phase, viscous, dry, offset = numbers
    q, v = trial.position[starts, 0].copy(), trial.velocity(SPEED_WINDOW)[starts, 0].copy()
    fine = int(np.ceil(trial.step / LONGEST_STEP))
    dt, out = trial.step / fine, np.empty((len(starts), rows))
    kp, kd, limit = (float(one[0]) for one in (trial.gains.kp, trial.gains.kd, trial.gains.torque_limit))
    for row in range(rows):
        out[:, row] = q
        command = trial.command[np.minimum(starts + row, len(trial.time) - 1), 0]
        for _ in range(fine):
            asked = command if torque_controlled else np.clip(kp * (command - q) - kd * v, -limit, limit)
            pushed = gain * asked - gravity * np.sin(q + phase) - offset - viscous * v
            free = v + dt * pushed / inertia
            v = np.sign(free) * np.maximum(np.abs(free) - dt * dry / inertia, 0.0)
            q = q + dt * v
    return out


def stated(recording: Recording) -> Array:
    """The numbers as the machine's owner states them; friction as nominal, else none."""
    tree, still, none = recording.rigid_body(), np.zeros((1, 1)), np.zeros(1)
    turns = 0.0 if tree.prismatic[0] else 1.0
    sine, cosine = (
        turns * float(tree.inverse_dynamics(np.array([[q]]), still, still, recording.gravity).item())
        for q in (0.5 * np.pi, 0.0)
    )
    rotor, dry = (float(recording.nominal.get(key, none)[0]) for key in ("reflected_inertia", "static_friction"))
    inertia = float(tree.actuated_mass_matrix(none)[0, 0]) + rotor
    return np.array([1.0, inertia, np.hypot(sine, cosine), np.arctan2(cosine, sine), 0.0, dry, 0.0])


def fitted(recording: Recording) -> Array:
    """The numbers by least squares on every trial of a recording with one joint."""
    begin, span = stated(recording), float(np.ptp(np.concatenate([one.position for one in recording.trials])))
    speed = max(float(np.quantile(np.abs(one.velocity(SPEED_WINDOW)), 0.99)) for one in recording.trials)
    torque = max(begin[2], begin[1] * speed**2 / span)
    free = np.array([0, 1, *([2] if begin[2] > 0.0 else []), 4, 5, 6])
    scale = np.array([1.0, begin[1], torque, 1.0, 0.1 * torque / speed, 0.1 * torque, 0.1 * torque])

    def numbers(of: Array) -> Array:
        found = begin.copy()
        found[free] = of * scale[free]
        return found

    def left(of: Array) -> Array:
        return np.concatenate([_errors(numbers(of), one, recording.torque_controlled) for one in recording.trials])

    low = np.array([0.05, 0.05, 0.05, 0.0, 0.0, 0.0, -np.inf])[free]
    start = np.maximum(begin[free] / scale[free], low + 1e-3)
    loss = LOSS * span
    return numbers(least_squares(left, start, loss="soft_l1", f_scale=loss, bounds=(low, np.inf), max_nfev=STEPS).x)


def _errors(numbers: Array, trial: Trial, torque_controlled: bool) -> Array:
    rows = min(round(WINDOW / trial.step), len(trial.time))
    starts = np.arange(0, len(trial.time) - rows + 1, rows)
    found = simulated(numbers, trial, starts, rows, torque_controlled)
    seen = trial.valid[starts[:, None] + np.arange(rows)]
    error = found - trial.position[starts[:, None] + np.arange(rows), 0]
    return np.where(seen, np.nan_to_num(np.clip(error, -10.0, 10.0), nan=10.0), 0.0).ravel()


def free_run_error(numbers: Array, recording: Recording) -> float:
    """RMS error of free runs of a recording's trials, nothing removed [rad]."""
    squares = [
        (simulated(numbers, one, np.zeros(1, dtype=np.int64), len(one.time), recording.torque_controlled)[0]
         - one.position[:, 0])[one.valid] ** 2
        for one in recording.trials
    ]  # fmt: skip
    return float(np.sqrt(np.mean(np.concatenate(squares))))
