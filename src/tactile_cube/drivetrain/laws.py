"""The laws of every step: filter, limits and impedance of a joint, coupled joints, dry friction in joint space.

Joints that stick stand still exactly, and nothing creeps unless it is told to. The speeds after a step minimise
v' M v / 2 - b' v + sum_j limit_j |v_j|: where |v_j| > 0 friction opposes the motion with its full size, where v_j = 0
it takes any value up to it. This is implicit Coulomb friction (Moreau; Stewart and Trinkle, 1996) without a regularised
sign function. A joint with a grip g > 0 creeps instead of standing still: friction resists with g v until that reaches
its full size.
"""

from math import exp

import numpy as np
import numpy.typing as npt

from tactile_cube.compiled import compiled

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


@compiled
def low_pass(filtered: float, goal: float, time_constant: float, dt: float) -> float:
    """Advance the first-order low-pass T_s q_f' = q_n - q_f exactly by a step; T_s = 0 lets the goal through.

    Source: Sievers, Pitz, Bauml (ICRA 2022), section II-B ("cut-off 1/T_s").
    """
    if time_constant <= 0.0:
        return goal
    return goal + exp(-dt / time_constant) * (filtered - goal)


@compiled
def limit_rate(previous: float, target: float, rate: float, dt: float) -> float:
    """Return the target, at most `rate` [rad/s] away from where it was one step before."""
    return min(max(target, previous - rate * dt), previous + rate * dt)


@compiled
def limit_torque(target: float, q_m: float, v: float, kp: float, kd: float, limit: float) -> float:
    """Return the target nearest to the wanted one with K_P (q_d - q_m) - K_D dq within `limit` [N m].

    The controller is inverted approximately: with q_m as last measured.
    """
    if kp <= 0.0:
        return target
    return min(max(target, q_m + (kd * v - limit) / kp), q_m + (kd * v + limit) / kp)


@compiled
def impedance_torque(
    command: float, q: float, v: float, kp: float, kd: float, compliance: float, extra: float
) -> float:
    """Return tau = K_P (q_d - q_m) - K_D dq [N m], solved for tau with q_m = q + compliance * tau + extra.

    The loop is algebraic: iterating it would add a delay of one step, the closed form does not.
    Source: Sievers, Pitz, Bauml (ICRA 2022), eq. (1) and (2).

    Args:
        command: q_d [rad].
        q: link-side position [rad].
        v: speed that the controller sees [rad/s].
        kp: [N m/rad].
        kd: [N m s/rad].
        compliance: 1 / K_e, negative for the printed sign [rad/(N m)].
        extra: what other effects add to the measured position [rad].
    """
    return (kp * (command - q - extra) - kd * v) / (1.0 + kp * compliance)


@compiled
def expand(follow: Integers, ratio: Array, offset: Array, q: Array, v: Array, q_all: Array, v_all: Array) -> None:
    """Return positions and speeds of all dofs (N,) from those of the actuated joints (n,)."""
    for k in range(len(follow)):
        q_all[k] = ratio[k] * q[follow[k]] + offset[k]
        v_all[k] = ratio[k] * v[follow[k]]


@compiled
def reduce_equations(
    follow: Integers, ratio: Array, M: Array, h: Array, rotor: Array, M_joint: Array, h_joint: Array
) -> None:
    """Return J^T M J + diag(rotor) (n, n) and J^T h (n,): the reflected inertia enters in joint space."""
    M_joint[:] = 0.0
    h_joint[:] = 0.0
    for k in range(len(follow)):
        h_joint[follow[k]] += ratio[k] * h[k]
        for i in range(len(follow)):
            M_joint[follow[k], follow[i]] += ratio[k] * ratio[i] * M[k, i]
    for j in range(len(rotor)):
        M_joint[j, j] += rotor[j]


@compiled
def estimate_contact(
    follow: Integers, ratio: Array, M: Array, h: Array, torque: Array, acceleration: Array, limit: float, contact: Array
) -> None:
    """Return J^T c, c = M a + h - tau of the previous step: what else than the drives' torque moved the joints.

    Clipped at `limit` [N m], because an impact within one step is not a torque that lasts.
    """
    contact[:] = 0.0
    for k in range(len(follow)):
        other = h[k] - torque[k]
        for i in range(len(follow)):
            other += M[k, i] * acceleration[i]
        contact[follow[k]] += ratio[k] * other
    for j in range(len(contact)):
        contact[j] = min(max(contact[j], -limit), limit)


@compiled
def link_torques(
    follow: Integers,
    leader: Integers,
    ratio: Array,
    M: Array,
    h: Array,
    acceleration: Array,
    contact: Array,
    torque: Array,
) -> None:
    """Return torques (N,) that give the engine's links (inertia M, bias h) the wanted joint accelerations (n,).

    `contact` (n,) is taken off the actuated joints, the dofs `leader` (n,): the engine's solver adds it itself.
    """
    for k in range(len(follow)):
        torque[k] = h[k]
        for i in range(len(follow)):
            torque[k] += M[k, i] * ratio[i] * acceleration[follow[i]]
    for j in range(len(leader)):
        torque[leader[j]] -= contact[j]


@compiled
def add_tendons(
    follow: Integers,
    leader: Integers,
    ratio: Array,
    offset: Array,
    q: Array,
    v: Array,
    stiffness: float,
    damping: float,
    torque: Array,
) -> None:
    """Add to torques (N,) the spring that keeps each coupled dof at its place, at q, v (N,) of all dofs.

    It carries what contacts do to the coupled link; stiffness in [N m/rad], damping in [N m s/rad].
    """
    for k in range(len(follow)):
        first = leader[follow[k]]
        if first != k:
            stretch = ratio[k] * q[first] + offset[k] - q[k]
            pull = stiffness * stretch + damping * (ratio[k] * v[first] - v[k])
            torque[k] += pull
            torque[first] -= ratio[k] * pull


GUESSES = 10
SWEEPS = 4
SMALLEST_PIVOT = 1e-14


@compiled
def solve_speeds(
    M: Array, b: Array, limit: Array, grip: Array, v: Array, side: Array, factor: Array, trial: Array
) -> None:
    """Return the speeds after a step under dry friction.

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
    """Return the side to which a joint moves, 0 if it sticks."""
    return 0.0 if abs(v) * grip < limit and (grip > 0.0 or v == 0.0) else np.sign(v)


@compiled
def _stands(limit: float, grip: float, side: float) -> bool:
    return limit > 0.0 and side == 0.0 and grip <= 0.0


@compiled
def _solve_moving(M: Array, b: Array, limit: Array, grip: Array, side: Array, factor: Array, v: Array) -> None:
    """Return the speeds of moving joints, under full friction against `side`; the others stand (L D L^T).

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
    """Return whether moving joints move to their side and sticking ones are held within their friction."""
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
    """Descend once along each coordinate: each joint in turn takes its best speed, the others held."""
    for i in range(len(v)):
        push = b[i]
        for j in range(len(v)):
            if j != i:
                push -= M[i, j] * v[j]
        inertia = max(M[i, i], SMALLEST_PIVOT)
        v[i] = np.sign(push) * max(abs(push) - limit[i], 0.0) / inertia
        if grip[i] > 0.0 and abs(push) * grip[i] <= limit[i] * (inertia + grip[i]):
            v[i] = push / (inertia + grip[i])
