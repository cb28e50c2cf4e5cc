"""True dry friction in joint space: joints that stick stand still exactly, and nothing creeps.

The speeds after a step minimise v' M v / 2 - b' v + sum_j limit_j |v_j|: where |v_j| > 0 friction opposes the motion
with its full size, where v_j = 0 it takes any value up to it. This is implicit Coulomb friction (Moreau; Stewart and
Trinkle, 1996) without a regularised sign function.
"""

import numpy as np
import numpy.typing as npt

from tactile_cube.compiled import compiled

Array = npt.NDArray[np.float64]
GUESSES = 12
SWEEPS = 4
SMALLEST_PIVOT = 1e-14


@compiled
def solve_speeds(M: Array, b: Array, limit: Array, v: Array, side: Array, factor: Array, trial: Array) -> None:
    """Speeds after a step under dry friction.

    Guesses which joints move and to which side, solves for their speeds, and accepts if the guess agrees with the
    result; otherwise soft-thresholded coordinate descent (which converges from anywhere) makes the next guess.

    Args:
        M: (n, n) joint-space inertia, reflected inertia included [kg m^2].
        b: (n,) momentum that the joints would have without friction [N m s].
        limit: (n,) friction impulse of the step, zero or more [N m s].
        v: (n,) speeds before the step; overwritten with those after it [rad/s].
        side: (n,) scratch.
        factor: (n, n) scratch.
        trial: (n,) scratch.
    """
    for j in range(len(v)):
        side[j] = np.sign(v[j])
    for _ in range(GUESSES):
        _solve_moving(M, b, limit, side, factor, trial)
        if _agrees(M, b, limit, side, trial):
            v[:] = trial
            return
        for _ in range(SWEEPS):
            _descend(M, b, limit, v)
        for j in range(len(v)):
            side[j] = np.sign(v[j])
    for _ in range(GUESSES * SWEEPS):
        _descend(M, b, limit, v)


@compiled
def _solve_moving(M: Array, b: Array, limit: Array, side: Array, factor: Array, v: Array) -> None:
    """Speeds of the joints that move under full friction against `side`; the others stand (L D L^T)."""
    n = len(v)
    for i in range(n):
        if limit[i] > 0.0 and side[i] == 0.0:
            v[i] = 0.0
            continue
        v[i] = b[i] - limit[i] * side[i]
        pivot = M[i, i]
        for j in range(i):
            if limit[j] > 0.0 and side[j] == 0.0:
                continue
            entry = M[i, j]
            for k in range(j):
                if limit[k] <= 0.0 or side[k] != 0.0:
                    entry -= factor[i, k] * factor[j, k] * factor[k, k]
            factor[i, j] = entry / factor[j, j]
            pivot -= factor[i, j] * entry
            v[i] -= factor[i, j] * v[j]
        factor[i, i] = max(pivot, SMALLEST_PIVOT)
    for i in range(n - 1, -1, -1):
        if limit[i] > 0.0 and side[i] == 0.0:
            continue
        v[i] /= factor[i, i]
        for j in range(i + 1, n):
            if limit[j] <= 0.0 or side[j] != 0.0:
                v[i] -= factor[j, i] * v[j]


@compiled
def _agrees(M: Array, b: Array, limit: Array, side: Array, v: Array) -> bool:
    """Whether moving joints move to their side and standing ones are held within their friction."""
    for i in range(len(v)):
        if limit[i] <= 0.0:
            continue
        if side[i] != 0.0:
            if not v[i] * side[i] > 0.0:
                return False
        else:
            push = b[i]
            for j in range(len(v)):
                push -= M[i, j] * v[j]
            if not abs(push) <= limit[i]:
                return False
    return True


@compiled
def _descend(M: Array, b: Array, limit: Array, v: Array) -> None:
    """One sweep of coordinate descent: each joint in turn takes its best speed, the others held."""
    for i in range(len(v)):
        push = b[i]
        for j in range(len(v)):
            if j != i:
                push -= M[i, j] * v[j]
        held = max(abs(push) - limit[i], 0.0)
        v[i] = np.sign(push) * held / max(M[i, i], SMALLEST_PIVOT)
