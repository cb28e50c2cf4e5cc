"""Commands that keep a machine within its limits in every model that may be true."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tactile_cube.identification.fitting.gauss_newton import Fit, precision
from tactile_cube.identification.fitting.problem import Shooting
from tactile_cube.identification.fitting.resolution import NORMAL_95
from tactile_cube.identification.fitting.unknowns import Unknown, put_all, read_all
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Array, Trial
from tactile_cube.measurement.replay.model import Model, no_offsets

QUANTITIES = ("position", "speed", "torque")
TRIALS = "trials"  # source of a limit that nobody states: no further, faster or harder than the trials already went
ROUNDING = 1e-9
FILLER = 1000.0  # times what the trials reached: a number that fills a field of a URDF, such as 1e9, and limits nothing


@dataclass(frozen=True)
class Envelope:
    """Largest positions, speeds and torques of joints; of joints that slide in m and N.

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
        """Return the envelope of positions (T, n) [rad] and torques (T, n) [N m], with rows every `step` [s]."""
        speed = np.abs(np.diff(position, axis=0)).max(axis=0) / step
        return cls(position.min(axis=0), position.max(axis=0), speed, np.abs(torque).max(axis=0))

    @classmethod
    def around(cls, envelopes: Iterable[Envelope]) -> Envelope:
        """Return the smallest envelope that contains all of them."""
        low, high, speed, torque = (
            np.array(rows) for rows in zip(*((e.low, e.high, e.speed, e.torque) for e in envelopes), strict=True)
        )
        return cls(low.min(axis=0), high.max(axis=0), speed.max(axis=0), torque.max(axis=0))

    @property
    def middle_and_half(self) -> tuple[Array, Array]:
        """Middle and half width of the range of positions [rad]."""
        return 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)

    def of_joint(self, joint: int) -> dict[str, float | None]:
        """Return the values of one joint as floats; None where a simulation ran away."""
        numbers = {key: float(getattr(self, key)[joint]) for key in ("low", "high", "speed", "torque")}
        return {key: value if np.isfinite(value) else None for key, value in numbers.items()}


@dataclass(frozen=True)
class Limits:
    """Limits of the joints.

    Attributes:
        largest: the limits themselves.
        sources: position, speed, torque -> the source for each joint: `URDF`, `controller` or `trials`.
    """

    largest: Envelope
    sources: dict[str, tuple[str, ...]]

    def allowed(self, margin: float) -> Envelope:
        """Return the limits less a margin, a share of each stated limit; limits from trials are safe and have none."""
        position, speed, torque = (
            1.0 - margin * np.array([source != TRIALS for source in self.sources[key]]) for key in QUANTITIES
        )
        most, (middle, half) = self.largest, self.largest.middle_and_half
        return Envelope(middle - position * half, middle + position * half, speed * most.speed, torque * most.torque)


def share_used(reached: Envelope, allowed: Envelope) -> float:
    """Return the largest share of the allowed envelope that a motion uses; infinite where a simulation ran away."""
    middle, half = allowed.middle_and_half
    used = np.array([np.abs(reached.low - middle), np.abs(reached.high - middle), reached.speed, reached.torque])
    largest = float(np.max(used / np.maximum([half, half, allowed.speed, allowed.torque], np.finfo(float).tiny)))
    return largest if np.isfinite(largest) else np.inf


def within_limits(reached: Envelope, limits: Limits, margin: float) -> bool:
    """Return whether a motion stays within the limits less the margin."""
    return share_used(reached, limits.allowed(margin)) <= 1.0 + ROUNDING


