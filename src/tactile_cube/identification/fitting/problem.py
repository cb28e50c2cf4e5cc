"""Multiple shooting: windows that start from what was measured, and their least-squares problem."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects.effect import Array, Effect
from tactile_cube.drivetrain.effects.friction import PreslidingFriction
from tactile_cube.errors import InputError
from tactile_cube.identification.fitting.unknowns import Unknown
from tactile_cube.measurement.comparing.noise_floor import of_one_command
from tactile_cube.measurement.joint_scales import joint_scales
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.replay.model import Model
from tactile_cube.measurement.replay.simulator import Path, Simulator
from tactile_cube.measurement.replay.windows import LONGEST_STEP, START_SPEED, Windows, cut

POSITION_STEP, SPEED_STEP = 5e-4, 0.02  # [rad], [rad/s] of a finger: finite differences of a segment's start


class Shooting(Simulator):
    """The simulator of a recording in steps, segments and differences of its machine's size."""

    def __init__(self, recording: Recording, effects: Sequence[type[Effect]]) -> None:
        """Build the plant.

        Args:
            recording: rig, controller and sampling step.
            effects: classes that a model may use, beside those of the catalogue.

        Raises:
            InputError: no joint moves.
        """
        if not any(np.ptp(trial.position, axis=0).any() for trial in recording.trials):
            raise InputError(f"{recording.folder}: no joint moves in any trial; record motion, or check the columns")
        self.scales = joint_scales(recording)
        self.sizes = dict(zip(recording.joints, self.scales, strict=True))
        time = self.scales[0].time
        super().__init__(recording, effects, LONGEST_STEP * time, time=time)

    @cached_property
    def command_of(self) -> dict[int, tuple[int, int]]:
        """Trial -> the number of its command, and by how many samples it starts later in it than the first one."""
        groups = of_one_command(self.recording.trials)
        return {trial: (number, lag) for number, group in enumerate(groups) for trial, lag in group}

    @property
    def start_speed(self) -> Array:
        """How well the speed at a segment's start is known beforehand, (n,) [rad/s]."""
        return START_SPEED * self.per_joint("rad/s")

    def cut(
        self,
        recording: Recording,
        noise: Array,
        trials: Sequence[Trial] | None = None,
        segment: int | None = None,
    ) -> Windows:
        """Cut the trials of a recording into windows of this machine's size, see `windows.cut`."""
        return cut(recording, noise, trials, segment, self.time, self.start_speed)

    def per_joint(self, unit: str) -> Array:
        """Return the size of values in a unit at each joint, relative to a finger's, (n,)."""
        return np.array([scales.of(unit) for scales in self.scales])

    def positions(self, models: Sequence[Model], windows: Windows, near: Path | None = None) -> Array:
        """Return the readings that each model predicts, (models, S, K segment, sensors) [rad]; `near` a path or not."""
        return self.simulate(models, [windows] * len(models), near=near)[:, 0]

    def positions_from(self, model: Model, initial_states: Sequence[Array], windows: Windows) -> Array:
        """Simulate one model from several `initial_state`s, (initial states, S, K segment, sensors) [rad]."""
        begun = [replace(windows, initial_state=one) for one in initial_states]
        return self.simulate([model] * len(begun), begun)[:, 0]

    def start_sensitivity(self, model: Model, windows: Windows, path: Path | None = None) -> Array:
        """Return D position / d start of each segment, (2 n, S, K segment, sensors): by n positions, then n speeds.

        `path` is the model's own through these windows, if it is known.
        """
        path = path or self.path(model, windows)
        joints = len(self.recording.joints)
        correction = np.diag([*(POSITION_STEP * self.per_joint("rad")), *(SPEED_STEP * self.per_joint("rad/s"))])
        count = 2 * joints
        moved = self.simulate([model] * count, [windows] * count, correction, near=path)[:, 0]
        # a simulation that ran away has no slope; it would swamp those of all others
        most = self.per_joint("rad")[windows.joint_of]
        change = np.clip(np.nan_to_num(moved - path.position, nan=0.0), -most, most)
        return np.asarray(change / correction.max(axis=1)[:, None, None, None])


