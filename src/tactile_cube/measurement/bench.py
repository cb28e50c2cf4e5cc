"""Commands that excite a rig, and the bench tests of the paper as trials: what to command, and what touches show.

A known force on a static finger shows kp, clamped links under torque show the drive's stiffness, links moved until they
touch show the range of the joint offsets; free motion, for kd and friction, is every other trial.

Source: Sievers, Pitz, Bauml (ICRA 2022), section II-D.
"""

from collections.abc import Callable, Iterable

import numpy as np

from tactile_cube.drivetrain.model_file import Estimate, ModelFile
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.description import KnownForce, Touch, TrialEntry
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.rig import RigJoint
from tactile_cube.measurement.recordings.trial import Array, Trial

POLICY_PERIOD = 0.1  # [s]
POLICY_SMOOTHING = 0.15  # [s] the low-pass that a learning hand puts on its targets
UNBOUNDED = 1.0  # [rad] half range of a joint without limits


def safe_range(joint: RigJoint, share: float) -> tuple[float, float]:
    """Return the middle `share` of a joint's range [rad]."""
    lower, upper = (joint.lower, joint.upper) if np.isfinite(joint.upper - joint.lower) else (-UNBOUNDED, UNBOUNDED)
    centre, half = 0.5 * (lower + upper), 0.5 * share * (upper - lower)
    return centre - half, centre + half


def excitation(kind: str, low: Array, high: Array, duration: float, rate: float, rng: np.random.Generator) -> Array:
    """Return commands of one trial (duration * rate, joints) [rad], within `low` and `high` (joints,); see `KINDS`."""
    if kind not in KINDS:
        raise InputError(f"kinds: '{kind}' is no excitation; known: {list(KINDS)}")
    time = np.arange(round(duration * rate)) / rate
    columns = [KINDS[kind](time, rng) for _ in low]
    return low + (high - low) * np.stack(columns, axis=1)


def ramps(time: Array, rng: np.random.Generator) -> Array:
    """Return strokes at speeds spread over a decade, in 0..1: friction at many speeds, reversals of many sizes."""
    corners, values = [0.0], [float(rng.uniform())]
    while corners[-1] < time[-1]:
        goal = float(rng.uniform())
        speed = float(np.exp(rng.uniform(np.log(0.1), np.log(1.5))))
        corners.append(corners[-1] + max(0.1, abs(goal - values[-1]) / speed))
        values.append(goal)
    return np.asarray(np.interp(time, corners, values))


def holds(time: Array, rng: np.random.Generator) -> Array:
    """Return quick moves between configurations that are held for a second or so, in 0..1: gravity, sticking, creep."""
    return _held(time, (0.6, 1.4), 0.15, rng)


def steps(time: Array, rng: np.random.Generator) -> Array:
    """Return configurations commanded within 0.02 s and held, in 0..1: all the torque that a motor has."""
    return _held(time, (0.4, 0.8), 0.02, rng)


def _held(time: Array, rest: tuple[float, float], move: float, rng: np.random.Generator) -> Array:
    """Return random values that are each held for some `rest` [s] and reached within `move` [s]."""
    corners, values = [0.0], [float(rng.uniform())]
    while corners[-1] < time[-1]:
        end = corners[-1] + rng.uniform(*rest)
        corners += [end, end + move]
        values += [values[-1], float(rng.uniform())]
    return np.asarray(np.interp(time, corners, values))


def multisine(time: Array, rng: np.random.Generator) -> Array:
    """Return a sum of sines from 0.2 to 6 Hz with falling amplitude, in 0..1; it excites inertia, delay and lag."""
    frequencies = np.geomspace(0.2, 6.0, 8) * rng.uniform(0.9, 1.1, 8)
    waves = np.sin(2 * np.pi * np.outer(time, frequencies) + rng.uniform(0, 2 * np.pi, 8)) @ (1 / frequencies**0.7)
    return np.asarray(0.5 + 0.5 * waves / np.max(np.abs(waves)))


def policy(time: Array, rng: np.random.Generator) -> Array:
    """Return the new targets at 10 Hz behind a low-pass, in 0..1: what a learning policy does to the hand."""
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


FORCE = 2.0  # [N] the largest, on the last link
WEIGHTS = 4  # of which the first is none
SIDE = 0.1  # [rad] from either side of which a loaded configuration is approached, so that friction cancels
MOVE, HOLD = 0.5, 1.0  # [s] of each approach and of each hold
SWEEP, SWEEP_TIME = 0.2, 4.0  # [rad], [s] of the command about a clamped configuration
PRESS, APPROACH = 0.1, 2.0  # [rad] beyond the touch, [s] to get there; then HOLD
BEFORE_TOUCH = 0.2  # [rad] from the configuration to the obstacle
SETTLED = 0.5  # last share of a touch, at rest

BenchTrial = tuple[TrialEntry, Array]


