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
        stretch = _deflection(torque, p.stiffness[i], p.cubic_stiffness[i])
        wanted = p.kp[i] * _dead_zone(error - gap - stretch, p.error_dead_zone[i]) - p.kd[i] * speed
        wanted = _dead_zone(wanted, p.torque_dead_zone[i])
        limit = min(p.torque_limit[i], p.saturation[i])
        wanted = min(max(wanted, -limit), limit)
        change = (wanted - torque) / (1.0 + p.kp[i] / p.stiffness[i])
        torque += change
        if abs(change) < 1e-10:
            break
    return torque


@njit(cache=True)
def _drive(p, i, error, speed):
    """Controller torque and position of the play: pressed to the side that transmits torque, floating in between."""
    half = 0.5 * p.backlash[i]
    torque = _closed_loop(p, i, error, speed, half)
    if half == 0.0 or torque > 0.0:
        return torque, half
    torque = _closed_loop(p, i, error, speed, -half)
    if torque < 0.0:
        return torque, -half
    return 0.0, min(max(error - p.kd[i] * speed / p.kp[i], -half), half)


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
            out -= inverse[:, i] * change
            moved += abs(change)
        if moved < 1e-14:
            break
    return out


@njit(cache=True)
def _joint_torques(p, i, t, q, v, relay):
    """Torques that depend on the motion alone, friction excepted."""
    torque = -p.viscous[i] * v[i] - p.drag[i] * v[i] * abs(v[i]) - p.even_drag[i] * v[i] * v[i]
    torque += p.cogging[i] * np.sin(p.cogging_order[i] * q[i] + p.cogging_phase[i])
    torque -= p.spring[i] * (q[i] - p.spring_centre[i])
    x = (q[i] - p.detent_centre[i]) / p.detent_width[i]
    torque -= p.detent[i] * x * np.exp(0.5 - 0.5 * x * x)
    torque += p.position_velocity[i] * q[i] * v[i]
    torque += p.disturbance[i] * np.sin(6.283185307179586 * p.disturbance_frequency[i] * t + p.disturbance_phase[i])
    torque += p.relay[i] * relay[i]
    if q[i] > p.stop_upper[i]:
        torque -= p.stop_stiffness[i] * (q[i] - p.stop_upper[i]) + max(0.002 * p.stop_stiffness[i] * v[i], 0.0)
    if q[i] < p.stop_lower[i]:
        torque -= p.stop_stiffness[i] * (q[i] - p.stop_lower[i]) + min(0.002 * p.stop_stiffness[i] * v[i], 0.0)
    for j in range(q.shape[0]):
        torque -= p.viscous_coupling[i, j] * v[j] + p.dry_coupling[i, j] * np.tanh(v[j] / 0.02)
    return torque


@njit(cache=True)
def _friction_level(p, i, t, q, v, load, acceleration):
    """Dry friction [N m] of joint i, without its asymmetry."""
    level = p.static_friction[i] * (1.0 + p.drift[i] * (1.0 - np.exp(-max(t, 0.0) / p.drift_time[i])))
    level += p.stribeck[i] * np.exp(-((v[i] / p.stribeck_velocity[i]) ** 2))
    level += p.load_friction[i] * abs(load) + p.acceleration_friction[i] * abs(acceleration)
    for j in range(q.shape[0]):
        level += p.neighbour_friction[i, j] * (1.0 + np.sin(4.0 * q[j]))
    return level


@njit(cache=True)
def _log(p, q, held, filtered, state, position, torque, joint):
    """What the sensors say at the end of the interval in which a command was in force."""
    for i in range(q.shape[0]):
        error = held[i] - q[i] - p.offset[i]
        error -= p.transmission[i] * np.sin(p.transmission_order[i] * q[i] + p.transmission_phase[i])
        gap = 0.0
        if p.backlash[i] > 0.0:
            gap = _drive(p, i, error, filtered[i])[1]
        position[i] = held[i] - error + _deflection(state[i], p.stiffness[i], p.cubic_stiffness[i]) + gap
        torque[i] = state[i]
        joint[i] = q[i]


