"""The blind world: exact rigid-body dynamics and every hidden effect, integrated at 5 kHz, on its own code alone.

The measured loop is tau = kp (q_d - q_m) - kd dq with q_m = q + deflection(tau) + offset; the rotor's reflected inertia
is added to the joint-space mass matrix; dry friction is solved exactly (a joint sticks without creeping). All
forces are taken at the middle of a step, which makes it second order where nothing switches.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from rig import Rig

Array = NDArray[np.float64]
STEP = 2e-4
"""Integration step [s]."""


class Plant(NamedTuple):
    """Every constant of the world; one number per actuated joint, or a square matrix between joints."""

    # what a user's model has as well
    kp: Array
    kd: Array
    torque_limit: Array
    stiffness: Array
    static_friction: Array
    reflected_inertia: Array
    offset: Array
    # command
    delay: Array
    rate_limit: Array
    error_dead_zone: Array
    torque_dead_zone: Array
    # motor and transmission
    saturation: Array
    lag: Array
    velocity_lag: Array
    gain: Array
    bias: Array
    crosstalk: Array
    backlash: Array
    cubic_stiffness: Array
    transmission: Array
    transmission_order: Array
    transmission_phase: Array
    # friction
    viscous: Array
    stribeck: Array
    stribeck_velocity: Array
    load_friction: Array
    asymmetry: Array
    presliding: Array
    drift: Array
    drift_time: Array
    # joint torques
    drag: Array
    cogging: Array
    cogging_order: Array
    cogging_phase: Array
    spring: Array
    spring_centre: Array
    detent: Array
    detent_centre: Array
    detent_width: Array
    stop_lower: Array
    stop_upper: Array
    stop_stiffness: Array
    viscous_coupling: Array
    dry_coupling: Array
    # in no catalogue
    position_velocity: Array
    disturbance: Array
    disturbance_frequency: Array
    disturbance_phase: Array
    acceleration_friction: Array
    relay: Array
    relay_centre: Array
    relay_width: Array
    neighbour_friction: Array
    even_drag: Array


MATRICES = ("crosstalk", "viscous_coupling", "dry_coupling", "neighbour_friction")
INFINITE = ("rate_limit", "saturation", "stop_upper", "torque_limit", "stiffness")
ONES = ("gain", "stribeck_velocity", "transmission_order", "cogging_order", "detent_width", "drift_time")


VECTORS = tuple(name for name in Plant._fields if name not in MATRICES)
(
    KP,
    KD,
    TORQUE_LIMIT,
    STIFFNESS,
    STATIC_FRICTION,
    REFLECTED_INERTIA,
    OFFSET,
    DELAY,
    RATE_LIMIT,
    ERROR_DEAD_ZONE,
    TORQUE_DEAD_ZONE,
    SATURATION,
    LAG,
    VELOCITY_LAG,
    GAIN,
    BIAS,
    BACKLASH,
    CUBIC_STIFFNESS,
    TRANSMISSION,
    TRANSMISSION_ORDER,
    TRANSMISSION_PHASE,
    VISCOUS,
    STRIBECK,
    STRIBECK_VELOCITY,
    LOAD_FRICTION,
    ASYMMETRY,
    PRESLIDING,
    DRIFT,
    DRIFT_TIME,
    DRAG,
    COGGING,
    COGGING_ORDER,
    COGGING_PHASE,
    SPRING,
    SPRING_CENTRE,
    DETENT,
    DETENT_CENTRE,
    DETENT_WIDTH,
    STOP_LOWER,
    STOP_UPPER,
    STOP_STIFFNESS,
    POSITION_VELOCITY,
    DISTURBANCE,
    DISTURBANCE_FREQUENCY,
    DISTURBANCE_PHASE,
    ACCELERATION_FRICTION,
    RELAY,
    RELAY_CENTRE,
    RELAY_WIDTH,
    EVEN_DRAG,
) = range(len(VECTORS))
CROSSTALK, VISCOUS_COUPLING, DRY_COUPLING, NEIGHBOUR_FRICTION = range(len(MATRICES))


def neutral(joints: int) -> Plant:
    """A plant in which every effect is off (and every controller gain zero)."""
    values = {}
    for name in Plant._fields:
        shape = (joints, joints) if name in MATRICES else (joints,)
        fill = np.inf if name in INFINITE else 1.0 if name in ONES else 0.0
        values[name] = np.full(shape, fill)
    values["stop_lower"] = np.full(joints, -np.inf)
    return Plant(**values)


@njit(cache=True)
def _rotation(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = axis[0], axis[1], axis[2]
    r = np.empty((3, 3))
    r[0, 0], r[0, 1], r[0, 2] = c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s
    r[1, 0], r[1, 1], r[1, 2] = y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s
    r[2, 0], r[2, 1], r[2, 2] = z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)
    return r


@njit(cache=True)
def _cross(a, b, out):
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def _times(m, a, out):
    for i in range(3):
        out[i] = m[i, 0] * a[0] + m[i, 1] * a[1] + m[i, 2] * a[2]


@njit(cache=True)
def mass_and_bias(  # noqa: C901 - one page of Newton-Euler reads better than its pieces
    axes, origins, coms, masses, inertias, gravity, q, v
):
    """Joint-space mass matrix (n, n) and bias torque (n) of the open chain (Newton-Euler in the world frame)."""
    n = q.shape[0]
    z, c, o = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    world, force, moment = np.empty((n, 3, 3)), np.empty((n, 3)), np.empty((n, 3))
    lever, spun = np.empty((n, n, 3)), np.empty((n, 3))
    r, d, t1, t2, t3 = np.eye(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    w, alpha, acc, before = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    for k in range(3):
        acc[k] = -gravity[k]
    for i in range(n):
        _times(r, origins[i], d)
        _cross(alpha, d, t1)
        _cross(w, d, t2)
        _cross(w, t2, t3)
        for k in range(3):
            o[i, k] = before[k] + d[k]
            before[k] = o[i, k]
            acc[k] += t1[k] + t3[k]
        turn = _rotation(axes[i], q[i])
        for a in range(3):
            for b in range(3):
                d[b] = r[a, 0] * turn[0, b] + r[a, 1] * turn[1, b] + r[a, 2] * turn[2, b]
            for b in range(3):
                r[a, b] = d[b]
        _times(r, axes[i], z[i])
        _cross(w, z[i], t1)
        for k in range(3):
            alpha[k] += t1[k] * v[i]
            w[k] += z[i, k] * v[i]
        _times(r, coms[i], d)
        _cross(alpha, d, t1)
        _cross(w, d, t2)
        _cross(w, t2, t3)
        for k in range(3):
            c[i, k] = o[i, k] + d[k]
            force[i, k] = masses[i] * (acc[k] + t1[k] + t3[k])
        for a in range(3):
            for b in range(3):
                world[i, a, b] = 0.0
                for k in range(3):
                    world[i, a, b] += r[a, k] * inertias[i, k] * r[b, k]
        _times(world[i], w, t1)
        _cross(w, t1, t2)
        _times(world[i], alpha, t1)
        for k in range(3):
            moment[i, k] = t1[k] + t2[k]
    mass, bias = np.zeros((n, n)), np.zeros(n)
    for k in range(n):
        for i in range(k + 1):
            for a in range(3):
                d[a] = c[k, a] - o[i, a]
            _cross(z[i], d, lever[k, i])
            _times(world[k], z[i], spun[i])
            bias[i] += _dot(lever[k, i], force[k]) + _dot(z[i], moment[k])
            for j in range(i + 1):
                mass[i, j] += masses[k] * _dot(lever[k, i], lever[k, j]) + _dot(z[j], spun[i])
    for i in range(n):
        for j in range(i):
            mass[j, i] = mass[i, j]
    return mass, bias


@njit(cache=True)
def _reduced(mass, bias, select, extra):
    """The same for the actuated joints alone: inverse of S^T M S + diag(extra), and S^T h."""
    n, m = select.shape
    out, h = np.zeros((m, m)), np.zeros(m)
    for a in range(m):
        out[a, a] = extra[a]
        for i in range(n):
            if select[i, a] != 0.0:
                h[a] += select[i, a] * bias[i]
                for b in range(m):
                    for j in range(n):
                        out[a, b] += select[i, a] * mass[i, j] * select[j, b]
    return np.linalg.inv(out), h


@njit(cache=True)
def _deflection(torque, stiffness, cubic):
    """The stretch d of the drive with stiffness d + cubic d^3 = torque."""
    d = torque / stiffness
    if cubic > 0.0:
        for _ in range(20):
            d -= (stiffness * d + cubic * d**3 - torque) / (stiffness + 3 * cubic * d * d)
    return d


@njit(cache=True)
def _dead_zone(x, width):
    return np.sign(x) * max(abs(x) - width, 0.0)


@njit(cache=True)
def _closed_loop(p, i, error, speed, gap):
    """Controller torque, the drive's stretch in the loop; `error` is q_d minus the joint's reading, `gap` the play."""
    torque = 0.0
    for _ in range(40):
        stretch = _deflection(torque, p[STIFFNESS, i], p[CUBIC_STIFFNESS, i])
        wanted = p[KP, i] * _dead_zone(error - gap - stretch, p[ERROR_DEAD_ZONE, i]) - p[KD, i] * speed
        wanted = _dead_zone(wanted, p[TORQUE_DEAD_ZONE, i])
        limit = min(p[TORQUE_LIMIT, i], p[SATURATION, i])
        wanted = min(max(wanted, -limit), limit)
        change = (wanted - torque) / (1.0 + p[KP, i] / p[STIFFNESS, i])
        torque += change
        if abs(change) < 1e-10:
            break
    return torque


@njit(cache=True)
def _drive(p, i, error, speed):
    """Controller torque and position of the play: pressed to the side that transmits torque, floating in between."""
    half = 0.5 * p[BACKLASH, i]
    torque = _closed_loop(p, i, error, speed, half)
    if half == 0.0 or torque > 0.0:
        return torque, half
    torque = _closed_loop(p, i, error, speed, -half)
    if torque < 0.0:
        return torque, -half
    return 0.0, min(max(error - p[KD, i] * speed / p[KP, i], -half), half)


@njit(cache=True)
def _stick_or_slip(v, inverse, low, high, impulse):
    """Dry friction impulses, each within its cone and opposing the joint's final speed (projected Gauss-Seidel)."""
    n = v.shape[0]
    out = v - inverse @ impulse
    for _ in range(60):
        moved = 0.0
        for i in range(n):
            wanted = min(max(impulse[i] + out[i] / inverse[i, i], low[i]), high[i])
            change = wanted - impulse[i]
            impulse[i] = wanted
            for j in range(n):
                out[j] -= inverse[j, i] * change
            moved += abs(change)
        if moved < 1e-14:
            break
    return out