def touch_offsets(recording: Recording, model: ModelFile) -> dict[str, Estimate]:
    """Return joint -> mean offset [rad] that its touches show, with the range that the initialisations span.

    The offset is measured less true angle, without the drive's deflection by the stiffness in `model` or as stated.
    """
    by_joint: dict[str, list[float]] = {}
    for trial in recording.trials:
        if trial.touch is not None:
            joint, index = trial.touch.joint, recording.joints.index(trial.touch.joint)
            stated, found = recording.stated("stiffness", joint), model.values.get("stiffness", {}).get(joint)
            stiffness = found.value if found is not None else np.inf if stated is None else stated
            rest = slice(round(SETTLED * len(trial.time)), None)
            deflection = _torque(trial)[rest, index].mean() / stiffness
            offset = float(trial.position[rest, index].mean() - deflection - trial.touch.angle)
            by_joint.setdefault(joint, []).append(offset)
    spans = {joint: {"low": min(offsets), "high": max(offsets)} for joint, offsets in by_joint.items()}
    return {joint: Estimate(value=float(np.mean(by_joint[joint])), **span, unit="rad") for joint, span in spans.items()}


def _torque(trial: Trial) -> Array:
    """Return the measured torque, or the one that the controller must have asked for, (n, joints) [N m]."""
    if trial.torque is not None:
        return trial.torque
    asked = trial.gains.kp * (trial.command - trial.position) - trial.gains.kd * trial.velocity()
    return np.clip(asked, -trial.gains.torque_limit, trial.gains.torque_limit)


def without_touches(recording: Recording) -> Recording:
    """Drop the trials with a touch or a held object, which no model of a free mechanism can follow.

    Raises:
        InputError: no trial is left.
    """
    if not has_free_motion(recording):
        raise InputError(
            f"{recording.folder}: in every trial something is touched or held, none shows the mechanism alone; name "
            "contact effects (python -m tactile_cube.identify effects=[lateral_friction]) or record free motion too"
        )
    return recording.with_trials([trial for trial in recording.trials if _is_free(trial)])


def has_free_motion(recording: Recording) -> bool:
    """Return whether some trial shows the mechanism alone, without a touched or held object."""
    return any(map(_is_free, recording.trials))


def _is_free(trial: Trial) -> bool:
    return trial.touch is None and trial.load is None


def with_object(recording: Recording) -> Recording:
    """Return the recording with only the trials in which the hand holds an object."""
    return recording.with_trials([trial for trial in recording.trials if trial.load is not None])


def bench_trials(
    rig: Recording, kinds: Iterable[str], initialisations: int, rng: np.random.Generator
) -> list[BenchTrial]:
    """Return the entries and commands (n, joints) [rad] of the bench tests among `kinds`, for every initialisation."""
    chosen = [BENCH_KINDS[kind] for kind in kinds if kind in BENCH_KINDS]
    return [trial for number in range(initialisations) for test in chosen for trial in test(rig, number, rng)]


def _configuration(rig: Recording, rng: np.random.Generator) -> Array:
    """Return the angles (joints,) [rad] in the middle half of every joint's range."""
    low, high = np.array([safe_range(rig.rig.joints[joint], 0.5) for joint in rig.joints]).T
    return np.asarray(rng.uniform(low, high))


def _time(rig: Recording, duration: float) -> Array:
    return np.arange(round(duration * rig.rate)) / rig.rate


def _known_force(rig: Recording, number: int, rng: np.random.Generator) -> list[BenchTrial]:
    """Build the trials of one configuration, approached from both sides, each with another weight in one direction."""
    configuration, direction = _configuration(rig, rng), rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    tree = rig.rigid_body()  # the force acts as far beyond the last link's centre of mass as the joint is before it
    last, point = tree.dof_names[-1], (2 * tree.com[-1]).tolist()
    corners = np.cumsum([0.0, MOVE, MOVE, HOLD, MOVE, MOVE, HOLD])
    sides = np.interp(_time(rig, corners[-1]), corners, SIDE * np.array([0, 1, 0, 0, -1, 0, 0]))
    trials = []
    for weight in range(WEIGHTS):
        vector = (FORCE * weight / (WEIGHTS - 1) * direction).tolist()
        file = f"trials/known_force_{number}_{weight}.parquet"
        force = KnownForce(joint=last, point=point, vector=vector)
        entry = TrialEntry(file=file, initialisation=number, kind="known_force", force=force)
        trials.append((entry, configuration + sides[:, None]))
    return trials


def _clamped(rig: Recording, number: int, rng: np.random.Generator) -> list[BenchTrial]:
    """Return a trial with links held still, every command sweeping about a configuration: the drive alone yields."""
    sweep = SWEEP * np.sin(2 * np.pi * _time(rig, SWEEP_TIME) / SWEEP_TIME)
    file = f"trials/clamped_{number}.parquet"
    entry = TrialEntry(file=file, initialisation=number, kind="clamped", clamped=True)
    return [(entry, _configuration(rig, rng) + sweep[:, None])]


def _touch(rig: Recording, number: int, rng: np.random.Generator) -> list[BenchTrial]:
    trials = []
    for index, joint in enumerate(rig.joints):
        configuration = _configuration(rig, rng)
        angle = float(configuration[index] + BEFORE_TOUCH)
        way = np.clip(_time(rig, APPROACH + HOLD) / APPROACH, 0.0, 1.0)
        command = np.tile(configuration, (len(way), 1))
        command[:, index] += (BEFORE_TOUCH + PRESS) * way
        file, touch = f"trials/touch_{number}_{joint}.parquet", Touch(joint=joint, angle=angle)
        entry = TrialEntry(file=file, initialisation=number, kind="touch", touch=touch)
        trials.append((entry, command))
    return trials


BENCH_KINDS: dict[str, Callable[[Recording, int, np.random.Generator], list[BenchTrial]]] = {
    "known_force": _known_force,
    "clamped": _clamped,
    "touch": _touch,
}
