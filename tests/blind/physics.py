"""The blind world: exact rigid-body dynamics and every hidden effect, integrated at 5 kHz, on its own code alone.

The measured loop is tau = kp (q_d - q_m) - kd dq with q_m = q + deflection(tau) + offset; the rotor's reflected inertia
is added to the joint-space mass matrix; dry friction is solved exactly (a joint sticks without creeping). All
forces are taken at the middle of a step, which makes it second order where nothing switches.
"""

import numpy as np
from dynamics import mass_and_bias, reduced
from numba import njit
from numpy.typing import NDArray
from plant import (
    ACCELERATION_FRICTION,
    ANGLE_UNIT,
    ASYMMETRY,
    BACKLASH,
    BIAS,
    COGGING,
    COGGING_ORDER,
    COGGING_PHASE,
    CROSSTALK,
    CUBIC_STIFFNESS,
    DELAY,
    DETENT,
    DETENT_CENTRE,
    DETENT_WIDTH,
    DISTURBANCE,
    DISTURBANCE_FREQUENCY,
    DISTURBANCE_PHASE,
    DRAG,
    DRIFT,
    DRIFT_TIME,
    DRY_COUPLING,
    ERROR_DEAD_ZONE,
    EVEN_DRAG,
    GAIN,
    KD,
    KP,
    LAG,
    LOAD_FRICTION,
    MATRICES,
    NEIGHBOUR_FRICTION,
    OFFSET,
    POSITION_VELOCITY,
    PRESLIDING,
    RATE_LIMIT,
    REFLECTED_INERTIA,
    RELAY,
    RELAY_CENTRE,
    RELAY_WIDTH,
    SATURATION,
    SPEED_UNIT,
    SPRING,
    SPRING_CENTRE,
    STATIC_FRICTION,
    STIFFNESS,
    STOP_LOWER,
    STOP_STIFFNESS,
    STOP_UPPER,
    STRIBECK,
    STRIBECK_VELOCITY,
    TIME_UNIT,
    TORQUE_DEAD_ZONE,
    TORQUE_LIMIT,
    TRANSMISSION,
    TRANSMISSION_ORDER,
    TRANSMISSION_PHASE,
    VECTORS,
    VELOCITY_LAG,
    VISCOUS,
    VISCOUS_COUPLING,
    Plant,
)  # fmt: skip
from rig import Rig

Array = NDArray[np.float64]
STEP = 2e-4
"""Integration step [s]."""


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
    torque = (
        -p[VISCOUS, i] * v[i]
        - p[DRAG, i] * v[i] * abs(v[i])
        - p[EVEN_DRAG, i] * min(v[i] * v[i], (2.0 * p[SPEED_UNIT, i]) ** 2)
    )
    torque += p[COGGING, i] * np.sin(p[COGGING_ORDER, i] * q[i] + p[COGGING_PHASE, i])
    torque -= p[SPRING, i] * (q[i] - p[SPRING_CENTRE, i])
    x = (q[i] - p[DETENT_CENTRE, i]) / p[DETENT_WIDTH, i]
    torque -= p[DETENT, i] * x * np.exp(0.5 - 0.5 * x * x)
    torque += p[POSITION_VELOCITY, i] * q[i] * v[i]
    torque += p[DISTURBANCE, i] * np.sin(6.283185307179586 * p[DISTURBANCE_FREQUENCY, i] * t + p[DISTURBANCE_PHASE, i])
    torque += p[RELAY, i] * relay[i]
    give = 0.002 * p[TIME_UNIT, i] * p[STOP_STIFFNESS, i]
    if q[i] > p[STOP_UPPER, i]:
        torque -= p[STOP_STIFFNESS, i] * (q[i] - p[STOP_UPPER, i]) + max(give * v[i], 0.0)
    if q[i] < p[STOP_LOWER, i]:
        torque -= p[STOP_STIFFNESS, i] * (q[i] - p[STOP_LOWER, i]) + min(give * v[i], 0.0)
    for j in range(q.shape[0]):
        torque -= m[VISCOUS_COUPLING, i, j] * v[j] + m[DRY_COUPLING, i, j] * np.tanh(v[j] / (0.02 * p[SPEED_UNIT, j]))
    return torque


@njit(cache=True)
def _friction_level(p, m, i, t, q, v, load, acceleration):
    """Dry friction [N m] of joint i, without its asymmetry."""
    level = p[STATIC_FRICTION, i] * (1.0 + p[DRIFT, i] * (1.0 - np.exp(-max(t, 0.0) / p[DRIFT_TIME, i])))
    level += p[STRIBECK, i] * np.exp(-((v[i] / p[STRIBECK_VELOCITY, i]) ** 2))
    level += p[LOAD_FRICTION, i] * abs(load) + p[ACCELERATION_FRICTION, i] * abs(acceleration)
    for j in range(q.shape[0]):
        level += m[NEIGHBOUR_FRICTION, i, j] * (1.0 + np.sin(4.0 * q[j] / p[ANGLE_UNIT, j]))
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


@njit  # not cached: a cache does not see that dynamics.py changed
def _run(chain, gravity, select, shift, p, m, command, start, rate, settle, step):
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
        mass, bias = mass_and_bias(*chain, gravity, select @ qm + shift, select @ vm)
        inverse, reduced_bias = reduced(mass, bias, select, p[REFLECTED_INERTIA])
        free = v + step * (inverse @ (torque - reduced_bias))
        after = _stick_or_slip(free, inverse, low, high, impulse)
        acceleration = (after - v) / step
        # friction follows a smoothed acceleration, or it would chatter
        felt += (acceleration - felt) * step / (0.005 * p[TIME_UNIT])
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
    return _run(rig.arrays(), gravity, select, shift, vectors, matrices, command, start, rate, settle, step)
