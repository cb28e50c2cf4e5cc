"""Desired angles from a table in place of a policy: to excite the drives of a hand through the same loop."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_cube.deployment.controller import POLICY_RATE
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.measurement.excitation import excitation

Array = NDArray[np.float64]


class PlayedTargets:
    """Gives one row after the other at 10 Hz, and the last one for good.

    Args:
        targets: q_n `(steps, 12)` [rad].
    """

    def __init__(self, targets: Array) -> None:
        self._targets, self._row = targets, 0

    def reset(self) -> None:
        """Begin with the first row."""
        self._row = 0

    def step(self, q_m: Array, q_f: Array) -> Array:
        """Return the next row `(12,)` [rad], whatever the fingers do."""
        row = self._targets[min(self._row, len(self._targets) - 1)]
        self._row += 1
        return np.asarray(row)


def excited_targets(kind: str, reach: float, seconds: float, seed: int, hand: Hand = DLR_HAND2) -> PlayedTargets:
    """Return an excitation about the start angles, within the action range.

    Args:
        kind: `ramps`, `holds`, `multisine` or another kind of excitation.
        reach: half width [rad].
        seconds: length [s].
        seed: of its corners and phases.
        hand: that moves.

    Raises:
        InputError: an unknown kind.
    """
    home = np.asarray(hand.start_angles)
    low, high = np.maximum(home - reach, hand.action_lower), np.minimum(home + reach, hand.action_upper)
    return PlayedTargets(excitation(kind, low, high, seconds, POLICY_RATE, np.random.default_rng(seed)))
