"""The blind world: exact rigid-body dynamics and every hidden effect, integrated at 5 kHz, on its own code alone.

The measured loop is tau = kp (q_d - q_m) - kd dq with q_m = q + deflection(tau) + offset; the rotor's reflected inertia
is added to the joint-space mass matrix; dry friction is solved exactly (a joint sticks without creeping). All
forces are taken at the middle of a step, which makes it second order where nothing switches.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from benchmarks.blind import plant as at
from benchmarks.blind.dynamics import mass_and_bias, reduced
from benchmarks.blind.plant import Plant
from benchmarks.blind.rig import Rig

Array = NDArray[np.float64]
STEP = 2e-4
"""Integration step [s]."""
SLIP_AT, SLIP_SHARE = (0.3, 0.8, 1.6, 3.0), (0.4, 0.3, 0.2, 0.1)
"""Where the elements of a Maxwell-slip friction give way, in its range, and what share of the friction each bears."""


@njit(cache=True)
def _deflection(p, i, torque):
    """The deflection d of the drive: stiffness d + cubic d^3 = torque, or another stiffness from its knee on."""
    stiffness, cubic, knee = p[at.STIFFNESS, i], p[at.CUBIC_STIFFNESS, i], p[at.KNEE, i]
    d = torque / stiffness
    if abs(d) > knee:
        return np.sign(d) * (knee + (abs(torque) - stiffness * knee) / p[at.KNEE_STIFFNESS, i])
    if cubic > 0.0:
        for _ in range(20):
            d -= (stiffness * d + cubic * d**3 - torque) / (stiffness + 3 * cubic * d * d)
    return d


@njit(cache=True)
def _dead_zone(x, width):
    return np.sign(x) * max(abs(x) - width, 0.0)


@njit(cache=True)
def _closed_loop(p, i, error, speed, gap):
    """Controller torque, the drive's deflection in the loop; `error` is q_d minus the reading, `gap` the play."""
    torque = 0.0
    for _ in range(40):
        deflection = _deflection(p, i, torque)
        wanted = p[at.KP, i] * _dead_zone(error - gap - deflection, p[at.ERROR_DEAD_ZONE, i]) - p[at.KD, i] * speed
        wanted = _dead_zone(wanted, p[at.TORQUE_DEAD_ZONE, i])
        limit = min(p[at.TORQUE_LIMIT, i], p[at.SATURATION, i])
        wanted = min(max(wanted, -limit), limit)
        if p[at.SOFT_LIMIT, i] < np.inf:
            wanted = p[at.SOFT_LIMIT, i] * np.tanh(wanted / p[at.SOFT_LIMIT, i])
        change = (wanted - torque) / (1.0 + p[at.KP, i] / p[at.STIFFNESS, i])
        torque += change
        if abs(change) < 1e-10:
            break
    return torque


@njit(cache=True)
def _drive(p, i, error, speed):
    """Controller torque and position of the play: pressed to the side that transmits torque, floating in between."""
    half = 0.5 * p[at.BACKLASH, i]
    torque = _closed_loop(p, i, error, speed, half)
    if half == 0.0 or torque > 0.0:
        return torque, half
    torque = _closed_loop(p, i, error, speed, -half)
    if torque < 0.0:
        return torque, -half
    return 0.0, min(max(error - p[at.KD, i] * speed / p[at.KP, i], -half), half)


