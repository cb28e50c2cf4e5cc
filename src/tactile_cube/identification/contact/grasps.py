"""Least-squares problem of trials with an object, each simulated in the world that training uses.

Where a fingertip first touches decides how hard it presses later, and joint offsets of a degree move it by millimetres.
So every value of a contact effect is judged with the offsets and the place of the object that suit it best, found anew
from zero: what suits another value would pull the answer to where the search began.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, replace

import numpy as np

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.fitting.problem import RUN_AWAY, STEP, Problem
from tactile_cube.identification.fitting.unknowns import Unknown
from tactile_cube.identification.search.evidence import Judgement
from tactile_cube.measurement.bench import with_object
from tactile_cube.measurement.comparing.comparison import Comparison, describe_comparison
from tactile_cube.measurement.comparing.error import ErrorSummary, summarise_errors
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor, sensor_noise
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Array, Trial
from tactile_cube.measurement.replay.hand_replay import ContactModel, HandReplay, contact_of
from tactile_cube.measurement.replay.model import Model, Term, nominal_model, require_same_joints
from tactile_cube.measurement.replay.simulator import Simulated
from tactile_cube.measurement.split import held_out_split
from tactile_cube.simulation.contact_effects import ContactEffect, contact_catalogue

OBJECT = "object"  # where contact effects act, in the place of a joint
OFFSET = 0.02  # [rad] standard deviation of a joint offset; the paper's initialisations differ by degrees
PLACING = 1e-3  # [m] with which somebody puts the box in its place
FARTHEST = 3e-3  # [m] it is never farther from there
LEFT = 1e-3  # [rad] error that the world leaves in contact: drives known to 10 %, a solver that stops early
SCALE = 3 * LEFT  # beside which an error counts, as a rig's error does beside its sensor noise
WIDTHS = (4e-3, 4e-4)  # [rad], [m] finite steps, wide against the roughness of contact
EVERY = 3  # rows of a trial that are compared; neighbours say the same
ALIKE = 10  # of these rows count as one: what the world leaves stays the same for some 0.3 s
ITERATIONS = 4  # steps with slopes that each step corrects
SHARES = (1.0, 0.3)  # of a step that are tried
ENOUGH = 0.05  # share of the misfit that a further step must take off
MOVED = 1e-3  # [rad] a finger whose commands move less takes no part, so that nobody need know its offsets
FITTED, JUDGED = 3, 2  # trials of each kind that are fitted and judged by in a search


class Grasp:
    """Trial with an object, and its residual after its joint offsets and the object's place are fitted to a contact.

    Attributes:
        trial: what was measured.
        spread: standard deviations of the unknown joint offsets [rad] and of the object's displacement [m].
        free: which of these numbers are fitted: those of fingers that take part.
    """

    def __init__(self, replay: HandReplay, trial: Trial) -> None:
        """Simulate nothing yet."""
        assert trial.load is not None, "a trial with an object"
        self.trial, self._replay, self._load = trial, replay, trial.load
        joints = trial.position.shape[1]
        self.spread = np.r_[np.full(joints, OFFSET), np.full(3, PLACING)]
        self._width = np.r_[np.full(joints, WIDTHS[0]), np.full(3, WIDTHS[1])]
        busy = replay.finger_of[np.ptp(trial.command, axis=0) > MOVED]
        self.free = np.flatnonzero(np.r_[np.isin(replay.finger_of, busy), np.ones(3, dtype=bool)])
        released = round(trial.load.released / trial.step)
        self._grip = released if released >= EVERY else len(trial.time)
        self._slopes: Array | None = None
        self._known: dict[frozenset[tuple[str, str, float]], tuple[Array, Array]] = {}

    def fitted(self, contact: ContactModel) -> tuple[Array, Array]:
        """Return the offsets and displacement that fit a contact best, and their residual; simulate once per contact.

        Offsets [rad] and displacement [m] in the rig's frame, (joints + 3,), and measured minus simulated position (n,
        joints) [rad].
        """
        key = contact.without_neutral()
        if key not in self._known:
            unknown = self._fitted_grip(contact)
            position = self._simulate(contact, unknown, len(self.trial.time))
            self._known[key] = (unknown, np.asarray(self.trial.position - position))
        return self._known[key]

    def _fitted_grip(self, contact: ContactModel) -> Array:
        """Fit the grip from zero, on the time before the box has weight, when nothing can slip yet."""
        unknown = np.zeros(len(self.spread))
        target = self._target(contact, unknown)
        if self._slopes is None:
            self._slopes = self._gradients(contact, unknown, target)
        unknown, target = self._descended(contact, unknown, target, self._slopes)
        if target @ target > len(target):  # slopes of another contact led nowhere
            slopes = self._gradients(contact, unknown, target)
            unknown, target = self._descended(contact, unknown, target, slopes)
        return unknown

    def _gradients(self, contact: ContactModel, unknown: Array, target: Array) -> Array:
        steps = np.diag(self._width)[self.free]
        columns = [(self._target(contact, unknown + step) - target) / step.max() for step in steps]
        return np.stack(columns, axis=1)

    def _descended(self, contact: ContactModel, unknown: Array, target: Array, slopes: Array) -> tuple[Array, Array]:
        """Take Gauss-Newton steps; what each of them saw corrects the slopes.

        Source: C. G. Broyden, A class of methods for solving nonlinear simultaneous equations, 1965.
        """
        for _ in range(ITERATIONS):
            before = target @ target
            whole = np.zeros(len(unknown))
            whole[self.free] = -np.linalg.lstsq(slopes, target, rcond=None)[0]
            for share in SHARES:
                tried = unknown + share * whole
                tried[-3:] = np.clip(tried[-3:], -FARTHEST, FARTHEST)
                reached = self._target(contact, tried)
                step = (tried - unknown)[self.free]
                slopes = slopes + np.outer(reached - target - slopes @ step, step) / (float(step @ step) or 1.0)
                if reached @ reached < before:
                    unknown, target = tried, reached
                    break
            if target @ target > (1 - ENOUGH) * before:
                break
        return unknown, target

    def _target(self, contact: ContactModel, unknown: Array) -> Array:
        grip = self._simulate(contact, unknown, self._grip) - self.trial.position[: self._grip]
        return np.concatenate([grip[::EVERY].ravel() / LEFT, np.sqrt(ALIKE) * unknown / self.spread])

    def _simulate(self, contact: ContactModel, unknown: Array, rows: int) -> Array:
        moved = self._load.model_copy(update={"position": self._load.position + unknown[-3:]})
        trial = replace(self.trial, load=moved)
        return self._replay.simulate(trial, contact, unknown[:-3], rows * self.trial.step).position


class Grasps(Problem):
    """Problem of several grasps, one segment each: its residual, then the offsets and displacement that were fitted.

    Errors count beside `SCALE`. A segment's weight falls with its own error as in a likelihood of Student's form, so
    that a load which falls in one simulation alone does not decide.
    """

    finest = STEP  # initialisations differ by more in when something slips

    def __init__(self, grasps: Sequence[Grasp]) -> None:
        """Simulate nothing yet; other problems may have the same grasps."""
        self.grasps = list(grasps)
        self.joints = grasps[0].trial.position.shape[1]
        alike = Counter(one.trial.initialisation for one in grasps)
        rows = [
            np.r_[
                np.repeat(one.trial.valid[::EVERY] / (SCALE * np.sqrt(ALIKE)), self.joints),
                np.isin(np.arange(len(one.spread)), one.free) / one.spread / np.sqrt(alike[one.trial.initialisation]),
            ]
            for one in grasps
        ]
        self.weight = self._padded(rows)
        self.measured: Array = np.zeros_like(self.weight)
        self.run_away = np.full(self.weight.shape[1], RUN_AWAY)
        self._counts = self._sums((self.weight > 0.0).astype(float))
        self._counts[:, : self.joints] /= ALIKE
        numbers = [one.trial.initialisation for one in grasps]
        self._counts[:, self.joints :] /= np.array([[alike[one]] for one in numbers])
        self.alike = [numbers.index(one) for one in numbers]
        self._trust: Array = np.ones(len(grasps))

    def prediction(self, model: Model) -> Array:
        """Return the negative residual (G, R), in rad and m."""
        return self._padded([-np.r_[left[::EVERY].ravel(), unknown] for unknown, left in self._fitted(model)])

    def linearise_starts(self, model: Model) -> None:
        """Take each segment's weight from this model from now on."""
        squares = np.sum((self.prediction(model) * self.weight) ** 2, axis=1)
        self._trust = 1.0 / (1.0 + squares / self._counts.sum(axis=1))

    def free(self, x: Array) -> Array:
        """Return residuals or columns weighted by segment; what is unknown of a grasp is in the residual."""
        return np.asarray(x * self._trust.reshape(-1, *[1] * (x.ndim - 1)))

    def columns(self, model: Model, unknowns: Sequence[Unknown], step: float = STEP) -> tuple[Array, Array]:
        """Return the prediction (G, R), and wide secants (G, R, P), weighted, per unit of each unknown's scale.

        How far two slips are apart in time has a corner where they coincide: a secant over it leads to their mean.
        """
        found = []
        for unknown in unknowns:
            value, width = unknown.of(model), step * unknown.scale
            low, high = max(value - width, unknown.low), min(value + width, unknown.high)
            less, more = (self.prediction(unknown.put(model, one)) for one in (low, high))
            found.append(self.limited(more - less) * self.weight * unknown.scale / (high - low))
        base = self.prediction(model)
        return base, np.stack(found, axis=-1) if found else np.zeros((*base.shape, 0))

    def squares(self, model: Model) -> float:
        """Return the weighted squared error of a model."""
        return float(self.cost(self.residual(self.prediction(model))).sum())

    def judged(self, model: Model) -> Judgement:
        """Judge a model by its error per joint and trial, and by the offsets and displacement of each initialisation.

        A joint's cost includes the error that the world itself leaves. Offsets and displacements of the expected size
        have an error of one; their common error follows those of the joints as one more entry.
        """
        residual, joints = self.residual(self.prediction(model)), self.joints
        samples, squares = self._counts.copy(), self._sums(residual**2)
        for one in (samples, squares):
            needed = np.zeros_like(one[:, joints:])
            np.add.at(needed, self.alike, one[:, joints:])
            one[:, joints:] = needed
        costs = samples + squares
        costs[:, joints:] /= 2.0
        total, count = costs.sum(axis=0), samples.sum(axis=0)
        errors = np.sqrt(np.r_[total[:joints] / count[:joints], total[joints:].sum() / count[joints:].sum()])
        trial = np.repeat(np.arange(len(costs)), costs.shape[1])
        return Judgement(model, costs.ravel(), samples.ravel(), residual, errors, trial)

    def errors(self, model: Model, joints: Sequence[str]) -> ErrorSummary:
        """Return the RMS error [rad], offsets and the object's place fitted in each trial."""
        left = [
            np.where(one.trial.valid[:, None], residual, np.nan)
            for one, (_, residual) in zip(self.grasps, self._fitted(model), strict=True)
        ]
        return summarise_errors(left, tuple(joints))

    def _fitted(self, model: Model) -> list[tuple[Array, Array]]:
        contact = ContactModel({term.effect.name: term.values for term in model.terms})
        return [one.fitted(contact) for one in self.grasps]

    def _padded(self, rows: Sequence[Array]) -> Array:
        """Return rows of different length as one array; the offsets and displacement of a grasp come last."""
        last = self.joints + 3
        found = np.zeros((len(rows), max(map(len, rows))))
        for one, row in zip(found, rows, strict=True):
            one[: len(row) - last], one[-last:] = row[:-last], row[-last:]
        return found

    def _sums(self, numbers: Array) -> Array:
        """Return sums over the rows of each joint, then what belongs to offsets and place, (G, joints + joints + 3)."""
        last = self.joints + 3
        rows = numbers[:, :-last].reshape(len(numbers), -1, self.joints)
        return np.column_stack([rows.sum(axis=1), numbers[:, -last:]])


