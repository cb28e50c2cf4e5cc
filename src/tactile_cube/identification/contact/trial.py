"""One trial with an object beside its simulation, with what nobody knows of it fitted: offsets and the box's place.

Where a fingertip first touches decides how hard it presses later, and joint offsets of a degree move it by millimetres.
So every value of a contact effect is judged with the offsets and the place that suit it best, found anew from zero:
what suits another value would pull the answer to where the search began.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.measurement.bench import with_object
from tactile_cube.measurement.comparing.comparison import Comparison, describe_comparison
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor, sensor_noise
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.replay.hand_replay import ContactModel, HandReplay, contact_of
from tactile_cube.measurement.replay.nominal import nominal_model, require_same_joints
from tactile_cube.measurement.replay.simulator import Simulated
from tactile_cube.measurement.split import held_out_split

Array = NDArray[np.float64]
OFFSET = 0.02  # [rad] standard deviation of a joint offset; the paper's initialisations differ by degrees
PLACING = 1e-3  # [m] with which somebody puts the box in its place
FARTHEST = 3e-3  # [m] it is never farther from there
SIGMA = 1e-3  # [rad] error that the world leaves in contact: drives known to 10 %, a solver that stops early
WIDTHS = (4e-3, 4e-4)  # [rad], [m] finite steps, wide against the roughness of contact
EVERY = 3  # rows of a trial that are compared; neighbours say the same
ALIKE = 10  # of these rows count as one: what the world leaves stays the same for some 0.3 s
ITERATIONS = 4  # steps with slopes that each step corrects
SHARES = (1.0, 0.3)  # of a step that are tried
ENOUGH = 0.05  # share of the misfit that a further step must take off
MOVED = 1e-3  # [rad] a finger whose commands move less takes no part, so that nobody need know its offsets


class ContactTrial:
    """A trial, and its misfit as a function of the contact alone.

    Attributes:
        trial: what was measured.
    """

    def __init__(self, replay: HandReplay, trial: Trial) -> None:
        """Simulates nothing yet."""
        assert trial.load is not None, "a trial with an object"
        self.trial, self._replay, self._load = trial, replay, trial.load
        joints = trial.position.shape[1]
        self._spread = np.r_[np.full(joints, OFFSET), np.full(3, PLACING)]
        self._width = np.r_[np.full(joints, WIDTHS[0]), np.full(3, WIDTHS[1])]
        busy = replay.finger_of[np.ptp(trial.command, axis=0) > MOVED]
        self._free = np.flatnonzero(np.r_[np.isin(replay.finger_of, busy), np.ones(3, dtype=bool)])
        released = round(trial.load.released / trial.step)
        self._grip = released if released >= EVERY else len(trial.time)
        self._slopes: Array | None = None
        self._known: dict[frozenset[tuple[str, str, float]], tuple[Array, Array]] = {}

    def cost(self, contact: ContactModel) -> float:
        """Mean square of the residual over SIGMA^2, plus what improbable offsets cost, the nuisance fitted."""
        nuisance, residual = self._fitted(contact)
        seen = residual[self.trial.valid][::EVERY] / SIGMA
        return float((np.sum(seen**2) + ALIKE * np.sum((nuisance / self._spread) ** 2)) / seen.size)

    def residual(self, contact: ContactModel) -> Array:
        """Measured minus simulated position (n, joints) [rad], the nuisance fitted."""
        return self._fitted(contact)[1]

    def prior_penalty(self, contact: ContactModel) -> float:
        """Squared distance of joint offsets and the box's place from what is expected, in standard deviations."""
        return float(np.sum((self._fitted(contact)[0] / self._spread) ** 2))

    @property
    def freedom(self) -> int:
        """Numbers that nobody knows of it."""
        return len(self._free)

    def nuisance(self, contact: ContactModel) -> Array:
        """Joint offsets (joints,) [rad] and displacement of the box in the rig's frame (3,) [m] that suit a contact."""
        return self._fitted(contact)[0]

    def _fitted(self, contact: ContactModel) -> tuple[Array, Array]:
        """Nuisance and residual, simulated once for each contact."""
        key = contact.without_neutral()
        if key not in self._known:
            nuisance = self._fitted_nuisance(contact)
            position = self._simulate(contact, nuisance, len(self.trial.time))
            self._known[key] = (nuisance, np.asarray(self.trial.position - position))
        return self._known[key]

    def _fitted_nuisance(self, contact: ContactModel) -> Array:
        """From zero, on the time before the box has weight, when nothing can slip yet."""
        nuisance = np.zeros(len(self._spread))
        target = self._target(contact, nuisance)
        if self._slopes is None:
            self._slopes = self._gradients(contact, nuisance, target)
        nuisance, target = self._descended(contact, nuisance, target, self._slopes)
        if target @ target > len(target):  # slopes of another contact led nowhere
            slopes = self._gradients(contact, nuisance, target)
            nuisance, target = self._descended(contact, nuisance, target, slopes)
        return nuisance

    def _descended(self, contact: ContactModel, nuisance: Array, target: Array, slopes: Array) -> tuple[Array, Array]:
        """Gauss-Newton steps; what each of them saw corrects the slopes.

        Source: C. G. Broyden, A class of methods for solving nonlinear simultaneous equations, 1965.
        """
        for _ in range(ITERATIONS):
            before = target @ target
            for tried in self._tries(nuisance, target, slopes):
                reached = self._target(contact, tried)
                step = (tried - nuisance)[self._free]
                slopes = slopes + np.outer(reached - target - slopes @ step, step) / (float(step @ step) or 1.0)
                if reached @ reached < before:
                    nuisance, target = tried, reached
                    break
            if target @ target > (1 - ENOUGH) * before:
                break
        return nuisance, target

    def _tries(self, nuisance: Array, target: Array, slopes: Array) -> Iterator[Array]:
        """The whole of a step and parts of it, the box within reach."""
        step = np.zeros(len(nuisance))
        step[self._free] = -np.linalg.lstsq(slopes, target, rcond=None)[0]
        for share in SHARES:
            tried = nuisance + share * step
            tried[-3:] = np.clip(tried[-3:], -FARTHEST, FARTHEST)
            yield tried

    def _target(self, contact: ContactModel, nuisance: Array) -> Array:
        grip = self._simulate(contact, nuisance, self._grip) - self.trial.position[: self._grip]
        return np.concatenate([grip[::EVERY].ravel() / SIGMA, np.sqrt(ALIKE) * nuisance / self._spread])

    def _gradients(self, contact: ContactModel, nuisance: Array, target: Array) -> Array:
        steps = np.diag(self._width)[self._free]
        columns = [(self._target(contact, nuisance + step) - target) / step.max() for step in steps]
        return np.stack(columns, axis=1)

    def _simulate(self, contact: ContactModel, nuisance: Array, rows: int) -> Array:
        moved = replace(self._load, position=self._load.position + nuisance[-3:])
        trial = replace(self.trial, load=moved)
        return self._replay.simulate(trial, contact, nuisance[:-3], rows * self.trial.step).position


