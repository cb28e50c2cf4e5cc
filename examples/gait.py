"""Which gait does a policy turn the cube by? When each finger lets go, counted in quarter turns of the cube.

    python -m tactile_cube.evaluate policy=default protocol=paper hydra.run.dir=outputs/gait
    python examples/gait.py outputs/gait/episode*.npz

A cube looks the same after a quarter turn, so a regular gait lifts each finger once in it, always at the same angle.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FINGERS = ("ring", "middle", "fore", "thumb")
FIRST = 5.0
"""Seconds that are left out: the cube is met in a grasp that is not the gait's own."""


@dataclass(frozen=True)
class Finger:
    """What one finger does.

    Attributes:
        lifts: per quarter turn.
        in_the_air: part of the time.
        angle: of the cube within its quarter turn at which the finger lets go, mean [deg].
        regularity: length of the mean of these angles as unit vectors: 1 if always at the same one, 0 if at any.
    """

    lifts: float
    in_the_air: float
    angle: float
    regularity: float


def touching(episode: dict[str, NDArray[np.float64]]) -> NDArray[np.bool_]:
    """Whether each finger, by tip or other link, touches the cube after each policy step, (steps + 1, fingers)."""
    touches = np.zeros((len(episode["theta"]), len(FINGERS)), dtype=bool)
    touches[episode["contacts.step"].astype(int), episode["contacts.finger"].astype(int)] = True
    return touches


def gait(episode: dict[str, NDArray[np.float64]]) -> list[Finger]:
    """Every finger's part of the gait, from an episode's arrays."""
    from_here = episode["time"] >= FIRST
    touches, turned = touching(episode)[from_here], np.abs(episode["theta"][from_here])
    quarters = abs(turned[-1] - turned[0]) / (np.pi / 2)
    found = []
    for touch in touches.T:
        lets_go = np.flatnonzero(touch[:-1] & ~touch[1:])
        mean = np.exp(4j * turned[lets_go]).mean() if lets_go.size else 0.0
        angle = np.degrees(np.angle(mean) / 4 % (np.pi / 2))
        found.append(Finger(lets_go.size / quarters, float(1.0 - touch.mean()), float(angle), float(abs(mean))))
    return found


def main() -> None:
    """One table for each file that is named."""
    for path in map(Path, sys.argv[1:]):
        with np.load(path, allow_pickle=False) as data:
            episode = {name: data[name] for name in ("time", "theta", "contacts.step", "contacts.finger")}
        counts = touching(episode)[episode["time"] >= FIRST].sum(axis=1)
        shares = ", ".join(f"{k} fingers {100 * np.mean(counts == k):.0f} %" for k in (4, 3, 2, 1, 0))
        print(f"{path}: {np.abs(episode['theta'][-1]):.1f} rad; on the cube: {shares}")
        for name, one in zip(FINGERS, gait(episode), strict=True):
            print(
                f"  {name:7} lifts {one.lifts:.2f} times a quarter turn, at {one.angle:.0f} deg of it "
                f"(regularity {one.regularity:.2f}); {100 * one.in_the_air:.0f} % of the time in the air"
            )


if __name__ == "__main__":
    main()