@dataclass(frozen=True)
class OpenGrasps:
    """Trials with an object of a recording, split, with the world that simulates them.

    Attributes:
        fitted: trials to fit.
        held_out: trials to judge by.
        start: the contact as the model has it, which a fit leaves alone.
        noise_floor: noise of the position sensors, and what a world with the true effects leaves [rad].
        finer: the same trials in a world of half the step.
    """

    fitted: Grasps
    held_out: Grasps
    start: Model
    noise_floor: float
    finer: Callable[[Grasps], Grasps]

    def without(self, effects: Sequence[type[ContactEffect]]) -> Model:
        """Return the contact of the start model without these effects."""
        return replace(self.start, terms=tuple(term for term in self.start.terms if term.effect not in effects))


@contextmanager
def open_grasps(recording: Recording, model: ModelFile | None, step: float, seed: int) -> Iterator[OpenGrasps]:
    """Open the world that training uses for the trials with an object, and close it afterwards.

    Args:
        recording: trials without an object are left aside.
        model: of the drivetrain, taken as known; None: as recording.yaml states it.
        step: longest physics step [s].
        seed: which trials are held out.
    """
    held = with_object(recording)
    fitted, held_out = held_out_split(held, seed=seed)
    drive, known = nominal_model(held, model), contact_of(model).values.items()
    floor = float(np.hypot(np.sqrt(np.mean(sensor_noise(held) ** 2)), LEFT))
    with ExitStack() as worlds:

        def problem(trials: Sequence[Trial], replay: HandReplay) -> Grasps:
            return Grasps([Grasp(replay, trial) for trial in trials])

        def finer(part: Grasps) -> Grasps:
            replay = worlds.enter_context(closing(HandReplay(held, drive, step / 2)))
            return problem([one.trial for one in part.grasps], replay)

        replay = worlds.enter_context(closing(HandReplay(held, drive, step)))
        start = Model({}, tuple(Term(contact_catalogue()[name], OBJECT, values) for name, values in known), {})
        yield OpenGrasps(problem(fitted.trials, replay), problem(held_out.trials, replay), start, floor, finer)