START_POSITION = 1e-3  # [rad] of a finger, as all sizes here: how well a segment's start is known beforehand
START_SPEED_PER_ACCELERATION = 0.01  # [s]
RUN_AWAY = 1.0  # [rad] error assigned to a simulation that ran away
WOUND, REWOUND = 0.1, 2  # [N m] what an integral may hold beyond balance; Gauss-Newton steps that find it
STEP = 0.2  # finite differences, in units of an unknown's scale: wide enough to bridge short sticking
FINE = 0.02  # the same where those led to no descent: secants may point the wrong way


class Problem:
    """Residuals (G, R) of G segments with R samples, in units of the sensor noise.

    Each segment's start is a nuisance with a Gaussian prior. `free(x)` multiplies by the inverse covariance that is
    left when it is integrated out, so `sum(x * free(y))` is the inner product of the marginal likelihood.
    """

    finest = FINE

    def __init__(self, shooting: Shooting, windows: Windows) -> None:
        self.shooting = shooting
        self.windows = windows
        self.weight = windows.by_segment(windows.weight)
        self.measured = windows.by_segment(windows.measured)
        self.segment_trial = np.repeat(windows.trial, windows.segments)
        self.run_away = np.tile(RUN_AWAY * shooting.per_joint("rad")[windows.joint_of], windows.segment)
        self.segment_initialisation = np.repeat(windows.initialisation, windows.segments)
        self._starts: Array = np.zeros((*self.weight.shape, 0))
        self._inverse: Array = np.zeros((len(self.weight), 0, 0))
        self._path: tuple[Model, Windows, Path] | None = None

    @cached_property
    def alike(self) -> list[int]:
        """Group numbers (G,) of segments with similar model errors: the same command at about the same time."""
        numbers: dict[tuple[int, int], int] = {}
        found = []
        for trial, time in zip(self.windows.trial, self.windows.time, strict=True):
            command, lag = self.shooting.command_of[int(trial)]
            first = round((time / self.shooting.recording.step + lag) / self.windows.segment)
            for k in range(self.windows.segments):
                found.append(numbers.setdefault((command, first + k), len(numbers)))
        return found

    def path(self, model: Model) -> Path:
        """Return the model's path through the windows; the last one is cached."""
        if self._path is None or self._path[0] is not model or self._path[1] is not self.windows:
            self._path = model, self.windows, self.shooting.path(model, self.windows)
        return self._path[2]

    def prediction(self, model: Model) -> Array:
        """Return the positions that a model predicts, (G, R) [rad]."""
        return self.windows.by_segment(self.path(model).position)

    def linearise_starts(self, model: Model) -> None:
        """Take the initial states of trials and the sensitivity to segment starts from this model from now on."""
        if self.windows.wound.any():  # another model's
            self.windows = replace(self.windows, wound=np.zeros_like(self.windows.wound))
        self.windows = with_initial_states(self.shooting, model, self.windows)
        self._linearise_segments(model)
        if any(t.effect is PreslidingFriction and t.values["breakaway"] > 0.0 for t in model.terms):
            self._choose_balance(model)
        for _ in range(REWOUND if (joints := self.shooting.integrating(model)) else 0):
            self._take_wound(model, self._more_wound(model, joints))

    def _choose_balance(self, model: Model) -> None:
        """Begin each trial with its bristles balanced or unbent, as its first segment says."""
        first = self.windows.time == 0.0
        other = replace(self.windows, balanced=self.windows.balanced ^ first[:, None])
        costs = [
            self.cost(self.residual(self.windows.by_segment(position[0])))[:: self.windows.segments]
            for position in self.shooting.simulate([model] * 2, [self.windows, other])
        ]
        if (wrong := first & (costs[1] < costs[0])).any():
            self.windows = replace(self.windows, balanced=self.windows.balanced ^ wrong[:, None])
            self._linearise_segments(model)

    def _take_wound(self, model: Model, wound: Array) -> None:
        """Take other wind-ups (S, n) [N m] in the trials that they fit better; beyond a clamp they only do harm."""
        before, windows = self.cost(self.residual(self.prediction(model))), self.windows
        self.windows = replace(windows, wound=wound)
        change = self.cost(self.residual(self.prediction(model))) - before
        better = [trial for trial in np.unique(windows.trial) if change[self.segment_trial == trial].sum() < 0.0]
        wound = np.where(np.isin(windows.trial, better)[:, None], wound, windows.wound)
        self.windows = replace(windows, wound=wound)

    def _more_wound(self, model: Model, joints: list[int]) -> Array:
        """Return the integrals' wind-up (S, n) as trials begin, which no log shows, after a Gauss-Newton step [N m]."""
        prior = WOUND * self.shooting.per_joint("N m")[joints]
        moved = [
            self.windows.wound + prior[k] * STEP * np.eye(self.windows.wound.shape[1])[j] for k, j in enumerate(joints)
        ]
        begun = [self.windows, *(replace(self.windows, wound=one) for one in moved)]
        base, *others = (self.windows.by_segment(p[0]) for p in self.shooting.simulate([model] * len(begun), begun))
        left = self.free(self.residual(base))
        columns = np.stack([self.limited(other - base) / STEP * self.weight for other in others], axis=-1)
        freed = self.free(columns)
        wound = self.windows.wound.copy()
        for trial in np.unique(self.windows.trial):
            own = self.segment_trial == trial
            part = columns[own].reshape(-1, len(joints))
            gram = part.T @ freed[own].reshape(part.shape) + np.eye(len(joints))
            more = prior * np.linalg.solve(gram, part.T @ left[own].ravel())
            wound[np.ix_(self.windows.trial == trial, joints)] += more
        return wound

    def _linearise_segments(self, model: Model) -> None:
        raw = self.shooting.start_sensitivity(model, self.windows, self.path(model))
        columns = np.stack([self.windows.by_segment(column) for column in raw], axis=-1)
        acceleration = np.abs(self.windows.acceleration).reshape(len(self.weight), -1)
        known, sure = self.shooting.start_speed, START_POSITION * self.shooting.per_joint("rad")
        speed = known + START_SPEED_PER_ACCELERATION * self.shooting.time * acceleration
        known_to = np.concatenate([np.broadcast_to(sure, speed.shape), speed], axis=1)
        spread = np.hypot(known_to, self.windows.start_noise.reshape(known_to.shape))
        self._starts = np.asarray(columns * self.weight[..., None] * spread[:, None])
        gram = np.swapaxes(self._starts, 1, 2) @ self._starts
        self._inverse = np.asarray(np.linalg.inv(gram + np.eye(gram.shape[-1])), dtype=np.float64)

    def chosen_numbers(self, model: Model) -> NDArray[np.int64]:
        """Count the initial-state parameters (G,) fitted to each segment itself, see `linearise_starts`."""
        first = np.zeros((len(self.windows), self.windows.segments), dtype=np.int64)
        first[self.windows.time == 0.0, 0] = 2 * np.count_nonzero(self.shooting.gaps(model))
        first[np.unique(self.windows.trial, return_index=True)[1], 0] += len(self.shooting.integrating(model))
        return np.asarray(first.ravel())

    def free(self, x: Array) -> Array:
        """Return the residuals or columns (G, R) or (G, R, P) with the starts integrated out."""
        wide = x if x.ndim == 3 else x[..., None]
        inner = np.swapaxes(self._starts, 1, 2) @ wide
        freed: Array = wide - self._starts @ (self._inverse @ inner)
        return freed if x.ndim == 3 else freed[..., 0]

    def predictions(self, models: Sequence[Model], near: Model | None = None) -> Array:
        """Return (models, G, R) [rad]; of models that are close to one that is given, at a third of the cost."""
        simulated = self.shooting.positions(models, self.windows, self.path(near) if near else None)
        return np.stack([self.windows.by_segment(one) for one in simulated])

    def residual(self, prediction: Array) -> Array:
        """Return the weighted measured - predicted (G, R); a simulation that ran away counts as far off."""
        return self.limited(self.measured - prediction) * self.weight

    def limited(self, change: Array) -> Array:
        """Return the differences of positions (G, R), none larger than that of a simulation that ran away."""
        known = np.where(np.isnan(change), self.run_away, change)
        return np.asarray(np.clip(known, -self.run_away, self.run_away))

    def cost(self, residual: Array) -> Array:
        """Return the marginal squared error of each segment (G,), in units of the sensor's variance."""
        return np.asarray(np.sum(residual * self.free(residual), axis=1))

    def columns(self, model: Model, unknowns: Sequence[Unknown], step: float = STEP) -> tuple[Array, Array]:
        """Return a model's prediction (G, R) and derivatives (G, R, P), weighted, per unit of each unknown's scale."""
        base = self.prediction(model)
        if not unknowns:
            return base, np.zeros((*base.shape, 0))
        moved = [moved_model(model, unknown, step) for unknown in _simulated(unknowns)]
        predictions = self.predictions([one for one, _ in moved], model)
        found = {
            _key(unknown): (np.clip(p - base, -self.run_away, self.run_away) / width * self.weight)
            for unknown, p, (_, width) in zip(_simulated(unknowns), predictions, moved, strict=True)
        }
        columns = [self._masked(found[_key(unknown)], unknown) for unknown in unknowns]
        return base, np.nan_to_num(np.stack(columns, axis=-1))

    def _masked(self, column: Array, unknown: Unknown) -> Array:
        if unknown.kind != "offset":
            return column
        return np.asarray(column * (self.segment_initialisation == unknown.initialisation)[:, None])