@njit(cache=True)
def _smooth_drive(p, i, error, speed):
    """Controller torque and position of a play that passes from side to side with the torque (bisection)."""
    half, low, high = 0.5 * p[at.SMOOTH_BACKLASH, i], -p[at.TORQUE_LIMIT, i], p[at.TORQUE_LIMIT, i]
    torque, gap = 0.0, 0.0
    for _ in range(50):
        torque = 0.5 * (low + high)
        gap = half * np.tanh(torque / p[at.SMOOTH_TORQUE, i])
        wanted = p[at.KP, i] * (error - gap - _deflection(p, i, torque)) - p[at.KD, i] * speed
        if wanted > torque:
            low = torque
        else:
            high = torque
    return torque, gap


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
        -p[at.VISCOUS, i] * v[i]
        - p[at.DRAG, i] * v[i] * abs(v[i])
        - p[at.EVEN_DRAG, i] * min(v[i] * v[i], (2.0 * p[at.SPEED_UNIT, i]) ** 2)
    )
    torque -= 0.5 * p[at.VISCOUS_DIFFERENCE, i] * abs(v[i]) + p[at.CUBIC_DRAG, i] * v[i] ** 3
    torque += p[at.COGGING, i] * np.sin(p[at.COGGING_ORDER, i] * q[i] + p[at.COGGING_PHASE, i])
    torque += p[at.COGGING_2, i] * np.sin(2.0 * p[at.COGGING_ORDER, i] * q[i] + p[at.COGGING_PHASE_2, i])
    torque += p[at.COGGING_3, i] * np.sin(3.0 * p[at.COGGING_ORDER, i] * q[i] + p[at.COGGING_PHASE_3, i])
    torque -= p[at.SPRING, i] * (q[i] - p[at.SPRING_CENTRE, i])
    x = (q[i] - p[at.DETENT_CENTRE, i]) / p[at.DETENT_WIDTH, i]
    torque -= p[at.DETENT, i] * x * np.exp(0.5 - 0.5 * x * x)
    torque += p[at.POSITION_VELOCITY, i] * q[i] * v[i]
    torque += p[at.DISTURBANCE, i] * np.sin(
        6.283185307179586 * p[at.DISTURBANCE_FREQUENCY, i] * t + p[at.DISTURBANCE_PHASE, i]
    )
    torque += p[at.RELAY, i] * relay[i]
    pushed = t - p[at.PUSH_START, i]
    if 0.0 <= pushed < p[at.PUSH_SECONDS, i]:
        torque += p[at.PUSH, i] * np.sin(3.141592653589793 * pushed / p[at.PUSH_SECONDS, i]) ** 2
    give = 0.002 * p[at.TIME_UNIT, i] * p[at.STOP_STIFFNESS, i]
    if q[i] > p[at.STOP_UPPER, i]:
        torque -= p[at.STOP_STIFFNESS, i] * (q[i] - p[at.STOP_UPPER, i]) + max(give * v[i], 0.0)
        torque -= p[at.STOP_GROWTH, i] * (q[i] - p[at.STOP_UPPER, i]) ** 2
    if q[i] < p[at.STOP_LOWER, i]:
        torque += p[at.STOP_GROWTH, i] * (q[i] - p[at.STOP_LOWER, i]) ** 2
        torque -= p[at.STOP_STIFFNESS, i] * (q[i] - p[at.STOP_LOWER, i]) + min(give * v[i], 0.0)
    for j in range(q.shape[0]):
        torque -= m[at.VISCOUS_COUPLING, i, j] * v[j] + m[at.DRY_COUPLING, i, j] * np.tanh(
            v[j] / (0.02 * p[at.SPEED_UNIT, j])
        )
    return torque


@njit(cache=True)
def _friction_level(p, m, i, t, q, v, load, acceleration):
    """Dry friction [N m] of joint i, without its asymmetry."""
    level = p[at.STATIC_FRICTION, i] * (1.0 + p[at.DRIFT, i] * (1.0 - np.exp(-max(t, 0.0) / p[at.DRIFT_TIME, i])))
    level += p[at.STATIC_FRICTION, i] * (max(1.0 + p[at.DRIFT_RATE, i] * max(t, 0.0), 0.2) - 1.0)
    slow = abs(v[i] / p[at.STRIBECK_VELOCITY, i])
    exponent = p[at.STRIBECK_EXPONENT, i]
    level += p[at.STRIBECK, i] * np.exp(-(slow * slow if exponent == 2.0 else slow**exponent))
    if load * v[i] < 0.0:
        level += p[at.BACKDRIVEN_FRICTION, i] * abs(load)
    level += p[at.LOAD_FRICTION, i] * abs(load) + p[at.ACCELERATION_FRICTION, i] * abs(acceleration)
    for j in range(q.shape[0]):
        level += m[at.NEIGHBOUR_FRICTION, i, j] * (1.0 + np.sin(4.0 * q[j] / p[at.ANGLE_UNIT, j]))
    return level