@njit(cache=True)
def _joint_torques(p, m, i, t, q, v, relay):
    """Torques that depend on the motion alone, friction excepted."""
    torque = -p[VISCOUS, i] * v[i] - p[DRAG, i] * v[i] * abs(v[i]) - p[EVEN_DRAG, i] * min(v[i] * v[i], 4.0)
    torque += p[COGGING, i] * np.sin(p[COGGING_ORDER, i] * q[i] + p[COGGING_PHASE, i])
    torque -= p[SPRING, i] * (q[i] - p[SPRING_CENTRE, i])
    x = (q[i] - p[DETENT_CENTRE, i]) / p[DETENT_WIDTH, i]
    torque -= p[DETENT, i] * x * np.exp(0.5 - 0.5 * x * x)
    torque += p[POSITION_VELOCITY, i] * q[i] * v[i]
    torque += p[DISTURBANCE, i] * np.sin(6.283185307179586 * p[DISTURBANCE_FREQUENCY, i] * t + p[DISTURBANCE_PHASE, i])
    torque += p[RELAY, i] * relay[i]
    if q[i] > p[STOP_UPPER, i]:
        torque -= p[STOP_STIFFNESS, i] * (q[i] - p[STOP_UPPER, i]) + max(0.002 * p[STOP_STIFFNESS, i] * v[i], 0.0)
    if q[i] < p[STOP_LOWER, i]:
        torque -= p[STOP_STIFFNESS, i] * (q[i] - p[STOP_LOWER, i]) + min(0.002 * p[STOP_STIFFNESS, i] * v[i], 0.0)
    for j in range(q.shape[0]):
        torque -= m[VISCOUS_COUPLING, i, j] * v[j] + m[DRY_COUPLING, i, j] * np.tanh(v[j] / 0.02)
    return torque


