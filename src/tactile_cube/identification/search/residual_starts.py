"""Candidates whose starts are read from what a fit leaves: harmonics, profiles over the position."""

from collections.abc import Mapping, Sequence

import numpy as np

from tactile_cube.drivetrain.effects.effect import FINGER, Array, Effect, Scales, Stage
from tactile_cube.drivetrain.signals import ANGLE, JOINT_TORQUE, ROWS
from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.search.candidates import Candidate, Sizes
from tactile_cube.identification.search.residual_shape import Missing, missing_torques
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model

HARMONIC = "harmonic"  # parameter [1/rad] by which an effect says that it repeats with the position
LOWEST, HIGHEST = 1.25, 160.0  # [1/rad] of a finger: waves of 5 rad to 39 mrad
RESOLUTION = 0.8  # grid step times the range of motion: finer than half a peak
NARROWEST = 0.05  # [rad] range that is told apart by harmonics at all
PEAKS = 2
MOST_SAMPLES = 8000


def periodic_candidates(
    missing_torques: Sequence[Missing],
    recording: Recording,
    model: Model,
    effects: Sequence[type[Effect]],
    sizes: Sizes,
) -> list[Candidate]:
    """Return the candidates at the strongest harmonics of what is missing, for every effect that has one."""
    periodic = [effect for effect in effects if any(HARMONIC in form for form in effect.forms_at(FINGER))]
    found = []
    for missing in missing_torques:
        damping = float(model.constants["kd"][recording.joints.index(missing.joint)])
        scales = sizes[missing.joint]
        for effect in periodic:
            if (moving := effect.stage is Stage.POSITION_SENSOR) and damping == 0.0:
                continue  # commanded torques: no controller takes the sensor's error for motion
            response = (damping, scales.inertia) if moving else None
            found += [
                Candidate(effect, (missing.joint,), start, sizes)
                for form in effect.forms_at(scales)
                if HARMONIC in form
                for start in _starts(missing, form, response, scales.of("1/rad"))
            ]
    return found


def _starts(
    missing: Missing, form: Mapping[str, float], response: tuple[float, float] | None, size: float
) -> list[Mapping[str, float]]:
    """Return the form at each strong harmonic, with the phase of the missing torque there, see `peaks`."""
    starts: list[Mapping[str, float]] = []
    first, second = [name for name in form if name != HARMONIC][:2]
    for harmonic, sine, cosine in peaks(missing, response, size):
        known = max(np.hypot(sine, cosine), 0.1 * abs(form[first]))
        angle = np.arctan2(cosine, sine)
        starts.append({**form, first: known * np.cos(angle), second: known * np.sin(angle), HARMONIC: harmonic})
    return starts