def limits_of(recording: Recording) -> Limits:
    """Return the limits of URDF and controller, or where neither states one, the largest values of the trials."""
    kp, driven = recording.gains.kp, recording.torque_controlled
    shown = Envelope.around(
        Envelope(
            trial.position.min(axis=0),
            trial.position.max(axis=0),
            np.abs(trial.velocity()).max(axis=0),
            np.abs(trial.command if driven else kp * (trial.command - trial.position)).max(axis=0),
        )
        for trial in recording.trials
    )
    joints = [recording.rig.joints[joint] for joint in recording.joints]
    low, high, speed, effort = np.array([(one.lower, one.upper, one.velocity, one.effort) for one in joints]).T
    speed = np.where(speed < FILLER * shown.speed, speed, np.inf)
    effort = np.where(effort < FILLER * shown.torque, effort, np.inf)
    torque = np.minimum(np.where(recording.gains.torque_limit > 0.0, recording.gains.torque_limit, np.inf), effort)
    bounded = np.array([joint.bounds == (joint.lower, joint.upper) for joint in joints]) & (high > low)
    largest = Envelope(
        np.where(bounded, low, shown.low),
        np.where(bounded, high, shown.high),
        np.where(np.isfinite(speed), speed, shown.speed),
        np.where(np.isfinite(torque), torque, shown.torque),
    )
    sources = {
        "position": np.where(bounded, "URDF", TRIALS),
        "speed": np.where(np.isfinite(speed), "URDF", TRIALS),
        "torque": np.select([~np.isfinite(torque), torque < effort], [TRIALS, "controller"], "URDF"),
    }
    return Limits(largest, {key: tuple(map(str, chosen)) for key, chosen in sources.items()})


DURATION = 12.0  # [s] of a finger
FASTEST = 1.5  # times the fastest command of the recording: known to be safe, with a little more
DRIVEN = 0.9  # part of a command that drives, where commands are torques: then it rests, and the joint comes to a stop


def excitations(recording: Recording, seed: int, unit: float = 1.0) -> dict[str, Array]:
    """Return the commands (T, n) of each kind, inside those of the recording and near their speed.

    Torques begin with a push away from the nearer end of the range and swing like a cosine, so that the way that they
    drive a free mass has an end; at last they rest, until friction has stopped it.

    Args:
        recording: what has been played so far.
        seed: of phases and levels.
        unit: what a second of a finger stands for [s].
    """
    everything, middle = np.concatenate([trial.command for trial in recording.trials]), middle_command(recording)
    half = np.maximum(np.minimum(everything.max(axis=0) - middle, middle - everything.min(axis=0)), 0.0)
    fastest = np.max([np.abs(np.diff(trial.command, axis=0)).max(axis=0) for trial in recording.trials], axis=0)
    time: Array = np.arange(round(DURATION * unit / recording.step), dtype=np.float64) * recording.step / unit
    waves = _waves(time[:, None], recording, np.random.default_rng(seed))
    if recording.torque_controlled:
        driven = (time > 0.0) & (time < DRIVEN * time[-1])
        waves = {kind: wave * driven[:, None] for kind, wave in waves.items()}
    commands = {kind: middle + half * wave for kind, wave in waves.items()}
    for command in commands.values():
        for k in range(1, len(command)):
            change = command[k] - command[k - 1]
            command[k] = command[k - 1] + np.clip(change, -FASTEST * fastest, FASTEST * fastest)
    return commands


def middle_command(recording: Recording) -> Array:
    """Return the command (n,) to move about: mid-range, or the torque that holds the links where they start."""
    if not recording.torque_controlled:
        everything = np.concatenate([trial.command for trial in recording.trials])
        return np.asarray(0.5 * (everything.min(axis=0) + everything.max(axis=0)))
    tree = recording.rigid_body()
    configuration, still = tree.expand(recording.trials[-1].position[0]), np.zeros(tree.dofs)
    return np.asarray(tree.coupling.T @ tree.equations(configuration, still, recording.gravity)[1])


