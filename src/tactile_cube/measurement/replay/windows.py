"""A recording cut for multiple shooting: windows simulated in one go, made of short segments started anew."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.recordings.description import KnownForce
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Array, Trial
from tactile_cube.measurement.replay.model import TORQUE_MODE_GAIN

Rows = NDArray[np.int64]
SEGMENT = 0.4  # [s] identification works best with 0.2-0.5 s: beyond, errors of start and model look alike
WINDOW = 11  # segments simulated without a break, so that effects with a memory keep it
LEAD = 1  # segments at the beginning of a window that only wake such memories, unless a trial begins there
HISTORY = 8.0  # [s] of commands before a window at most, for effects that remember them, such as a rate limit
WAKING = 0.15  # [s] of the first command before a free run, for effects with a memory
LONGEST_STEP = 0.0021  # [s] of the simulation; of a finger, as all times here
FEWEST_AROUND = 3  # samples on either side of a start that its speed is read from
WELL = 0.1  # of the required accuracy of the speed, where fewer samples than usual are taken
FEWEST = 4  # samples that a window after a trial's first one needs
NO_LINKS = np.zeros(0, dtype=np.int64)
SMOOTHING = 0.025  # [s] half width of the polynomial that reads the speed at a segment's start
START_SPEED = 0.02  # [rad/s] how well the speed at a segment's start is known beforehand
SAFE = 0.25  # part of the torque limit below which the torque is proportional to a jump of the command
ABOUT = 0.1  # part of its length by which a segment may be shorter or longer
UNSTEADY = 0.125  # [s] after a step of the command: a drive's delay, and what a speed is read from
MANY = 12  # samples around a start that suffice for a polynomial of fourth degree


@dataclass(frozen=True)
class Windows:
    """S windows of K segments of `segment` rows each; n joints; M sensors: the motors', then those on links."""

    commands: Array  # (S, (H + K segment) substeps, n) what each step takes, after `history` rows of the past [rad]
    held: Array  # (S, H + K segment, n) what each row's steps end with [rad]
    measured: Array  # (S, K segment, M) measured positions [rad]
    # (S, K segment, n) command of the step at each reading less the one that the log feels: half the change of the
    # command, or of what the torque reaches [rad]
    jump: Array
    weight: Array  # (S, K segment, M) 1 / sensor noise; 0 where nothing was measured [1/rad]
    # (S, K, n) measured position at each segment's start, under the mean command of the jump there [rad]
    position: Array
    speed: Array  # (S, K, n) [rad/s]
    acceleration: Array  # (S, K, n) measured at each segment's start, a gauge of how well the speed is known [rad/s^2]
    start_noise: Array  # (S, K, 2 n) what sensor noise makes of positions [rad] and speeds [rad/s] at segments' starts
    gains: Array  # (S, 3, n) kp, kd and torque limit of the trial over those of the recording
    trial: NDArray[np.int64]  # (S,) index of the trial
    initialisation: NDArray[np.int64]  # (S,) robot initialisation
    time: Array  # (S,) of the first row in its trial [s]
    begun: Array  # (S,) when the trial began, from the start of its initialisation [s]
    clamped: NDArray[np.bool_]  # (S,) the links were held still
    # (S, 2 n) how far links stand from where their sensors put them as the window begins [rad], and how much faster
    # they are [rad/s]; see `initial_states`
    initial_state: Array
    # (S, n) friction's bristles balance the load as the window begins; they are unbent otherwise
    balanced: NDArray[np.bool_]
    trial_start: Array  # (S, 3, n) position, command [rad] and speed [rad/s] of the trial's first step
    wound: Array  # (S, n) what the integral of a controller holds beyond balance as the trial begins [N m]
    # of each window, (rows before it, 2, n): errors of the trial's position times the sampling step [rad s], and how
    # far it moved [rad]
    errors: tuple[Array, ...]
    forces: tuple[KnownForce | None, ...]  # known forces on a link, or None
    joint_of: NDArray[np.int64]  # (M,) joint that each sensor belongs to
    history: int  # H
    segment: int  # rows of a segment
    substeps: int  # simulation steps from row to row

    @property
    def segments(self) -> int:
        """K, segments of a window."""
        return int(self.position.shape[1])

    def __len__(self) -> int:
        return len(self.commands)

    def take(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> Self:
        """Return some of the windows."""
        places = [int(k) for k in np.arange(len(self))[chosen]]
        picked: dict[str, Any] = {key: tuple(getattr(self, key)[k] for k in places) for key in ("forces", "errors")}
        return replace(self, **{key: getattr(self, key)[chosen] for key in ROWS}, **picked)

    def first_segments(self) -> Self:
        """Return only the first segment of each window."""
        rows = slice(self.segment)
        return replace(
            self,
            commands=self.commands[:, : (self.history + self.segment) * self.substeps],
            held=self.held[:, : self.history + self.segment],
            **{key: getattr(self, key)[:, rows] for key in ("measured", "jump", "weight")},
            **{key: getattr(self, key)[:, :1] for key in ("position", "speed", "acceleration", "start_noise")},
        )

    def by_segment(self, values: Array) -> Array:
        """Reshape (S, K segment, n) to (S K, segment n)."""
        return values.reshape(len(self) * self.segments, -1)


ROWS = tuple(field.name for field in fields(Windows))[:19]  # arrays with one row a window


def cut(
    recording: Recording,
    noise: Array,
    trials: Sequence[Trial] | None = None,
    segment: int | None = None,
    time: float = 1.0,
    speed: Array | float = np.inf,
) -> Windows:
    """Cut trials of a recording, all by default, into windows of segments of `segment` rows, short ones by default.

    `noise` (n,) [rad] is the standard deviation of each joint's position sensor, (2 n,) with those on links; `time` [s]
    corresponds to a second of a finger; `speed` (n,) [rad/s] is the required accuracy of speeds at segments' starts.
    """
    trials = recording.trials if trials is None else trials
    longest = max(len(trial.time) for trial in trials)
    segment = min(segment or between_steps(trials, max(8, round(SEGMENT * time / recording.step)), time), longest)
    rows = segment * min(WINDOW, -(-longest // segment))
    forward = max(rows - LEAD * segment, segment)  # from the start of a window to that of the next one
    history = min(round(HISTORY * time / recording.step), (longest - 1) // forward * forward)
    substeps = steps_per_row(recording, time)
    links = np.unique(np.concatenate([trial.linked for trial in trials]))
    joints = len(recording.joints)
    noise = noise[[*range(joints), *(joints + links)]]
    return _windows(recording, trials, Cut(rows, forward, segment, history, noise, time, speed, substeps, links))


def between_steps(trials: Sequence[Trial], rows: int, time: float = 1.0) -> int:
    """Return a segment's length, within a tenth of `rows`, with which fewest segments begin as a command has jumped.

    Commands often jump at round times. A measured start does not show what a drive does then, least within a gap.
    """
    lengths = np.arange(rows - round(ABOUT * rows), rows + round(ABOUT * rows) + 1)
    jumped = np.zeros(len(lengths))
    for trial in trials:
        jumps = np.abs(np.diff(trial.command, axis=0, prepend=trial.command[:1]))
        size = (jumps / np.maximum(jumps.max(axis=0), np.finfo(float).tiny)).max(axis=1)
        ended = np.concatenate([np.zeros(1), np.cumsum(size)])
        for k, length in enumerate(lengths):
            starts = np.arange(0, len(size), length)[1:]
            before = np.maximum(starts - round(UNSTEADY * time / trial.step), 0)
            jumped[k] += np.sum(ended[starts + 1] - ended[before + 1])
    order = np.argsort(np.abs(lengths - rows), kind="stable")
    return int(lengths[order[np.argmin(jumped[order])]])


def whole_trials(
    recording: Recording,
    trials: Sequence[Trial],
    substeps: int,
    time: float = 1.0,
    noise: Array | float = 1.0,
    speed: Array | float = np.inf,
) -> Windows:
    """Make each trial a window of one segment, simulated freely from its measured start.

    Shorter trials hold their last command until the longest one has ended. The speed at a start is estimated from
    as few samples as the sensor noise (n,) [rad] permits for an accuracy of `speed` (n,) [rad/s].
    """
    longest = max(len(trial.time) for trial in trials)
    history = round(WAKING / recording.step)
    noise = np.broadcast_to(noise, len(recording.joints))
    if not _tells(recording.step, _usual(recording.step, time), noise, speed):
        speed = np.inf  # more samples than usual would misread a start that moves
    sizes = (longest, longest, longest, history)
    return _windows(recording, trials, Cut(*sizes, noise, time, speed, substeps, NO_LINKS))


class Cut(NamedTuple):
    """Rows of a window, from one to the next, of a segment and of the past; see `cut` for the rest."""

    rows: int
    forward: int
    segment: int
    history: int
    noise: Array
    time: float
    speed: Array | float
    substeps: int
    links: Rows


def _windows(recording: Recording, trials: Sequence[Trial], sizes: Cut) -> Windows:
    pieces = [piece for k, trial in enumerate(trials) for piece in _pieces(recording, trial, k, sizes)]
    columns: dict[str, Any] = {name: np.array([piece[name] for piece in pieces]) for name in ROWS}
    columns |= {key: tuple(piece[key] for piece in pieces) for key in ("forces", "errors")}
    joint_of = np.concatenate([np.arange(len(recording.joints)), sizes.links])
    return Windows(**columns, joint_of=joint_of, history=sizes.history, segment=sizes.segment, substeps=sizes.substeps)


def _pieces(recording: Recording, trial: Trial, index: int, sizes: Cut) -> Iterator[dict[str, object]]:
    rows, forward, segment, history, every, time, speed_known, substeps, links = sizes
    measured, seen = _shown(trial, links)
    noise = every[: trial.position.shape[1]]
    fine, jump = _as_simulated(recording, trial, substeps)
    command, after = _around(_as_positions(recording, trial), recording.description.sensors.read)
    held = np.stack([command, after], axis=1)
    errors = trial.step * (after[:-1] - 0.5 * (trial.position[:-1] + trial.position[1:]))
    errors = np.stack([errors, np.diff(trial.position, axis=0)], axis=1)
    drive = _drive(recording, trial)
    half = _half_width(trial.step, noise, speed_known, time)
    kinks = np.flatnonzero(asks_for_much(jump, drive.kp, drive.limit).any(axis=1))
    for first in range(0, len(trial.time), forward):
        span = np.arange(first, first + rows)
        usable = np.minimum(span, len(trial.time) - 1)
        counted = span >= (first + rows - forward if first > 0 else 0)
        present = (span < len(trial.time)) & trial.valid[usable] & counted
        starts = np.minimum(span[::segment], len(trial.time) - 1)
        present &= ~np.repeat(_unsteady(starts, kinks, round(UNSTEADY * time / trial.step)), segment)
        if first > 0 and np.count_nonzero(present) < FEWEST:
            continue
        position, speed, acceleration, spread = _states(trial, command, jump, drive, kinks, starts, half)
        if first == 0:
            trial_start = np.stack([position[0], fine[0, 0], speed[0]])
        yield {
            "commands": _rows(fine, first - history, first + rows).reshape((history + rows) * substeps, -1),
            "held": _rows(held, first - history, first + rows)[:, 1],
            "measured": measured[usable],
            "jump": np.where((span < len(trial.time))[:, None], jump[usable], 0.0),
            "weight": present[:, None] * seen / every,
            "position": position,
            "speed": speed,
            "acceleration": acceleration,
            "start_noise": np.concatenate([np.broadcast_to(noise, spread.shape), spread * noise], axis=1),
            "gains": _gains(recording, trial),
            "trial": index,
            "initialisation": trial.initialisation,
            "time": first * trial.step,
            "begun": trial.begun,
            "clamped": trial.clamped,
            "initial_state": np.zeros(2 * position.shape[1]),
            "balanced": np.ones(position.shape[1], dtype=bool),
            "trial_start": trial_start,
            "wound": np.zeros(position.shape[1]),
            "errors": errors[:first],
            "forces": trial.force,
        }


def _shown(trial: Trial, links: Rows) -> tuple[Array, NDArray[np.bool_]]:
    """Return the readings of a trial's sensors (T, M) [rad], and which of the sensors it has (M,)."""
    if not len(links):
        return trial.position, np.ones(trial.position.shape[1], dtype=bool)
    both = trial.position[:, links] if trial.link_position is None else trial.link_position[:, links]
    has = np.isin(links, trial.linked)
    shown = np.concatenate([trial.position, np.where(has, both, trial.position[:, links])], axis=1)
    return shown, np.concatenate([np.ones(trial.position.shape[1], dtype=bool), has])


def _as_positions(recording: Recording, trial: Trial) -> Array:
    """Return a trial's commands (T, n) as positions [rad], plus feed-forward torque over the stated stiffness."""
    if recording.torque_controlled:
        added = 0.0 if trial.feedforward is None else trial.feedforward
        return np.asarray((trial.command + added) / TORQUE_MODE_GAIN)
    if trial.feedforward is None:
        return trial.command
    return np.asarray(trial.command + trial.feedforward / trial.gains.kp)


def _as_simulated(recording: Recording, trial: Trial, substeps: int) -> tuple[Array, Array]:
    """Return the commands of a trial's steps (T, substeps, n), and the jump of the command at each reading (T, n)."""
    before, after = _around(_as_positions(recording, trial), recording.description.sensors.read)
    drive = _drive(recording, trial)
    most = drive.limit / np.maximum(drive.kp, np.finfo(float).tiny)
    jump = 0.5 * np.clip(after - before, -most, most)
    # A step acts like an impulse at its beginning, a held command from there on; so the first step of a row takes the
    # mean of the commands before and after it is read, which makes the simulation second order in its step. A command
    # that jumps further than the torque reaches adds no more than half of it: the impulse is the mean of torques.
    fine = np.repeat(after[:, None], substeps, axis=1)
    fine[:, 0] = before + jump
    return fine, jump


def _rows(fine: Array, first: int, last: int) -> Array:
    """Return rows of a trial's commands (T, substeps, n); before the trial its first command, after it the last one."""
    wanted = np.arange(first, last)
    chosen = fine[np.clip(wanted, 0, len(fine) - 1)]
    chosen[wanted < 0] = fine[0, 0]
    chosen[wanted >= len(fine)] = fine[-1, -1]
    return chosen


def steps_per_row(recording: Recording, time: float = 1.0) -> int:
    """Return the simulation steps between two samples."""
    return recording.substeps(LONGEST_STEP * time)


def asks_for_much(jump: Array, kp: Array, limit: Array) -> NDArray[np.bool_]:
    """Return where a jump of the command (..., n) [rad] may bring a torque to its limit (..., n)."""
    return np.asarray(kp * np.abs(jump) > SAFE * limit)


def _gains(recording: Recording, trial: Trial) -> Array:
    """Return kp, kd and torque limit (3, n) of a trial over those of the recording; 1 where the recording has none."""
    own = np.array([trial.gains.kp, trial.gains.kd, trial.gains.torque_limit])
    common = np.array([recording.gains.kp, recording.gains.kd, recording.gains.torque_limit])
    usable = (common > 0) & np.isfinite(common) & np.isfinite(own) & (not recording.torque_controlled)
    return np.where(usable, own / np.where(usable, common, 1.0), 1.0)


class Drive(NamedTuple):
    """Nominal values (n,) by which a drive deflects: kp, kd, torque limit and compliance [rad/(N m)]."""

    kp: Array
    kd: Array
    limit: Array
    compliance: Array


def _drive(recording: Recording, trial: Trial) -> Drive:
    joints = len(recording.joints)
    stiffness = recording.nominal.get("stiffness", np.full(joints, np.inf))
    if recording.torque_controlled:
        return Drive(np.full(joints, TORQUE_MODE_GAIN), np.zeros(joints), np.full(joints, np.inf), 1.0 / stiffness)
    gains = trial.gains
    return Drive(np.array(gains.kp), np.array(gains.kd), np.array(gains.torque_limit), 1.0 / stiffness)


def _around(command: Array, reading: str) -> tuple[Array, Array]:
    """Return the commands (T, n) in force just before and just after each row is read.

    The drive feels the one before, either way: a loop reads first and commands then.
    """
    if reading == "after":
        return command, np.concatenate([command[1:], command[-1:]])
    return np.concatenate([command[:1], command[:-1]]), command


def _half_width(step: float, noise: Array, speed: Array | float, time: float) -> int:
    """Return the number of rows on either side of a start from which its speed is estimated.

    Fewer than usual if these are accurate well beyond need, as a polynomial misfits a speed that changes fast.
    More, up to half a segment, if the usual number leaves the speed too noisy: dry friction depends on its sign.
    """
    usual, most = _usual(step, time), round(0.5 * SEGMENT * time / step)
    if not np.all(np.isfinite(speed)):
        return usual
    fewer = (half for half in range(min(FEWEST_AROUND, usual), usual) if _tells(step, half, noise, WELL * speed))
    more = (half for half in range(usual, most) if _tells(step, half, noise, speed))
    return next(fewer, next(more, max(usual, most)))


def _usual(step: float, time: float) -> int:
    """Return the default number of rows on either side of a start from which its speed is estimated."""
    return max(2, round(SMOOTHING * time / step))


def _tells(step: float, half: int, noise: Array, speed: Array | float) -> bool:
    """Return whether `half` rows on either side are enough to estimate a speed with the accuracy `speed`."""
    basis = np.vander(step * np.arange(-half, half + 1), _terms(half), increasing=True)
    return bool(np.all(np.linalg.norm(np.linalg.pinv(basis)[1]) * noise <= speed))


def _unsteady(starts: Rows, kinks: Rows, rows: int) -> NDArray[np.bool_]:
    """Return the segments (K,) that begin so soon after a kink that their speed changes faster than it is read.

    None where that would be most of them.
    """
    after = np.searchsorted(kinks, starts) - np.searchsorted(kinks, starts - rows)
    late = np.asarray(after > 0)
    return late & (np.count_nonzero(late) <= len(late) // 2)


def _terms(half: int) -> int:
    return 5 if 2 * half >= MANY else 3


def _states(
    trial: Trial, command: Array, jump: Array, drive: Drive, kinks: Rows, rows: Rows, half: int
) -> tuple[Array, Array, Array, Array]:
    """Return the position of the sensor, speed and acceleration of the link (K, n) at some rows, and the speed's noise.

    The last one is its standard deviation where that of a sample is one [1/s]. `command` (T, n) is felt by each row.

    The sensor follows every kink of the command, for the drive deflects with its torque; the link does not. So speed
    and acceleration come from a polynomial through the samples around, with the drive's deflection taken off: of
    fourth degree, since a joint that is pulled out of its stiction is fast before a parabola can follow, or a parabola
    where samples lie on one side only or are few. It ends at the next of the trial's kinks (rows).
    """
    torque = np.clip(drive.kp * (command - trial.position), -drive.limit, drive.limit)
    link = trial.position - drive.compliance * torque  # behind by compliance * kd * speed
    damping = drive.compliance * drive.kd  # [s]
    found, spread = [], []
    for row in rows:
        last = min([len(trial.time) - 1, row + half, *kinks[kinks >= row]])
        near = slice(max(0, row - half), last + 1)
        centred = near.start == row - half and near.stop == row + half + 1
        terms = _terms(half) if centred else 3
        basis = np.vander(trial.time[near] - trial.time[row], terms, increasing=True)
        found.append(np.linalg.lstsq(basis, link[near], rcond=None)[0][1:3])
        slope_of, bend_of = np.linalg.pinv(basis)[1:3]
        spread.append(np.linalg.norm(slope_of + 2.0 * damping[:, None] * bend_of, axis=1))
    slope, half_curvature = np.moveaxis(np.array(found), 1, 0)
    acceleration = 2.0 * half_curvature
    soft = drive.kp * drive.compliance  # of a jump of the command the sensor follows a part, for the drive deflects
    position = trial.position[rows] + soft / (1.0 + soft) * jump[rows]
    return position, slope + damping * acceleration, acceleration, np.array(spread)