def some_of_each_kind(problem: Grasps, count: int) -> Grasps:
    """Return at most so many trials of each kind, from as many initialisations and with as many loads as possible."""
    kinds: dict[str, list[Grasp]] = {}
    for one in problem.grasps:
        kinds.setdefault(one.trial.kind, []).append(one)
    chosen = [np.linspace(0, len(same) - 1, min(count, len(same))).round().astype(int) for same in kinds.values()]
    return Grasps([same[k] for same, rows in zip(kinds.values(), chosen, strict=True) for k in rows])


def compare_contact(
    recording: Recording, model: ModelFile | None = None, step: float = 0.002, say: Callable[[str], None] = print
) -> Comparison:
    """Simulate every trial with an object in the world that training uses.

    Each trial has the joint offsets and the place of the object that suit it.

    Args:
        recording: trials without an object are left aside.
        model: of drivetrain, fingertips and object; None: as recording.yaml states them.
        step: longest physics step [s].
        say: takes progress lines.
    """
    held = with_object(recording)
    if model is not None:
        require_same_joints(held, model)
    simulated = []
    with closing(HandReplay(held, nominal_model(held, model), step)) as replay:
        for number, trial in enumerate(held.trials, start=1):
            position = trial.position - Grasp(replay, trial).fitted(contact_of(model))[1]
            simulated.append(Simulated(position, np.full_like(position, np.nan)))
            say(f"{trial.name} simulated, {number} of {len(held.trials)}")
    floor = NoiseFloor(LEFT, dict.fromkeys(held.joints, LEFT), "contact", 0, {})
    return describe_comparison(held, model, simulated, floor, None, step)
