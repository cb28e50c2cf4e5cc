"""Commands that excite a rig: ramps, holds, steps, multisines and what a policy does, inside the joints' limits."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.rig import RigJoint

Array = NDArray[np.float64]
POLICY_PERIOD = 0.1  # [s]
POLICY_SMOOTHING = 0.15  # [s] the low-pass that a learning hand puts on its targets
UNBOUNDED = 1.0  # [rad] half range of a joint without limits


def safe_range(joint: RigJoint, share: float) -> tuple[float, float]:
    """The middle `share` of a joint's range [rad]."""
    lower, upper = (joint.lower, joint.upper) if np.isfinite(joint.upper - joint.lower) else (-UNBOUNDED, UNBOUNDED)
    centre, half = 0.5 * (lower + upper), 0.5 * share * (upper - lower)
    return centre - half, centre + half


def excitation(kind: str, low: Array, high: Array, duration: float, rate: float, rng: np.random.Generator) -> Array:
    """Commands of one trial, shape (duration * rate, joints) [rad], within `low` and `high` (joints,).

    Raises:
        InputError: an unknown kind.
    """
    if kind not in KINDS:
        raise InputError(f"kinds: '{kind}' is no excitation; known: {list(KINDS)}")
    time = np.arange(round(duration * rate)) / rate
    columns = [KINDS[kind](time, rng) for _ in low]
    return low + (high - low) * np.stack(columns, axis=1)


def ramps(time: Array, rng: np.random.Generator) -> Array:
    """Straight strokes at speeds spread over a decade, in 0..1: friction at many speeds, reversals of many sizes."""
    corners, values = [0.0], [float(rng.uniform())]
    while corners[-1] < time[-1]:
        goal = float(rng.uniform())
        speed = float(np.exp(rng.uniform(np.log(0.1), np.log(1.5))))
        corners.append(corners[-1] + max(0.1, abs(goal - values[-1]) / speed))
        values.append(goal)
    return np.asarray(np.interp(time, corners, values))


def holds(time: Array, rng: np.random.Generator) -> Array:
    """Quick moves between postures that are held for a second or so, in 0..1: gravity, sticking, creep."""
    return _held(time, (0.6, 1.4), 0.15, rng)


def steps(time: Array, rng: np.random.Generator) -> Array:
    """Postures commanded within two hundredths of a second and held, in 0..1: all the torque that a motor has."""
    return _held(time, (0.4, 0.8), 0.02, rng)


def _held(time: Array, rest: tuple[float, float], move: float, rng: np.random.Generator) -> Array:
    """Random values that are each held for some `rest` [s] and reached within `move` [s]."""
    corners, values = [0.0], [float(rng.uniform())]
    while corners[-1] < time[-1]:
        end = corners[-1] + rng.uniform(*rest)
        corners += [end, end + move]
        values += [values[-1], float(rng.uniform())]
    return np.asarray(np.interp(time, corners, values))


def multisine(time: Array, rng: np.random.Generator) -> Array:
    """A sum of sines from 0.2 to 6 Hz with falling amplitude, in 0..1: inertia, delay, lag."""
    frequencies = np.geomspace(0.2, 6.0, 8) * rng.uniform(0.9, 1.1, 8)
    waves = np.sin(2 * np.pi * np.outer(time, frequencies) + rng.uniform(0, 2 * np.pi, 8)) @ (1 / frequencies**0.7)
    return np.asarray(0.5 + 0.5 * waves / np.max(np.abs(waves)))


def policy(time: Array, rng: np.random.Generator) -> Array:
    """New targets at 10 Hz behind a low-pass, in 0..1: what a learning policy does to the hand."""
    walk = np.cumsum(rng.normal(0, 0.25, int(np.ceil(time[-1] / POLICY_PERIOD)) + 2)) + rng.uniform()
    folded = np.abs((walk + 1) % 2 - 1)
    targets = folded[np.floor(time / POLICY_PERIOD + 1e-9).astype(int)]
    smooth, step = np.empty_like(targets), time[1] - time[0]
    state = targets[0]
    for index, target in enumerate(targets):
        state += (target - state) * step / POLICY_SMOOTHING
        smooth[index] = state
    return np.asarray(smooth)


KINDS: dict[str, Callable[[Array, np.random.Generator], Array]] = {
    one.__name__: one for one in (ramps, holds, steps, multisine, policy)
}
