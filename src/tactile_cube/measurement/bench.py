"""The bench tests of the paper as trials: a known force on a static finger (K_P), clamped links under torque (K_e).

Source: Sievers, Pitz, Bauml (ICRA 2022), section II-D.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.description import Description, KnownForce, TrialEntry
from tactile_cube.measurement.excitation import safe_range
from tactile_cube.measurement.rig import Rig

Array = NDArray[np.float64]
BENCH_KINDS = ("known_force", "clamped")
FORCE = 2.0  # [N] on the last link
FORCES = 4  # weights, the first of them none
HOLD = 2.0  # [s] with each weight
SWEEP = 0.2  # [rad] of the command about the clamped posture
SWEEP_TIME = 4.0  # [s]


def bench_trials(
    rig: Rig, description: Description, kinds: Iterable[str], initialisations: int, rng: np.random.Generator
) -> list[tuple[TrialEntry, Array]]:
    """Entries and commands (n, joints) [rad] of the bench tests among `kinds`, for every initialisation."""
    makers = {"known_force": _known_force, "clamped": _clamped}
    chosen = [kind for kind in kinds if kind in makers]
    return [
        trial
        for number in range(initialisations)
        for kind in chosen
        for trial in makers[kind](rig, description, number, rng)
    ]


def _known_force(
    rig: Rig, description: Description, number: int, rng: np.random.Generator
) -> list[tuple[TrialEntry, Array]]:
    """One posture, held under several weights; each weight is a trial of its own."""
    low, high = np.array([safe_range(rig.joints[joint], 0.5) for joint in description.joints]).T
    posture = rng.uniform(low, high)
    samples = round(HOLD * description.rate_hz)
    last = (list(description.joints) + list(description.coupled))[-1]
    trials = []
    for step in range(FORCES):
        direction = rng.normal(size=3)
        vector = (FORCE * step / (FORCES - 1) * direction / np.linalg.norm(direction)).tolist()
        force = KnownForce(joint=last, point=[0.0, 0.0, 0.0], vector=vector)
        file = f"trials/known_force_{number}_{step}.parquet"
        entry = TrialEntry(file=file, initialisation=number, kind="known_force", force=force)
        trials.append((entry, np.tile(posture, (samples, 1))))
    return trials


def _clamped(
    rig: Rig, description: Description, number: int, rng: np.random.Generator
) -> list[tuple[TrialEntry, Array]]:
    """Links held still while every command sweeps about the posture: the drive alone gives way."""
    low, high = np.array([safe_range(rig.joints[joint], 0.5) for joint in description.joints]).T
    posture = rng.uniform(low, high)
    time = np.arange(round(SWEEP_TIME * description.rate_hz)) / description.rate_hz
    sweep = SWEEP * np.sin(2 * np.pi * time / SWEEP_TIME)
    file = f"trials/clamped_{number}.parquet"
    entry = TrialEntry(file=file, initialisation=number, kind="clamped", clamped=True)
    return [(entry, posture + sweep[:, None])]
