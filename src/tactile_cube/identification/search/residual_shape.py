"""Missing torque of a model: its average over bins of each signal, and the share that any law could explain."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model

Array = NDArray[np.float64]
BINS = 24
MANY = 10 * BINS  # samples that a curve needs
FEATURES = 150  # random cosines of the black box
RIDGES = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
PARABOLA = 0.015  # [s] of a finger: half width of the parabola that reads slope and curvature
APART = 0.1  # share that curves for motion up and down have to explain beyond one curve for both
TOLD_APART = 0.6  # share of the segments on which the black box learns


@dataclass(frozen=True)
class Shape:
    """The missing torque at a joint, averaged over bins of another signal.

    Attributes:
        joint: where it is missing.
        against: the signal, with its unit; with ", moving up" or ", moving down" for one direction of motion.
        centres: (bins,) of the signal.
        mean: (bins,) [N m].
        spread: (bins,) standard deviation [N m].
        explained: share of the missing torque that a function of this signal alone explains; of a pair of curves for
            motion up and down, what both explain together.
        beside: the model that lacks the torque.
    """

    joint: str
    against: str
    centres: Array
    mean: Array
    spread: Array
    explained: float
    beside: str = ""


@dataclass(frozen=True)
class Missing:
    """The missing torque of one joint and the signals it may depend on, each (samples,)."""

    joint: str
    torque: Array
    signals: dict[str, Array]
    segment: NDArray[np.int64]
    initialisation: NDArray[np.int64]


def missing_torques(
    problem: Problem, recording: Recording, model: Model, residual: Array, time: float | None = None
) -> list[Missing]:
    """Return each joint's missing torque, with which a weighted residual (G, R) would vanish: I r'' + D r' + K r.

    The residual is differentiated in windows of half width `time` [s], by default the usual one of the machine.
    """
    n, segment = len(recording.joints), problem.windows.segment
    weight, measured, left = (
        one.reshape(len(residual), segment, -1)[..., :n] for one in (problem.weight, problem.measured, residual)
    )
    # derivatives beside rows that do not count are unknown
    error = np.divide(left, weight, out=np.full_like(weight, np.nan), where=weight > 0)
    step = recording.step
    position, velocity, acceleration = _derivatives(measured, step, problem.shooting.time)
    constants = model.constants
    soft = 1.0 + constants["kp"] / constants["stiffness"]
    mass = problem.shooting.tree.actuated_mass_matrix(measured.reshape(-1, n).mean(axis=0))
    inertia = np.diag(mass) + constants["reflected_inertia"]  # (n,) of the joints, at the mean configuration [kg m^2]
    r, dr, ddr = _derivatives(error, step, problem.shooting.time if time is None else time / PARABOLA)
    torque = inertia * ddr + constants["kd"] / soft * dr + constants["kp"] / soft * r
    drive = _drive(problem, model, position, velocity)
    first = np.tile(problem.windows.time[:, None], (1, problem.windows.segments)).ravel()
    length = segment * step
    begin = first + np.tile(np.arange(problem.windows.segments), len(problem.windows)) * length
    edge = min(round((time or 0.0) / step), segment // 4)
    inner = slice(max(segment // 8, edge), min(-segment // 8, -edge))
    inside = np.isfinite(ddr[:, inner]).all(axis=2)
    number = np.broadcast_to(np.arange(len(weight))[:, None], weight.shape[:2])[:, inner][inside]
    clock = (begin[:, None] + np.arange(segment) * step)[:, inner][inside]
    angle = position + np.array([model.offsets[int(k)] for k in problem.segment_initialisation])[:, None]
    found = []
    for j, joint in enumerate(recording.joints):
        signals = {}
        for k, other in enumerate(recording.joints):
            signals[f"position of {other} [rad]"] = angle[:, inner, k][inside]
            signals[f"velocity of {other} [rad/s]"] = velocity[:, inner, k][inside]
        signals[f"acceleration of {joint} [rad/s^2]"] = acceleration[:, inner, j][inside]
        signals[f"torque of {joint} [N m]"] = drive[:, inner, j][inside]
        signals["time [s]"] = clock
        initialisation = problem.segment_initialisation[number]
        found.append(Missing(joint, torque[:, inner, j][inside], signals, number, initialisation))
    return found


def _drive(problem: Problem, model: Model, position: Array, velocity: Array) -> Array:
    """Return the controller's torque at positions and velocities (G, segment, n), clipped to the limits [N m]."""
    windows, constants = problem.windows, model.constants
    commands = windows.commands[:, windows.history * windows.substeps :: windows.substeps].reshape(position.shape)
    kp, kd, most = np.repeat(windows.gains, windows.segments, axis=0).swapaxes(0, 1)[:, :, None]
    drive = kp * constants["kp"] * (commands - position) - kd * constants["kd"] * velocity
    return np.asarray(np.clip(drive, -most * constants["torque_limit"], most * constants["torque_limit"]))