@njit(cache=True)
def _friction_level(p, m, i, t, q, v, load, acceleration):
    """Dry friction [N m] of joint i, without its asymmetry."""
    level = p[STATIC_FRICTION, i] * (1.0 + p[DRIFT, i] * (1.0 - np.exp(-max(t, 0.0) / p[DRIFT_TIME, i])))
    level += p[STRIBECK, i] * np.exp(-((v[i] / p[STRIBECK_VELOCITY, i]) ** 2))
    level += p[LOAD_FRICTION, i] * abs(load) + p[ACCELERATION_FRICTION, i] * abs(acceleration)
    for j in range(q.shape[0]):
        level += m[NEIGHBOUR_FRICTION, i, j] * (1.0 + np.sin(4.0 * q[j]))
    return level


@njit(cache=True)
def follow(p, i, q, v, target, step, held, filtered, state, relay):
    """One step of joint i's drive: the command that it holds, its filtered speed, its torque, and a hidden relay."""
    most = p[RATE_LIMIT, i] * step
    held[i] += min(max(target - held[i], -most), most)
    filtered[i] = v if p[VELOCITY_LAG, i] <= 0 else filtered[i] + (v - filtered[i]) * step / p[VELOCITY_LAG, i]
    error = held[i] - q - p[OFFSET, i]
    error -= p[TRANSMISSION, i] * np.sin(p[TRANSMISSION_ORDER, i] * q + p[TRANSMISSION_PHASE, i])
    if p[LAG, i] > 0.0:
        stretch = _deflection(state[i], p[STIFFNESS, i], p[CUBIC_STIFFNESS, i])
        wanted = p[KP, i] * (error - stretch) - p[KD, i] * filtered[i]
        wanted = min(max(wanted, -p[TORQUE_LIMIT, i]), p[TORQUE_LIMIT, i])
        state[i] += (wanted - state[i]) * step / p[LAG, i]
    else:
        state[i] = _drive(p, i, error, filtered[i])[0]
    edge = p[RELAY_CENTRE, i] + (-0.5 if relay[i] > 0 else 0.5) * p[RELAY_WIDTH, i]
    relay[i] = 1.0 if q > edge else -1.0


