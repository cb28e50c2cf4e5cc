"""Where the links are when a trial begins within a gap of the transmission, where the sensors do not show them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.fitting.shooting import Shooting
from tactile_cube.measurement.replay.model import Model
from tactile_cube.measurement.replay.windows import Windows

Array = NDArray[np.float64]
PLACES = 17  # within the gap: the time of landing depends on them


def with_initial_states(shooting: Shooting, model: Model, windows: Windows) -> Windows:
    """The windows with the initial state of each trial that follows its first segment best, one joint after the other.

    A link may stand anywhere within the gap, at rest or as fast as the motor. Without a gap it stands where its motor
    says, whatever another model found.
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
    """The initial states (S, 2 n) with that of one joint chosen from all places in its gap."""
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