@dataclass(frozen=True)
class GraspTrials:
    """What a contact is fitted to and judged by.

    Attributes:
        joints: of the rig.
        fitted: trials that are fitted.
        held_out: trials that judge.
        start: the contact as the model has it.
        noise_floor: noise of the position sensors, and what a world with the true effects leaves [rad].
    """

    joints: tuple[str, ...]
    fitted: list[ContactTrial]
    held_out: list[ContactTrial]
    start: ContactModel
    noise_floor: float


@contextmanager
def open_grasps(recording: Recording, model: ModelFile | None, step: float, seed: int) -> Iterator[GraspTrials]:
    """Open the world that training uses for the trials with an object, and close it afterwards.

    Args:
        recording: trials without an object are left aside.
        model: of the drivetrain, taken as known; None: as recording.yaml states it.
        step: longest physics step [s].
        seed: which trials are held out.
    """
    held = with_object(recording)
    fitted, held_out = held_out_split(held, seed=seed)
    replay = HandReplay(held, nominal_model(held, model), step)
    try:
        yield GraspTrials(
            joints=tuple(held.joints),
            fitted=[ContactTrial(replay, trial) for trial in fitted.trials],
            held_out=[ContactTrial(replay, trial) for trial in held_out.trials],
            start=contact_of(model),
            noise_floor=float(np.hypot(np.sqrt(np.mean(sensor_noise(held) ** 2)), SIGMA)),
        )
    finally:
        replay.close()


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
    replay, contact = HandReplay(held, nominal_model(held, model), step), contact_of(model)
    simulated = []
    try:
        for number, trial in enumerate(held.trials, start=1):
            position = trial.position - ContactTrial(replay, trial).residual(contact)
            simulated.append(Simulated(position, np.full_like(position, np.nan)))
            say(f"{trial.name} simulated, {number} of {len(held.trials)}")
    finally:
        replay.close()
    floor = NoiseFloor(SIGMA, dict.fromkeys(held.joints, SIGMA), "contact", 0, {})
    return describe_comparison(held, model, simulated, floor, None, step)