def shapes(missing: Missing) -> list[Shape]:
    """Return the missing torque over every signal, sorted by the explained share, largest first.

    A signal also has a curve for motion up and one for motion down if they differ, as with friction.
    """
    found = [_shape(missing, name) for name in missing.signals]
    found += [curve for one in found for curve in _by_direction(missing, one)]
    return sorted(found, key=lambda shape: -shape.explained)


def black_box(missing: Missing, seed: int = 0) -> float:
    """Return the share of the missing torque that a black box of all signals explains on unseen segments.

    Ridge regression on the signals, their directions of motion, and random cosines of the signals, for either direction
    of the joint alone as well (Rahimi and Recht, 2007). The penalty is chosen within the segments that are learned.
    """
    rng = np.random.default_rng(seed)
    features = _features(missing, rng)
    part = rng.uniform(size=missing.segment.max() + 1)[missing.segment]
    learn, choose = part < TOLD_APART, part < TOLD_APART * TOLD_APART
    if learn.all() or not choose.any() or choose.sum() == learn.sum():
        return 0.0
    inner = [_explained(features, missing.torque, choose, learn & ~choose, ridge) for ridge in RIDGES]
    return max(0.0, _explained(features, missing.torque, learn, ~learn, RIDGES[int(np.argmax(inner))]))


def _features(missing: Missing, rng: np.random.Generator) -> Array:
    """Return the inputs of the black box (samples, features)."""
    inputs = np.stack(list(missing.signals.values()), axis=1)
    signs = np.sign(np.stack([x for name, x in missing.signals.items() if name.startswith("velocity")], axis=1))
    inputs = (inputs - inputs.mean(axis=0)) / np.maximum(inputs.std(axis=0), 1e-12)
    frequencies = rng.normal(size=(inputs.shape[1], FEATURES)) * rng.choice([0.1, 0.3, 1.0, 3.0], FEATURES)
    waves = np.cos(inputs @ frequencies + rng.uniform(0, 2 * np.pi, FEATURES))
    direction = np.sign(missing.signals[f"velocity of {missing.joint} [rad/s]"])[:, None]
    return np.concatenate([inputs, signs, waves, direction * waves, direction * inputs], axis=1)


def _explained(
    features: Array, torque: Array, learn: NDArray[np.bool_], test: NDArray[np.bool_], ridge: float
) -> float:
    """Return the share of the torque of some samples that a ridge regression on others explains."""
    a, mean = features[learn], torque[learn].mean()
    weights = np.linalg.solve(a.T @ a + ridge * len(a) * np.eye(a.shape[1]), a.T @ (torque[learn] - mean))
    left = torque[test] - mean - features[test] @ weights
    return float(1.0 - np.mean(left**2) / max(float(np.var(torque[test])), 1e-30))


def _by_direction(missing: Missing, both: Shape) -> list[Shape]:
    """Return curves for motion up and motion down if they explain clearly more than one curve for both."""
    speed = missing.signals[f"velocity of {missing.joint} [rad/s]"]
    curves, left = [], 0.0
    for side, chosen in (("up", speed > 0.0), ("down", speed <= 0.0)):
        if chosen.sum() < MANY:
            return []
        signals = {both.against: missing.signals[both.against][chosen]}
        parts = (missing.segment[chosen], missing.initialisation[chosen])
        part = Missing(missing.joint, missing.torque[chosen], signals, *parts)
        curve = _shape(part, both.against)
        left += (1.0 - curve.explained) * part.torque.var() * chosen.sum()
        curves.append(replace(curve, against=f"{both.against}, moving {side}"))
    explained = 1.0 - left / max(missing.torque.var() * len(speed), 1e-30)
    return [replace(curve, explained=explained) for curve in curves] if explained > both.explained + APART else []


def _shape(missing: Missing, name: str) -> Shape:
    values = missing.signals[name]
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, BINS + 1)))
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, max(len(edges) - 2, 0))
    count = np.maximum(np.bincount(place), 1)
    mean = np.bincount(place, missing.torque) / count
    square = np.bincount(place, missing.torque**2) / count
    centres = np.bincount(place, values) / count
    explained = np.sum(count * (mean - missing.torque.mean()) ** 2) / max(missing.torque.var() * len(values), 1e-30)
    chance = len(count) / max(
        len(np.unique(missing.segment)), 1
    )  # bins fit noise; samples of one segment are not independent
    spread = np.sqrt(np.maximum(square - mean**2, 0.0))
    return Shape(missing.joint, name, centres, mean, spread, float(max(0.0, explained - 0.1 * min(chance, 1.0))))


def _derivatives(x: Array, step: float, time: float) -> tuple[Array, Array, Array]:
    """Return the value, slope and curvature of (G, segment, n) by sliding parabolas."""
    half = max(2, min(round(PARABOLA * time / step), x.shape[1] // 4))
    lever = np.arange(-half, half + 1) * step
    weights = np.linalg.pinv(np.stack([np.ones_like(lever), lever, 0.5 * lever**2], axis=1))
    padded = np.pad(x, ((0, 0), (half, half), (0, 0)), mode="reflect", reflect_type="odd")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1, axis=1)
    value, slope, curvature = (windows @ row for row in weights)
    return value, slope, curvature