@njit(cache=True)
def _run(axes, origins, coms, masses, inertias, gravity, select, shift, p, command, start, rate, settle, step):
    """Sampled motor positions and torques (samples, joints) under a command held between its samples."""
    samples, n = command.shape
    per = round(1.0 / (rate * step))
    position, torque_out, joint_out = np.empty((samples, n)), np.empty((samples, n)), np.empty((samples, n))
    q = start.copy()
    v, acceleration, impulse = np.zeros(n), np.zeros(n), np.zeros(n)
    held, state, filtered, bristle, relay = command[0].copy(), np.zeros(n), np.zeros(n), np.zeros(n), np.ones(n)
    torque, load, low, high = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    lead = round(settle / step)
    for k in range(-lead, samples * per):
        t = k * step
        qm, vm = q + 0.5 * step * v, v + 0.5 * step * acceleration
        for i in range(n):
            late = int(np.floor((t - p.delay[i]) * rate + 1e-6))
            target = command[min(max(late, 0), samples - 1), i]
            most = p.rate_limit[i] * step
            held[i] += min(max(target - held[i], -most), most)
            filtered[i] = (
                vm[i] if p.velocity_lag[i] <= 0 else filtered[i] + (vm[i] - filtered[i]) * step / p.velocity_lag[i]
            )
            error = held[i] - qm[i] - p.offset[i]
            error -= p.transmission[i] * np.sin(p.transmission_order[i] * qm[i] + p.transmission_phase[i])
            if p.lag[i] > 0.0:
                stretch = _deflection(state[i], p.stiffness[i], p.cubic_stiffness[i])
                wanted = p.kp[i] * (error - stretch) - p.kd[i] * filtered[i]
                wanted = min(max(wanted, -p.torque_limit[i]), p.torque_limit[i])
                state[i] += (wanted - state[i]) * step / p.lag[i]
            else:
                state[i] = _drive(p, i, error, filtered[i])[0]
            edge = p.relay_centre[i] + (-0.5 if relay[i] > 0 else 0.5) * p.relay_width[i]
            relay[i] = 1.0 if qm[i] > edge else -1.0
        for i in range(n):
            load[i] = p.gain[i] * state[i] + p.bias[i]
            for j in range(n):
                load[i] += p.crosstalk[i, j] * state[j]
            torque[i] = load[i] + _joint_torques(p, i, t, qm, vm, relay)
            level = _friction_level(p, i, t, qm, vm, load[i], acceleration[i])
            if p.presliding[i] > 0.0:
                way = 1.0 if vm[i] >= 0 else -1.0
                bristle[i] = way + (bristle[i] - way) * np.exp(-abs(vm[i]) * step / p.presliding[i])
                torque[i] -= level * bristle[i]
                level = 0.0
            low[i], high[i] = -step * level * (1.0 - p.asymmetry[i]), step * level * (1.0 + p.asymmetry[i])
        mass, bias = mass_and_bias(axes, origins, coms, masses, inertias, gravity, select @ qm + shift, select @ vm)
        inverse, reduced_bias = _reduced(mass, bias, select, p.reflected_inertia)
        free = v + step * (inverse @ (torque - reduced_bias))
        after = _stick_or_slip(free, inverse, low, high, impulse)
        acceleration = (after - v) / step
        q = q + 0.5 * step * (v + after)
        v = after
        if k >= 0 and (k + 1) % per == 0:
            _log(p, q, held, filtered, state, position[k // per], torque_out[k // per], joint_out[k // per])
    return position, torque_out, joint_out


def simulate(
    rig: Rig, plant: Plant, command: Array, rate: float, start: Array, settle: float = 0.0, step: float = STEP
) -> tuple[Array, Array, Array]:
    """Noise-free motor positions [rad], controller torques [N m] and joint positions [rad], each (samples, joints).

    The joints start at rest at `start` (joints) [rad], `settle` seconds before the first sample. Row k is what the
    sensors say at the end of the interval in which command k was in force.
    """
    select, shift = rig.selection()
    return _run(*rig.arrays(), np.array(rig.gravity), select, shift, plant, command, start, rate, settle, step)