@njit(cache=True)
def load_on_joint(p, m, i, t, q, v, step, state, relay, bristle, felt):
    """Torque on joint i but for gravity and dry friction, and the level of that, without its asymmetry."""
    load = p[GAIN, i] * state[i] + p[BIAS, i]
    for j in range(q.shape[0]):
        load += m[CROSSTALK, i, j] * state[j]
    torque = load + _joint_torques(p, m, i, t, q, v, relay)
    level = _friction_level(p, m, i, t, q, v, load, felt[i])
    if p[PRESLIDING, i] > 0.0:
        way = 1.0 if v[i] >= 0 else -1.0
        bristle[i] = way + (bristle[i] - way) * np.exp(-abs(v[i]) * step / p[PRESLIDING, i])
        torque -= level * bristle[i]
        level = 0.0
    return torque, level


@njit(cache=True)
def read_sensors(p, q, held, filtered, state, position, torque, joint):
    """What the sensors say at the end of the interval in which a command was in force."""
    for i in range(q.shape[0]):
        error = held[i] - q[i] - p[OFFSET, i]
        error -= p[TRANSMISSION, i] * np.sin(p[TRANSMISSION_ORDER, i] * q[i] + p[TRANSMISSION_PHASE, i])
        gap = 0.0
        if p[BACKLASH, i] > 0.0:
            gap = _drive(p, i, error, filtered[i])[1]
        position[i] = held[i] - error + _deflection(state[i], p[STIFFNESS, i], p[CUBIC_STIFFNESS, i]) + gap
        torque[i] = state[i]
        joint[i] = q[i]


