"""Limits that a proposed command keeps to, and how much of them a motion uses."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.recordings.recording import Recording

Array = NDArray[np.float64]
QUANTITIES = ("position", "speed", "torque")
TRIALS = "trials"
"""Source of a limit that nobody states: no further, faster or harder than the trials already went."""
ROUNDING = 1e-9
FILLER = 1000.0  # times what the trials reached: a number that fills a field of a URDF, such as 1e9, and limits nothing


@dataclass(frozen=True)
class Envelope:
    """What joints do at most; of joints that slide in m and N.

    Attributes:
        low: lowest position (n,) [rad].
        high: highest position (n,) [rad].
        speed: largest (n,) [rad/s].
        torque: largest (n,) [N m].
    """

    low: Array
    high: Array
    speed: Array
    torque: Array

    @classmethod
    def of_motion(cls, position: Array, torque: Array, step: float) -> Envelope:
        """The envelope of positions (T, n) [rad] and torques (T, n) [N m], with rows every `step` [s]."""
        speed = np.abs(np.diff(position, axis=0)).max(axis=0) / step
        return cls(position.min(axis=0), position.max(axis=0), speed, np.abs(torque).max(axis=0))

    @classmethod
    def around(cls, envelopes: Iterable[Envelope]) -> Envelope:
        """The smallest envelope that holds all of them."""
        low, high, speed, torque = (
            np.array(rows) for rows in zip(*((e.low, e.high, e.speed, e.torque) for e in envelopes), strict=True)
        )
        return cls(low.min(axis=0), high.max(axis=0), speed.max(axis=0), torque.max(axis=0))

    def of_joint(self, joint: int) -> dict[str, float | None]:
        """The plain numbers of one joint; None where a simulation ran away."""
        numbers = {key: float(getattr(self, key)[joint]) for key in ("low", "high", "speed", "torque")}
        return {key: value if np.isfinite(value) else None for key, value in numbers.items()}


@dataclass(frozen=True)
class Limits:
    """What the joints may do.

    Attributes:
        largest: the limits themselves.
        sources: position, speed, torque -> who says so, for each joint: `URDF`, `controller` or `trials`.
    """

    largest: Envelope
    sources: dict[str, tuple[str, ...]]

    def allowed(self, margin: float) -> Envelope:
        """The limits less a margin, a part of each one that somebody states; trials have shown theirs to be safe."""
        position, speed, torque = (
            1.0 - margin * np.array([source != TRIALS for source in self.sources[key]]) for key in QUANTITIES
        )
        middle, half = _middle_and_half(self.largest)
        return Envelope(
            middle - position * half, middle + position * half, speed * self.largest.speed, torque * self.largest.torque
        )


def share_used(reached: Envelope, allowed: Envelope) -> float:
    """The largest part of what is allowed that a motion uses; infinite where a simulation ran away."""
    middle, half = _middle_and_half(allowed)
    used = [
        _part(np.abs(reached.low - middle), half),
        _part(np.abs(reached.high - middle), half),
        _part(reached.speed, allowed.speed),
        _part(reached.torque, allowed.torque),
    ]
    largest = float(np.max(used))
    return largest if np.isfinite(largest) else np.inf


def within_limits(reached: Envelope, limits: Limits, margin: float) -> bool:
    """Whether a motion stays within the limits less the margin."""
    return share_used(reached, limits.allowed(margin)) <= 1.0 + ROUNDING


def limits_of(recording: Recording) -> Limits:
    """The limits that URDF and controller state, and where they state none what the trials reached."""
    shown = Envelope.around(
        Envelope(
            trial.position.min(axis=0),
            trial.position.max(axis=0),
            np.abs(trial.velocity()).max(axis=0),
            np.abs(_asked(recording, trial.command, trial.position)).max(axis=0),
        )
        for trial in recording.trials
    )
    joints = [recording.rig.joints[joint] for joint in recording.joints]
    low, high = np.array([(joint.lower, joint.upper) for joint in joints]).T
    speed = _stated([joint.velocity for joint in joints], shown.speed)
    effort = _stated([joint.effort for joint in joints], shown.torque)
    torque = np.minimum(np.where(recording.gains.torque_limit > 0.0, recording.gains.torque_limit, np.inf), effort)
    bounded = np.array([joint.bounds == (joint.lower, joint.upper) for joint in joints]) & (high > low)
    largest = Envelope(
        np.where(bounded, low, shown.low),
        np.where(bounded, high, shown.high),
        np.where(np.isfinite(speed), speed, shown.speed),
        np.where(np.isfinite(torque), torque, shown.torque),
    )
    sources = {
        "position": _sources(np.where(bounded, "URDF", TRIALS)),
        "speed": _sources(np.where(np.isfinite(speed), "URDF", TRIALS)),
        "torque": _sources(np.select([~np.isfinite(torque), torque < effort], [TRIALS, "controller"], "URDF")),
    }
    return Limits(largest, sources)


def _asked(recording: Recording, command: Array, position: Array) -> Array:
    return command if recording.torque_controlled else np.asarray(recording.gains.kp * (command - position))


def _stated(limits: list[float], shown: Array) -> Array:
    """Limits (n,), infinite where a number only fills the field."""
    return np.where(np.array(limits) < FILLER * shown, limits, np.inf)


def _sources(chosen: NDArray[np.str_]) -> tuple[str, ...]:
    return tuple(str(one) for one in chosen)


def _middle_and_half(envelope: Envelope) -> tuple[Array, Array]:
    return 0.5 * (envelope.low + envelope.high), 0.5 * (envelope.high - envelope.low)


def _part(used: Array, allowed: Array) -> Array:
    return np.asarray(used / np.maximum(allowed, np.finfo(float).tiny))
