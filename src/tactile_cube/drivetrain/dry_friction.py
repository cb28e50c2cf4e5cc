"""Dry friction in joint space: joints that stick stand still exactly, and nothing creeps unless it is told to.

The speeds after a step minimise v' M v / 2 - b' v + sum_j limit_j |v_j|: where |v_j| > 0 friction opposes the motion
with its full size, where v_j = 0 it takes any value up to it. This is implicit Coulomb friction (Moreau; Stewart and
Trinkle, 1996) without a regularised sign function. A joint with a grip g > 0 creeps instead of standing still: friction
resists with g v until that reaches its full size.
"""

import numpy as np
import numpy.typing as npt

from tactile_cube.compiled import compiled

Array = npt.NDArray[np.float64]
GUESSES = 10
SWEEPS = 4
SMALLEST_PIVOT = 1e-14


@compiled
def solve_speeds(
    M: Array, b: Array, limit: Array, grip: Array, v: Array, side: Array, factor: Array, trial: Array
) -> None:
    """Speeds after a step under dry friction.

    Guesses which joints move and to which side, solves for their speeds, and accepts if the guess agrees with the
    result; otherwise soft-thresholded coordinate descent (which converges from anywhere), run twice as long each time,
    makes the next guess.

    Args:
        M: (n, n) joint-space inertia, reflected inertia included [kg m^2].
        b: (n,) momentum that the joints would have without friction [N m s].
        limit: (n,) friction impulse of the step, zero or more [N m s].
        grip: (n,) friction impulse per speed of a joint that sticks [kg m^2]; 0: it stands still.
        v: (n,) speeds before the step; overwritten with those after it [rad/s].
        side: (n,) scratch.
        factor: (n, n) scratch.
        trial: (n,) scratch.
    """
    sweeps = SWEEPS
    for _ in range(GUESSES):
        for j in range(len(v)):
            side[j] = _side(v[j], limit[j], grip[j])
        _solve_moving(M, b, limit, grip, side, factor, trial)
        if _agrees(M, b, limit, grip, side, trial):
            for j in range(len(v)):
                v[j] = trial[j]
            return
        for _ in range(sweeps):
            _descend(M, b, limit, grip, v)
        if not np.isfinite(v[0]):
            return
        sweeps *= 2


@compiled
def _side(v: float, limit: float, grip: float) -> float:
    """The side to which a joint moves, 0 if it sticks."""
    return 0.0 if abs(v) * grip < limit and (grip > 0.0 or v == 0.0) else np.sign(v)


@compiled
def _stands(limit: float, grip: float, side: float) -> bool:
    return limit > 0.0 and side == 0.0 and grip <= 0.0


@compiled
def _solve_moving(M: Array, b: Array, limit: Array, grip: Array, side: Array, factor: Array, v: Array) -> None:
    """Speeds of the joints that move, under full friction against `side`; the others stand (L D L^T).

    A standing joint's row and column are those of the identity, its right side zero.
    """
    n = len(v)
    for i in range(n):
        stands = _stands(limit[i], grip[i], side[i])
        sticks = limit[i] > 0.0 and side[i] == 0.0
        v[i] = 0.0 if stands else b[i] - limit[i] * side[i]
        pivot = 1.0 if stands else M[i, i] + (grip[i] if sticks else 0.0)
        for j in range(i):
            entry = 0.0 if stands or _stands(limit[j], grip[j], side[j]) else M[i, j]
            for k in range(j):
                entry -= factor[i, k] * factor[j, k] * factor[k, k]
            factor[i, j] = entry / factor[j, j]
            pivot -= factor[i, j] * entry
            v[i] -= factor[i, j] * v[j]
        factor[i, i] = max(pivot, SMALLEST_PIVOT)
    for i in range(n - 1, -1, -1):
        v[i] /= factor[i, i]
        for j in range(i + 1, n):
            v[i] -= factor[j, i] * v[j]


@compiled
def _agrees(M: Array, b: Array, limit: Array, grip: Array, side: Array, v: Array) -> bool:
    """Whether moving joints move to their side and sticking ones are held within their friction."""
    for i in range(len(v)):
        if limit[i] <= 0.0:
            continue
        if side[i] != 0.0:
            if not (v[i] * side[i] > 0.0 and abs(v[i]) * grip[i] >= limit[i] * (grip[i] > 0.0)):
                return False
        elif grip[i] > 0.0:
            if not abs(v[i]) * grip[i] <= limit[i]:
                return False
        else:
            push = b[i]
            for j in range(len(v)):
                push -= M[i, j] * v[j]
            if not abs(push) <= limit[i]:
                return False
    return True


@compiled
def _descend(M: Array, b: Array, limit: Array, grip: Array, v: Array) -> None:
    """One sweep of coordinate descent: each joint in turn takes its best speed, the others held."""
    for i in range(len(v)):
        push = b[i]
        for j in range(len(v)):
            if j != i:
                push -= M[i, j] * v[j]
        inertia = max(M[i, i], SMALLEST_PIVOT)
        v[i] = np.sign(push) * max(abs(push) - limit[i], 0.0) / inertia
        if grip[i] > 0.0 and abs(push) * grip[i] <= limit[i] * (inertia + grip[i]):
            v[i] = push / (inertia + grip[i])