@njit(cache=True)
def _run(axes, origins, coms, masses, inertias, gravity, select, shift, p, m, command, start, rate, settle, step):
    """Sampled motor positions and torques (samples, joints) under a command held between its samples."""
    samples, n = command.shape
    per = round(1.0 / (rate * step))
    position, torque_out, joint_out = np.empty((samples, n)), np.empty((samples, n)), np.empty((samples, n))
    q = start.copy()
    v, acceleration, impulse = np.zeros(n), np.zeros(n), np.zeros(n)
    held, state, filtered, bristle, relay = command[0].copy(), np.zeros(n), np.zeros(n), np.zeros(n), np.ones(n)
    torque, low, high, felt = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    lead = round(settle / step)
    for k in range(-lead, samples * per):
        t = k * step
        qm, vm = q + 0.5 * step * v, v + 0.5 * step * acceleration
        for i in range(n):
            late = int(np.floor((t - p[DELAY, i]) * rate + 1e-6))
            follow(p, i, qm[i], vm[i], command[min(max(late, 0), samples - 1), i], step, held, filtered, state, relay)
        for i in range(n):
            torque[i], level = load_on_joint(p, m, i, t, qm, vm, step, state, relay, bristle, felt)
            low[i], high[i] = -step * level * (1.0 - p[ASYMMETRY, i]), step * level * (1.0 + p[ASYMMETRY, i])
        mass, bias = mass_and_bias(axes, origins, coms, masses, inertias, gravity, select @ qm + shift, select @ vm)
        inverse, reduced_bias = _reduced(mass, bias, select, p[REFLECTED_INERTIA])
        free = v + step * (inverse @ (torque - reduced_bias))
        after = _stick_or_slip(free, inverse, low, high, impulse)
        acceleration = (after - v) / step
        felt += (acceleration - felt) * step / 0.005  # friction follows a smoothed acceleration, or it would chatter
        q = q + 0.5 * step * (v + after)
        v = after
        if not np.abs(q).max() < 100.0:
            position[:] = np.nan
            break
        if k >= 0 and (k + 1) % per == 0:
            read_sensors(p, q, held, filtered, state, position[k // per], torque_out[k // per], joint_out[k // per])
    return position, torque_out, joint_out


def simulate(
    rig: Rig, plant: Plant, command: Array, rate: float, start: Array, settle: float = 0.0, step: float = STEP
) -> tuple[Array, Array, Array]:
    """Noise-free motor positions [rad], controller torques [N m] and joint positions [rad], each (samples, joints).

    The joints start at rest at `start` (joints) [rad], `settle` seconds before the first sample. Row k is what the
    sensors say at the end of the interval in which command k was in force.
    """
    select, shift = rig.selection()
    vectors = np.stack([getattr(plant, name) for name in VECTORS])
    matrices = np.stack([getattr(plant, name) for name in MATRICES])
    gravity = np.array(rig.gravity)
    return _run(*rig.arrays(), gravity, select, shift, vectors, matrices, command, start, rate, settle, step)