def peaks(
    missing: Missing, response: tuple[float, float] | None = None, size: float = 1.0
) -> list[tuple[float, float, float]]:
    """Return harmonics of a wave over the position, (harmonic, sine part, cosine part): peaks, then long waves.

    The wave is a torque, or with a `response` (damping [N m s/rad], inertia [kg m^2]) an error e of the position
    sensor, which misses damping * e' + inertia * e''. Each robot initialisation brings joint offsets that are not known
    well, so phases are compared within one only (Lomb-Scargle). Harmonics go up to `size` times a finger's. A wave of
    which the range of motion holds no more than one is no peak: half a wave and a whole one are always returned.
    """
    every = max(1, len(missing.torque) // MOST_SAMPLES)
    q, v, a = (
        missing.signals[f"{name} of {missing.joint} [{unit}]"][::every]
        for name, unit in (("position", "rad"), ("velocity", "rad/s"), ("acceleration", "rad/s^2"))
    )
    t, group = missing.torque[::every], missing.initialisation[::every]
    slow = np.vander((q - q.mean()) / max(np.ptp(q), 1e-9 / size), 4)
    t = t - slow @ np.linalg.lstsq(slow, t, rcond=None)[0]
    moved = max(float(np.ptp(q)), NARROWEST / size)
    grid = np.arange(LOWEST * size, HIGHEST * size, RESOLUTION / moved)
    parts = [group == k for k in np.unique(group)]

    def waves(n: float) -> Array:
        """Return what a sine and a cosine of the position, of size 1, add to the torque (samples, 2)."""
        wave = np.exp(1j * n * q)
        if response is not None:
            damping, inertia = response
            wave *= damping * 1j * n * v + inertia * (1j * n * a - n**2 * v**2)
        return np.stack([wave.imag, wave.real], axis=1)

    power = np.zeros(len(grid))
    for k, n in enumerate(grid):
        columns = waves(float(n))
        for part in parts:
            own = columns[part]
            pull = own.T @ t[part]
            power[k] += pull @ np.linalg.lstsq(own.T @ own, pull, rcond=None)[0]
    inner = np.flatnonzero((power[1:-1] >= power[:-2]) & (power[1:-1] >= power[2:])) + 1
    strongest = inner[np.argsort(-power[inner])][:PEAKS]
    found = []
    for harmonic in (*map(float, grid[strongest]), np.pi / moved, 2.0 * np.pi / moved):
        columns = np.column_stack([waves(harmonic), slow])
        sine, cosine = np.linalg.lstsq(columns, t, rcond=None)[0][:2]
        found.append((harmonic, float(sine), float(cosine)))
    return found


PROFILE = "torque_0"  # first of the control torques by which an effect says that it is a profile over the position
BINS = 120
SMOOTH = 1e-3  # weight of the squared third differences of the control torques, which bins without samples need


def profile_candidates(
    missing_torques: Sequence[Missing], sizes: Sizes, effects: Sequence[type[Effect]]
) -> list[Candidate]:
    """Return a candidate at every joint for every effect with a profile, started at the mean missing torque there."""
    return [
        Candidate(effect, (missing.joint,), start_of(effect, form, missing, sizes[missing.joint]), sizes)
        for effect in effects
        for missing in missing_torques
        for form in effect.forms_at(sizes[missing.joint])
        if PROFILE in form
    ]


def start_of(effect: type[Effect], form: Mapping[str, float], missing: Missing, scales: Scales) -> Mapping[str, float]:
    """Return the control torques [N m] whose profile is nearest to the missing torque's mean over the position."""
    low, high = scales.low, scales.high
    position = missing.signals[f"position of {missing.joint} [rad]"]
    edges = np.linspace(low, high, BINS + 1)
    place = np.clip(np.searchsorted(edges, position) - 1, 0, BINS - 1)
    count = np.bincount(place, minlength=BINS)
    mean = np.bincount(place, missing.torque, minlength=BINS) / np.maximum(count, 1)
    middles = 0.5 * (edges[1:] + edges[:-1])
    basis = np.array([profile_of(effect, effect.placed_at(scales) | {name: 1.0}, middles) for name in form]).T
    weight = count / max(count.sum(), 1)
    bend = np.diff(np.eye(len(form)), n=3, axis=0)
    normal = basis.T @ (weight[:, None] * basis) + SMOOTH / len(form) * bend.T @ bend
    found = np.linalg.lstsq(normal, basis.T @ (weight * mean), rcond=None)[0]
    return {name: float(value) for name, value in zip(form, found, strict=True)}


def profile_of(effect: type[Effect], values: Mapping[str, float], angles: Array) -> Array:
    """Return the torque (N,) of an effect with these values, all others neutral, at each angle [N m]."""
    known = np.array([values.get(p.name, p.neutral) for p in effect.parameters])
    x = np.zeros((ROWS, 1))
    torques = []
    for angle in angles:
        x[ANGLE, 0], x[JOINT_TORQUE, 0] = angle, 0.0
        torques.append(effect.law(x, 0, known, np.zeros(0), 1.0))
    return np.array(torques)


def residual_candidates(
    problem: Problem, recording: Recording, fitted: Fit, effects: Sequence[type[Effect]]
) -> list[Candidate]:
    """Return the candidates among `effects` for what a fit leaves unexplained on the windows that were fitted."""
    missing = missing_torques(problem, recording, fitted.model, fitted.residual)
    sizes = problem.shooting.sizes
    periodic = periodic_candidates(missing, recording, fitted.model, effects, sizes)
    return [*periodic, *profile_candidates(missing, sizes, effects)]