def _waves(time: Array, recording: Recording, rng: np.random.Generator) -> dict[str, Array]:
    """Return the commands between -1 and 1 at times (T, 1) [s] of a finger."""
    joints = len(recording.joints)
    phases = rng.uniform(0.0, 2.0 * np.pi, joints)
    if recording.torque_controlled:
        middle, _ = limits_of(recording).largest.middle_and_half
        phases = 0.5 * np.pi * np.where(recording.trials[-1].position[0] < middle, 1.0, -1.0)
    growing = time / time[-1]
    levels = rng.uniform(-0.9, 0.9, (round(float(time[-1, 0])) + 1, joints))

    def triangle(turns: Array) -> Array:
        """Return a triangle wave with the signs and peaks of a sine."""
        turns = turns + phases / (2.0 * np.pi) - 0.25
        return np.asarray(1.0 - 4.0 * np.abs(turns - np.floor(turns + 0.5)))

    return {
        "slow triangles": triangle(time / 6.0),
        "fast triangles": triangle(time / 1.0),
        "growing triangles": growing**2 * triangle(time / 1.5),
        "tiny triangles": 0.05 * triangle(time / 2.0),
        "growing steps": (0.1 + 0.9 * growing) * np.sign(np.sin(2 * np.pi * time / 1.6 + phases)),
        "rising frequency": 0.4 * np.sin(2 * np.pi * (0.2 * time + 0.3 * time**2) + phases),
        "holds with small moves": levels[np.minimum(time[:, 0].astype(int), len(levels) - 1)],
    }


SCALES = [0.8**k for k in range(11)]  # of a command about its middle, down to a tenth


@dataclass(frozen=True)
class Safety:
    """Envelope of a command in all models that may be true, and its limits.

    Attributes:
        limits: of the machine.
        margin: part of each stated limit that is kept free.
        reached: the furthest in any model; of a command that is not safe, up to the first model that leaves the limits.
        scale: of the command, relative to the excitation as it was designed.
        models: how many may be true: each explanation, and with its numbers at either end of their intervals.
        starts: (S, n) positions at which it began, under the joint offsets of each initialisation; the last one is
            where the machine stands now [rad].
        open_loop: the commands are torques, and nothing brings the joints back.
    """

    limits: Limits
    margin: float
    reached: Envelope
    scale: float
    models: int
    starts: Array
    open_loop: bool

    @property
    def allowed(self) -> Envelope:
        """The limits less the margin."""
        return self.limits.allowed(self.margin)

    @property
    def safe(self) -> bool:
        """Whether no model leaves the limits less the margin."""
        return within_limits(self.reached, self.limits, self.margin)


class PossibleMotions:
    """Simulation of commands in the models that may be true.

    Fitted models are simulated from every start, those with numbers at either end of their intervals from the last.
    """

    def __init__(self, shooting: Shooting, recording: Recording, fits: Sequence[Fit], margin: float) -> None:
        """Simulate nothing yet; `margin` is the part of each stated limit that is kept free."""
        self.shooting, self.recording, self.margin = shooting, recording, margin
        zero, self.limits = no_offsets(recording), limits_of(recording)
        self.fits = [fit.model.with_offsets(zero) for fit in fits]
        self.ends = [[model.with_offsets(zero) for model in interval_ends(fit)] for fit in fits]

    def safe_trials(self, seed: int) -> list[tuple[Trial, Safety]]:
        """Return each excitation at the largest scale within the limits, or at the smallest scale if none is safe.

        If the smallest scale is not safe, the scales in between are not simulated.
        """
        middle, found = middle_command(self.recording), []
        for kind, commands in excitations(self.recording, seed, self.shooting.time).items():

            def at(scale: float, kind: str = kind, commands: Array = commands) -> tuple[Trial, Safety]:
                less = middle + scale * (commands - middle)
                trial = trials_from_rest(self.recording, kind, less)[-1]
                return replace(trial, initialisation=0), self.safety(kind, less, scale)

            largest, *between, least = SCALES
            if not (one := at(largest))[1].safe and (one := at(least))[1].safe:
                one = next((safe for safe in map(at, between) if safe[1].safe), one)
            found.append(one)
        return found

    def safety(self, kind: str, commands: Array, scale: float = 1.0) -> Safety:
        """Simulate commands (T, n) from rest until they end or a model leaves the limits, and return their safety."""
        trials = trials_from_rest(self.recording, kind, commands)
        low, high, still = commands.min(axis=0), commands.max(axis=0), np.zeros(commands.shape[1])
        reached = Envelope(low, high, still, still)
        if open_loop := self.recording.torque_controlled:
            reached = Envelope.around(Envelope.of_motion(t.position, t.command, t.step) for t in trials)
        for one in self._simulated(trials):
            reached = Envelope.around([reached, one])
            if not within_limits(reached, self.limits, self.margin):
                break
        count = len(self.fits) + sum(map(len, self.ends))
        starts = np.array([trial.position[0] for trial in trials])
        return Safety(self.limits, self.margin, reached, scale, count, starts, open_loop)

    def _simulated(self, trials: Sequence[Trial]) -> Iterator[Envelope]:
        """Yield the envelope of each model, of fitted ones in every trial; it includes read and true positions."""
        last = trials[-1]
        batches = [*((self.fits, trial) for trial in reversed(trials)), *((models, last) for models in self.ends)]
        for models, trial in batches:
            for model, (run,) in zip(models, self.shooting.free_runs(models, [trial]), strict=True):
                motion = Envelope.of_motion(run.position, run.torque, trial.step)
                offset = model.offsets[trial.initialisation]
                low, high = motion.low + np.minimum(offset, 0.0), motion.high + np.maximum(offset, 0.0)
                yield replace(motion, low=low, high=high)