def _key(unknown: Unknown) -> tuple[str, str, int]:
    return unknown.kind, unknown.key, unknown.place


def _simulated(unknowns: Sequence[Unknown]) -> list[Unknown]:
    """Return one unknown per simulation: the offsets of one joint in all initialisations share one."""
    return list({_key(unknown): unknown for unknown in unknowns}.values())


def moved_model(model: Model, unknown: Unknown, part: float = STEP) -> tuple[Model, float]:
    """Move an unknown by a finite step within its bounds; return the model and the step in units of its scale."""
    step = part * unknown.scale
    if unknown.kind == "offset":
        moved = {key: value + step * (np.arange(len(value)) == unknown.place) for key, value in model.offsets.items()}
        return Model(model.constants, model.terms, moved), part
    value = unknown.of(model)
    step = step if value + step <= unknown.high else -step
    if value + step < unknown.low:
        step = unknown.low - value if value > unknown.low else unknown.high - value
    return unknown.put(model, value + step), step / unknown.scale


PLACES = 17  # within the gap: the time of landing depends on them


def with_initial_states(shooting: Shooting, model: Model, windows: Windows) -> Windows:
    """Return the windows with the initial state of each trial that fits its first segment best, joint by joint.

    A link may start anywhere within the gap, at rest or at the motor's speed. Without a gap it starts at the motor's
    position, whatever initial state another model had.
    """
    gap = shooting.gaps(model)
    if not gap.any():
        none = np.zeros_like(windows.initial_state)
        return replace(windows, initial_state=none) if windows.initial_state.any() else windows
    at_start = np.flatnonzero(windows.time == 0.0)
    first = windows.take(at_start).first_segments()
    first = replace(first, initial_state=np.zeros_like(first.initial_state))
    for joint in np.flatnonzero(gap):
        first = replace(first, initial_state=_best(shooting, model, first, int(joint), float(gap[joint])))
    initial_state = windows.initial_state.copy()
    initial_state[at_start] = first.initial_state
    return replace(windows, initial_state=initial_state)


def _best(shooting: Shooting, model: Model, first: Windows, joint: int, gap: float) -> Array:
    """Return the initial states (S, 2 n) with that of one joint chosen by least squares over its gap."""
    count, joints = len(first), first.position.shape[2]
    trials = []
    for still in (False, True):
        for place in np.linspace(-0.5 * gap, 0.5 * gap, PLACES):
            trial = first.initial_state.copy()
            trial[:, joint] = place
            trial[:, joints + joint] = -first.speed[:, 0, joint] if still else 0.0
            trials.append(trial)
    simulated = shooting.positions_from(model, trials, first)
    error = (simulated - first.measured) * first.weight
    squares = np.nan_to_num(error**2, nan=np.inf).reshape(len(trials), count, -1).sum(axis=2)
    return np.asarray(np.array(trials)[squares.argmin(axis=0), np.arange(count)])