@njit(cache=True)
def follow(p, i, q, v, target, fed, step, held, filtered, state, relay, memory):
    """One step of joint i's drive: the command that it holds, its filtered speed, its torque, and a hidden relay.

    `memory` (joints, 3) holds the place of a damped play, the first stage of a filter of second order and the integral
    of a controller, which adds the torque `fed` to that of its errors.
    """
    most = p[at.RATE_LIMIT, i] * step
    held[i] += min(max(target - held[i], -most), most)
    before = filtered[i]
    filtered[i] = v if p[at.VELOCITY_LAG, i] <= 0 else filtered[i] + (v - filtered[i]) * step / p[at.VELOCITY_LAG, i]
    if p[at.VELOCITY_LAG_2, i] > 0.0:
        memory[i, 1] += (v - memory[i, 1]) * step / p[at.VELOCITY_LAG_2, i]
        filtered[i] = before + (memory[i, 1] - before) * step / p[at.VELOCITY_LAG_2, i]
    error = held[i] - q - p[at.OFFSET, i]
    error -= p[at.TRANSMISSION, i] * np.sin(p[at.TRANSMISSION_ORDER, i] * q + p[at.TRANSMISSION_PHASE, i])
    if p[at.INTEGRAL, i] > 0.0:
        most = p[at.INTEGRAL_LIMIT, i]
        grown = memory[i, 2] + p[at.INTEGRAL, i] * step * (error - _deflection(p, i, state[i]))
        memory[i, 2] = min(max(grown, -most), most)
    if memory[i, 2] + fed != 0.0:
        error += (memory[i, 2] + fed) / p[at.KP, i]
    if p[at.LAG, i] > 0.0:
        deflection = _deflection(p, i, state[i])
        wanted = p[at.KP, i] * (error - deflection) - p[at.KD, i] * filtered[i]
        wanted = min(max(wanted, -p[at.TORQUE_LIMIT, i]), p[at.TORQUE_LIMIT, i])
        state[i] += (wanted - state[i]) * step / p[at.LAG, i]
    elif p[at.SMOOTH_BACKLASH, i] > 0.0:
        state[i] = _smooth_drive(p, i, error, filtered[i])[0]
    elif p[at.GAP_DAMPING, i] > 0.0:
        half = 0.5 * p[at.DAMPED_BACKLASH, i]
        state[i] = _closed_loop(p, i, error, filtered[i], memory[i, 0])
        memory[i, 0] = min(max(memory[i, 0] + state[i] * step / p[at.GAP_DAMPING, i], -half), half)
    else:
        state[i] = _drive(p, i, error, filtered[i])[0]
    lost = p[at.STALL, i] * v / p[at.NO_LOAD, i] if p[at.STALL, i] < np.inf else 0.0
    state[i] = min(max(state[i], -p[at.STALL, i] - lost), p[at.STALL, i] - lost)
    edge = p[at.RELAY_CENTRE, i] + (-0.5 if relay[i] > 0 else 0.5) * p[at.RELAY_WIDTH, i]
    relay[i] = 1.0 if q > edge else -1.0


@njit(cache=True)
def _bristles(p, i, v, step, z):
    """Share of the dry friction that bristles bear, and their new deflections z (4): Dahl, Maxwell slip, Bouc-Wen."""
    way, reach = 1.0 if v >= 0 else -1.0, p[at.PRESLIDING, i]
    if p[at.BRISTLES, i] == at.MAXWELL:
        share = 0.0
        for k in range(4):
            z[k] = min(max(z[k] + v * step / (SLIP_AT[k] * reach), -1.0), 1.0)
            share += SLIP_SHARE[k] * z[k]
        return share
    if p[at.BRISTLES, i] == at.BOUC_WEN:
        pull = p[at.BOUC_WEN_SHAPE, i] * np.sign(v * z[0]) + 1.0 - p[at.BOUC_WEN_SHAPE, i]
        z[0] = min(max(z[0] + v * step / reach * (1.0 - z[0] ** 2 * pull), -1.0), 1.0)
        return z[0]
    z[0] = way + (z[0] - way) * np.exp(-abs(v) * step / reach)
    return z[0]


@njit(cache=True)
def load_on_joint(p, m, i, t, q, v, step, state, relay, bristle, felt):
    """Torque on joint i but for gravity and dry friction, and the level of that, without its asymmetry."""
    bend = p[at.TORQUE_BEND, i]
    asked = min(abs(state[i]), 0.5 / bend) if bend > 0.0 else abs(state[i])  # beyond its top the curve stays there
    load = p[at.GAIN, i] * np.sign(state[i]) * asked * (1.0 - bend * asked) + p[at.BIAS, i]
    for j in range(q.shape[0]):
        load += m[at.CROSSTALK, i, j] * state[j]
    torque = load + _joint_torques(p, m, i, t, q, v, relay)
    level = _friction_level(p, m, i, t, q, v, load, felt[i])
    if p[at.PRESLIDING, i] > 0.0:
        torque -= level * _bristles(p, i, v[i], step, bristle[i])
        torque -= p[at.MICRO_DAMPING, i] * (v[i] - abs(v[i]) * bristle[i, 0])
        level = 0.0
    return torque, level


@njit(cache=True)
def read_sensors(p, q, held, filtered, state, memory, position, torque, joint):
    """What the sensors say at the end of the interval in which a command was in force."""
    for i in range(q.shape[0]):
        error = held[i] - q[i] - p[at.OFFSET, i]
        error -= p[at.TRANSMISSION, i] * np.sin(p[at.TRANSMISSION_ORDER, i] * q[i] + p[at.TRANSMISSION_PHASE, i])
        gap = memory[i, 0]
        if p[at.SMOOTH_BACKLASH, i] > 0.0:
            gap = _smooth_drive(p, i, error, filtered[i])[1]
        if p[at.BACKLASH, i] > 0.0:
            gap = _drive(p, i, error, filtered[i])[1]
        position[i] = held[i] - error + _deflection(p, i, state[i]) + gap
        torque[i] = state[i]
        joint[i] = q[i]