def trials_from_rest(recording: Recording, kind: str, commands: Array) -> list[Trial]:
    """Return trials of these commands from rest, one for each start that the recording has shown, the last one last.

    A joint whose position is controlled begins where its first command puts it, under the joint offsets of each
    initialisation; one that is driven by torque where any of the trials began.
    """
    time: Array = np.arange(len(commands), dtype=np.float64) * recording.step
    valid = np.ones(len(time), dtype=bool)
    starts = [
        (trial.initialisation, tuple(trial.position[0] if recording.torque_controlled else commands[0]))
        for trial in reversed(recording.trials)
    ]
    starts = [*reversed(dict.fromkeys(starts))]
    signals = [(number, (time, commands, np.tile(start, (len(time), 1)))) for number, start in starts]
    return [
        Trial(*own, name=kind, file="", kind=kind, initialisation=number, valid=valid, gains=recording.gains)
        for number, own in signals
    ]


def interval_ends(fit: Fit) -> list[Model]:
    """Return the models with each number at either end of its 95 % interval, the others refitted to that.

    A number of one kind is at its end at all joints at once, so that a hand needs no more models than a joint.
    A number that is not identifiable stays as fitted: its interval has no ends.
    """
    covariance, unknowns = covariance_of_numbers(fit)
    misfit = max(1.0, fit.cost / max(int(np.count_nonzero(fit.residual)), 1))
    width = NORMAL_95 * np.sqrt(misfit) * np.array([unknown.scale for unknown in unknowns])
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    known = deviation > 0.0  # pinv leaves none where the data say nothing
    shifts = width[:, None] * np.divide(covariance, deviation, out=np.zeros_like(covariance), where=known)
    values = read_all(fit.model, unknowns)
    names = [(unknown.kind, unknown.key) for unknown in unknowns]
    together = [shifts[:, [one == name for one in names]].sum(axis=1) for name in dict.fromkeys(names)]
    return [put_all(fit.model, unknowns, values + sign * shift) for shift in together for sign in (-1.0, 1.0)]


def covariance_of_numbers(fit: Fit) -> tuple[Array, tuple[Unknown, ...]]:
    """Return the covariance (P, P) in units of the scales of what was fitted beside joint offsets, and what that is."""
    kept = [k for k, unknown in enumerate(fit.unknowns) if unknown.kind != "offset"]
    covariance = np.linalg.pinv(fit.information + np.diag(precision(fit.unknowns)))[np.ix_(kept, kept)]
    return np.asarray(covariance), tuple(fit.unknowns[k] for k in kept)
