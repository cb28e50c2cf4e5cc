"""Torques for a physics engine's links: target filter, contact estimate, inverse dynamics."""

import numpy as np
import numpy.typing as npt

from tactile_cube.compiled import compiled
from tactile_cube.drivetrain import signals as sig
from tactile_cube.drivetrain.laws import add_tendons, estimate_contact, limit_rate, limit_torque, link_torques, low_pass
from tactile_cube.hand.rigid_body_equations import WORK_COLUMNS, add_spin_inertia, add_weight

from . import plant
from .joint_step import block, drive, find_equations, next_speeds, signals_of
from .plant import C, N, n

Array = npt.NDArray[np.float64]


@compiled
def shape_target(x: Array, c: int, dt: float, memory: Array) -> None:
    """Pass q_n through low-pass, rate limit and torque limit to q_d."""
    for j in range(n):
        a = c * n + j
        filtered = low_pass(memory[plant.FILTERED + a], memory[plant.GOAL + a], memory[plant.TIME_CONSTANT], dt)
        limited = limit_rate(memory[plant.LIMITED + a], filtered, memory[plant.RATE_LIMIT + a], dt)
        memory[plant.FILTERED + a] = filtered
        memory[plant.LIMITED + a] = limited
        kp, kd, limit = memory[plant.KP + a], memory[plant.KD + a], memory[plant.COMMAND_TORQUE_LIMIT + a]
        x[sig.COMMAND, j] = limit_torque(limited, x[sig.MOTOR_POSITION, j], x[sig.VELOCITY, j], kp, kd, limit)
        x[sig.COMMAND_AFTER, j] = x[sig.COMMAND, j]


@compiled
def sense_contact(x: Array, c: int, v: Array, dt: float, memory: Array) -> None:
    """Set CONTACT and ACCELERATION from the speeds (N,) that the last step's torques led to."""
    contact = block(memory, plant.CONTACT, (n,), c)
    if memory[plant.SEEN] == 0.0:
        contact[:] = 0.0
    else:
        acceleration = block(memory, plant.V_ALL, (N,))
        for k in range(N):
            acceleration[k] = (v[k] - memory[plant.LAST_SPEED + c * N + k]) / dt
        estimate_contact(
            plant.FOLLOW,
            block(memory, plant.RATIO, (N,), c),
            block(memory, plant.LAST_MASS_MATRIX, (N, N), c),
            block(memory, plant.LAST_BIAS, (N,), c),
            block(memory, plant.LAST_TORQUE, (N,), c),
            acceleration,
            memory[plant.CONTACT_TORQUE_LIMIT],
            contact,
        )
        for j in range(n):
            x[sig.ACCELERATION, j] = acceleration[plant.LEADER[j]]
    for j in range(n):
        x[sig.CONTACT, j] = contact[j] + memory[plant.EXTERNAL_TORQUE + c * n + j]


@compiled
def torques_for_engine(c: int, q: Array, v: Array, torque: Array, memory: Array) -> None:
    """Return torques (N,) that give the engine's links the exact model's accelerations; keep what is needed next.

    The engine's links have spin inertia (PyBullet, in place of rotors) or armature (MuJoCo, native rotors), or neither.
    """
    M, h = block(memory, plant.MASS_MATRIX, (N, N)), block(memory, plant.BIAS, (N,))
    work = block(memory, plant.WORK, (N + 1, WORK_COLUMNS))
    ratio, offset = block(memory, plant.RATIO, (N,), c), block(memory, plant.OFFSET, (N,), c)
    add_spin_inertia(plant.PARENT, plant.PRISMATIC, block(memory, plant.SPIN_INERTIA, (N,), c), work, M, h)
    for k in range(N):
        M[k, k] += memory[plant.ARMATURE + c * N + k]
    mass = block(memory, plant.MASS, (N,), c)
    own, engine = block(memory, plant.GRAVITY, (3,), c), block(memory, plant.ENGINE_GRAVITY, (3,), c)
    add_weight(plant.PARENT, plant.PRISMATIC, mass, own, engine, work, h)
    acceleration, contact = block(memory, plant.JOINT_ACCELERATION, (n,)), block(memory, plant.CONTACT, (n,), c)
    link_torques(plant.FOLLOW, plant.LEADER, ratio, M, h, acceleration, contact, torque)
    stiffness, damping = memory[plant.TENDON_STIFFNESS], memory[plant.TENDON_DAMPING]
    add_tendons(plant.FOLLOW, plant.LEADER, ratio, offset, q, v, stiffness, damping, torque)
    for k in range(N):
        memory[plant.LAST_SPEED + c * N + k] = v[k]
        memory[plant.LAST_TORQUE + c * N + k] = torque[k]
        memory[plant.LAST_BIAS + c * N + k] = h[k]
    for k in range(N * N):
        memory[plant.LAST_MASS_MATRIX + c * N * N + k] = memory[plant.MASS_MATRIX + k]


@compiled
def control(i: int, q: Array, v: Array, torque: Array, memory: Array) -> None:
    """Return torques (C N,) for the engine from positions and speeds (C N,) of all its joints; row i of the trace."""
    dt = memory[plant.DT]
    for c in range(C):
        x = signals_of(c, memory)
        q_c, v_c = q[c * N : (c + 1) * N], v[c * N : (c + 1) * N]
        sense_contact(x, c, v_c, dt, memory)
        find_equations(c, q_c, v_c, memory)
        for j in range(n):
            x[sig.POSITION, j] = q_c[plant.LEADER[j]]
            x[sig.VELOCITY, j] = v_c[plant.LEADER[j]]
            memory[plant.Q + c * n + j] = x[sig.POSITION, j]
            memory[plant.V + c * n + j] = x[sig.VELOCITY, j]
            x[sig.LOAD, j] = memory[plant.JOINT_BIAS + j] - x[sig.CONTACT, j]
            x[sig.TIME, j] = memory[plant.STEP] * dt
        shape_target(x, c, dt, memory)
        plant.effects_command(x, c, dt, memory)
        drive(x, c, dt, memory)
        next_speeds(x, c, dt, memory)
        torques_for_engine(c, q_c, v_c, torque[c * N : (c + 1) * N], memory)
    memory[plant.SEEN] = 1.0
    memory[plant.STEP] += 1.0
    if i < memory[plant.TRACE_ROWS]:
        start = int(memory[plant.TRACE_OFFSET]) + i * C * sig.ROWS * n
        memory[start : start + C * sig.ROWS * n] = memory[plant.SIGNALS : plant.SIGNALS + C * sig.ROWS * n]