@njit  # not cached: a cache does not see that dynamics.py changed
def _run(chain, gravity, stated, select, shift, p, m, command, start, rate, settle, step):
    """Sampled motor positions and torques (samples, joints) under a command held between its samples."""
    samples, n = command.shape
    per = round(1.0 / (rate * step))
    position, torque_out, joint_out = np.empty((samples, n)), np.empty((samples, n)), np.empty((samples, n))
    q = start.copy()
    v, acceleration, impulse = np.zeros(n), np.zeros(n), np.zeros(n)
    held, state, filtered, relay = command[0].copy(), np.zeros(n), np.zeros(n), np.ones(n)
    bristle, memory, arrived = np.zeros((n, 4)), np.zeros((n, 3)), np.zeros(n, np.int64)
    weight, compensates, early = np.zeros(n), p[at.COMPENSATION].any(), round(p[at.EARLY, 0] / step)
    torque, low, high, felt = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    lead = round(settle / step)
    for k in range(-lead, samples * per + max(-early, 0)):
        t = k * step
        qm, vm = q + 0.5 * step * v, v + 0.5 * step * acceleration
        if compensates:
            mass, bias = mass_and_bias(*chain, stated, select @ qm + shift, select @ np.zeros(n))  # type: ignore[call-arg]
            weight = reduced(mass, bias, select, p[at.REFLECTED_INERTIA])[1]
        for i in range(n):
            wait = p[at.DELAY, i]
            if p[at.JITTER, i] > 0.0:  # anew every 20 ms, in every trial otherwise
                chance = 43758.5453 * np.sin(12.9898 * np.floor(t / 0.02) + 78.233 * start[i])
                wait += p[at.JITTER, i] * (chance - np.floor(chance))
            late = int(np.floor((t - wait) * rate + 1e-6))
            arrived[i] = max(arrived[i], min(max(late, 0), samples - 1))
            target = command[arrived[i], i]
            fed = p[at.COMPENSATION, i] * weight[i]
            fed += p[at.FEEDFORWARD, i] * rate * (target - command[max(arrived[i] - 1, 0), i])
            follow(p, i, qm[i], vm[i], target, fed, step, held, filtered, state, relay, memory)
        for i in range(n):
            torque[i], level = load_on_joint(p, m, i, t, qm, vm, step, state, relay, bristle, felt)
            low[i], high[i] = -step * level * (1.0 - p[at.ASYMMETRY, i]), step * level * (1.0 + p[at.ASYMMETRY, i])
        mass, bias = mass_and_bias(*chain, gravity, select @ qm + shift, select @ vm)  # type: ignore[call-arg]
        inverse, reduced_bias = reduced(mass, bias, select, p[at.REFLECTED_INERTIA])
        free = v + step * (inverse @ (torque - reduced_bias))
        after = _stick_or_slip(free, inverse, low, high, impulse)
        acceleration = (after - v) / step
        # friction follows a smoothed acceleration, or it would chatter
        felt += (acceleration - felt) * step / (0.005 * p[at.TIME_UNIT])
        q = q + 0.5 * step * (v + after)
        v = after
        if not np.abs(q).max() < 100.0:
            position[:] = np.nan
            break
        row = (k + 1 + early) // per - 1
        if 0 <= row < samples and (k + 1 + early) % per == 0:
            read_sensors(p, q, held, filtered, state, memory, position[row], torque_out[row], joint_out[row])
    return position, torque_out, joint_out


def simulate(
    rig: Rig, plant: Plant, command: Array, rate: float, start: Array, settle: float = 0.0, step: float = STEP
) -> tuple[Array, Array, Array]:
    """Noise-free motor positions [rad], controller torques [N m] and joint positions [rad], each (samples, joints).

    The joints start at rest at `start` (joints) [rad], `settle` seconds before the first sample. Row k is what the
    sensors say at the end of the interval in which command k was in force.
    """
    select, shift = rig.selection()
    vectors = np.stack([getattr(plant, name) for name in at.VECTORS])
    matrices = np.stack([getattr(plant, name) for name in at.MATRICES])
    stated = np.array(rig.gravity)
    gravity = stated if rig.felt is None else np.array(rig.felt)
    return _run(rig.arrays(), gravity, stated, select, shift, vectors, matrices, command, start, rate, settle, step)
