"""Gains of a position controller as a log shows them: a start for unknown ones, doubts about stated ones."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from scipy.optimize import nnls

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.measurement.recordings.rig import Rig
from tactile_cube.measurement.recordings.writing import Array, TrialTable

WINDOW = 0.05  # [s] over which a velocity is taken
MOST, FEWEST = 600, 20  # samples of all trials, of one trial
FOUND = ("kp", "kd", "reflected_inertia", "told")
NO_ROTOR = 0.1  # part of the links' inertia that a rotor begins with at least
TELLING = 0.2  # part of the error that the links' torque must explain before stated gains are doubted
FAR = 15.0  # times by which a stated gain may differ: units differ by 57 and by 1000


def estimated_gains(
    trials: Sequence[TrialTable], joints: Sequence[str], rig: Rig, gravity: Sequence[float]
) -> dict[str, list[float]]:
    """Estimate kp [N m/rad], kd [N m s/rad] and reflected_inertia [kg m^2] of each joint.

    Least squares with coefficients that are not negative: the error of the loop is (M dv + g(q) + J dv + kd v +
    friction) / kp. Without weight or inertia of the links kp is not identifiable; a rotor as heavy as they is assumed.
    `told` is the part of the error (0 .. 1) that the links explain.
    """
    try:
        tree = RigidBodyTree.from_urdf(rig.text, tuple(joints))
    except InputError as error:
        raise InputError(f"{rig.path}: {error}") from None
    motion = motion_of(trials, len(joints))
    if not len(motion):
        return {key: [float(key != "told")] * len(joints) for key in FOUND}
    q, v, a, apart, _ = motion.transpose(1, 0, 2)
    links = tree.inverse_dynamics(q, v, a, np.asarray(gravity))
    inertia = tree.actuated_mass_matrix(q.mean(axis=0)).diagonal().tolist()
    rows = [_loop(*columns) for columns in zip(apart.T, links.T, v.T, a.T, inertia, strict=True)]
    return {key: [row[k] for row in rows] for k, key in enumerate(FOUND)}


def motion_of(trials: Sequence[TrialTable], joints: int) -> Array:
    """Return position, velocity, acceleration, loop error and command (n, 5, joints) of some samples of all trials."""
    usable = [trial for trial in trials if len(trial.time) > FEWEST and np.abs(trial.position).max() < limits.NUMBER]
    motion = np.concatenate([_motion(trial) for trial in usable] or [np.zeros((0, 5, joints))])
    return np.asarray(motion[np.isfinite(motion).all(axis=(1, 2))][:: max(1, len(motion) // MOST)])


def _motion(trial: TrialTable) -> Array:
    step = float(np.median(np.diff(trial.time)))
    rows = max(1, min(round(WINDOW / max(step, 1e-9)), len(trial.time) // 4))
    smooth = np.stack([np.convolve(column, np.ones(rows) / rows, "valid") for column in trial.position.T], axis=1)
    with np.errstate(all="ignore"):
        velocity = np.gradient(smooth, step, axis=0)
        acceleration = np.gradient(velocity, step, axis=0)
    middle = slice((rows - 1) // 2, (rows - 1) // 2 + len(smooth))
    error = (trial.command - trial.position)[middle]
    return np.stack([smooth, velocity, acceleration, error, trial.command[middle]], axis=1)


def nonnegative_fit(columns: Mapping[str, Array], values: Array) -> tuple[dict[str, float], float]:
    """Return nonnegative coefficients of columns (n,) and the error (2-norm) that they leave: inf without a number."""
    table = np.stack(list(columns.values()), axis=1)
    sizes = np.maximum(np.abs(table).max(axis=0), 1e-12)
    if not np.isfinite(table / sizes).all() or not np.isfinite(values).all():
        return dict.fromkeys(columns, 0.0), np.inf
    found, left = nnls(table / sizes, values)
    return dict(zip(columns, (found / sizes).tolist(), strict=True)), float(left)


def resistance(v: Array) -> dict[str, Array]:
    """Return the columns of what resists a velocity (n,) - damping, friction - and of a constant either way."""
    sliding, ones = np.tanh(v / max(float(np.std(v)) / 5.0, 1e-9)), np.ones_like(v)
    return {"damping": v, "friction": sliding, "up": ones, "down": -ones}


@np.errstate(all="ignore")
def _loop(error: Array, links: Array, v: Array, a: Array, inertia: float) -> tuple[float, float, float, float]:
    columns = {"rotor": a, **resistance(v)}
    found, left = nonnegative_fit({"softness": links, **columns}, error)
    if left == np.inf:
        return 1.0, 1.0, 1.0, 0.0
    softness, rotor, without = found["softness"], found["rotor"], nonnegative_fit(columns, error)[1]
    told = 1.0 - left / without if without > 0.0 and softness > 0.0 else 0.0
    if softness <= 0.0:
        known = rotor > 0.0 and inertia > 0.0
        softness = rotor / inertia if known else float(np.std(error)) / max(float(np.std(links)), 1e-9)
    kp = 1.0 / max(softness, 1e-6)
    return kp, kp * found["damping"] or 0.01 * kp, max(kp * rotor, NO_ROTOR * inertia, 1e-6), told


def gain_doubts(kp: Array, found: Mapping[str, Sequence[float]], unknown: bool) -> Iterator[str]:
    """Yield doubts about stated gains (joints,) that the links contradict, or unknown ones that are unidentifiable."""
    if unknown and min(found["told"]) < TELLING:
        yield "the links' weight and inertia tell little of kp: of gains and inertia only the ratios are known"
    for one, seen, told in zip(kp, found["kp"], found["told"], strict=True):
        if not unknown and told > TELLING and not 1.0 / FAR < one / seen < FAR:
            yield (
                f"controller.kp is {one:.3g} N m/rad, but the log with the URDF's masses looks like {seen:.3g}: is it "
                "in N m/deg, or a gain of the firmware?"
            )
