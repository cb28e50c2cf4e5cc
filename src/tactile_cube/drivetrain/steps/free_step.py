"""Stepping the mechanism without contacts: single steps, rollouts, multiple shooting, and neighbours of a model.

A neighbour follows the path of another model: it has a drive, laws and dry friction of its own, and the equations of
motion of that path, linearised about it. These are what a step costs most, and they are found once for all neighbours.
"""

import numpy as np
import numpy.typing as npt

from tactile_cube.compiled import compiled, shaped_view
from tactile_cube.drivetrain import signals as sig
from tactile_cube.drivetrain.laws import expand

from . import plant
from .joint_step import block, drive, find_equations, next_speeds, signals_of
from .plant import C, N, n

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


PATH_WIDTH = C * (3 * n + 2 * n * n)
"""Numbers of a step, for each chain: position, bias, weight (n each); mass matrix without rotors, slope (n, n)."""
SLOPE_EVERY = 4  # steps; the slope of the equations of motion changes with the configuration, slowly
SLOPE_STEP = 1e-5  # [rad]


@compiled
def equations_at(c: int, q: Array, v: Array, memory: Array) -> None:
    """Return the equations of motion of chain c where its joints are."""
    q_all, v_all = block(memory, plant.Q_ALL, (N,)), block(memory, plant.V_ALL, (N,))
    ratio, offset = block(memory, plant.RATIO, (N,), c), block(memory, plant.OFFSET, (N,), c)
    expand(plant.FOLLOW, ratio, offset, q, v, q_all, v_all)
    find_equations(c, q_all, v_all, memory)


@compiled
def note_equations(c: int, x: Array, q: Array, here: Array, memory: Array) -> None:
    """Note position, bias, weight and mass matrix without rotors in a path's step."""
    for j in range(n):
        here[j], here[n + j], here[2 * n + j] = q[j], memory[plant.JOINT_BIAS + j], x[sig.WEIGHT, j]
        for k in range(n):
            rotor = memory[plant.REFLECTED_INERTIA + c * n + j] if j == k else 0.0
            here[3 * n + j * n + k] = memory[plant.JOINT_MASS_MATRIX + j * n + k] - rotor


@compiled
def note_slope(c: int, q: Array, v: Array, here: Array, memory: Array) -> None:
    """Note the slope of M a + h over the positions, at the accelerations of the step, in a path's step."""
    for k in range(n):
        there = q[k]
        q[k] = there + SLOPE_STEP
        equations_at(c, q, v, memory)
        q[k] = there
        for j in range(n):
            change = memory[plant.JOINT_BIAS + j] - here[n + j]
            for i in range(n):
                rotor = memory[plant.REFLECTED_INERTIA + c * n + j] if i == j else 0.0
                mass = memory[plant.JOINT_MASS_MATRIX + j * n + i] - rotor - here[3 * n + j * n + i]
                change += mass * memory[plant.JOINT_ACCELERATION + i]
            here[3 * n + n * n + j * n + k] = change / SLOPE_STEP


@compiled
def take_equations(c: int, x: Array, q: Array, here: Array, memory: Array) -> None:
    """Take the equations of motion of a path's step, linear in its positions, with this model's own rotors."""
    for j in range(n):
        load = here[n + j]
        for k in range(n):
            load += here[3 * n + n * n + j * n + k] * (q[k] - here[k])
            rotor = memory[plant.REFLECTED_INERTIA + c * n + j] if j == k else 0.0
            memory[plant.JOINT_MASS_MATRIX + j * n + k] = here[3 * n + j * n + k] + rotor
        memory[plant.JOINT_BIAS + j] = load
        x[sig.WEIGHT, j] = here[2 * n + j]


@compiled
def take_command(c: int, x: Array, command: Array) -> None:
    """Take the command (C n,) of a step, or (2 C n,) with what it is at the step's end."""
    for j in range(n):
        a = c * n + j
        x[sig.COMMAND, j] = command[a]
        x[sig.COMMAND_AFTER, j] = command[C * n + a] if len(command) > C * n else command[a]


@compiled
def free_step(command: Array, memory: Array, path: Array, row: int) -> None:
    """Advance the mechanism by a step without contacts, see `take_command`: semi-implicit Euler, as Bullet.

    A model that `follows` takes the equations of motion from step `row` of a path (steps PATH_WIDTH,), which another
    one has noted that went along it before; a path of less than a step is none.
    """
    dt, width = memory[plant.DT], PATH_WIDTH // C if len(path) >= PATH_WIDTH else 0
    follows = width > 0 and memory[plant.FOLLOWS] != 0.0
    for c in range(C):
        x = signals_of(c, memory)
        q, v = block(memory, plant.Q, (n,), c), block(memory, plant.V, (n,), c)
        here = shaped_view(path, (row * C + c) * width, (width,))
        if follows:
            take_equations(c, x, q, here, memory)
        else:
            equations_at(c, q, v, memory)
            if width > 0:
                note_equations(c, x, q, here, memory)
        for j in range(n):
            x[sig.POSITION, j] = q[j]
            x[sig.VELOCITY, j] = v[j]
            x[sig.CONTACT, j] = memory[plant.EXTERNAL_TORQUE + c * n + j]
            x[sig.LOAD, j] = memory[plant.JOINT_BIAS + j] - x[sig.CONTACT, j]
            x[sig.TIME, j] = memory[plant.STEP] * dt
        take_command(c, x, command)
        plant.effects_command(x, c, dt, memory)
        drive(x, c, dt, memory)
        next_speeds(x, c, dt, memory)
        if width > 0 and not follows:
            if row % SLOPE_EVERY == 0:
                note_slope(c, q, v, here, memory)
            else:
                last = shaped_view(path, ((row - 1) * C + c) * width, (width,))
                for k in range(n * n):
                    here[3 * n + n * n + k] = last[3 * n + n * n + k]
        for j in range(n):
            x[sig.ACCELERATION, j] = memory[plant.JOINT_ACCELERATION + j]
            v[j] = memory[plant.SPEED + j]
            q[j] += dt * v[j]
    memory[plant.STEP] += 1.0


@compiled
def advance_commands(command: Array, memory: Array) -> None:
    """Take a step before the start: only effects on the command have a state."""
    for c in range(C):
        x = signals_of(c, memory)
        take_command(c, x, command)
        plant.effects_command(x, c, memory[plant.DT], memory)


@compiled
def row_of_steps(
    k: int, command: Array, history: int, substeps: int, memory: Array, path: Array, rows: Integers, out: Array
) -> None:
    """Take the steps of row k; its signals are read at one of them, the last one or memory[READING] if earlier."""
    reading = min(int(memory[plant.READING]), substeps - 1)
    for s in range(substeps):
        if k < history:
            advance_commands(command, memory)
            continue
        free_step(command, memory, path, (k - history) * substeps + s)
        if s == reading:
            for r in range(len(rows)):
                for a in range(C * n):
                    out[k - history, r, a] = memory[plant.SIGNALS + (a // n * sig.ROWS + rows[r]) * n + a % n]


@compiled
def roll(commands: Array, length: int, history: int, substeps: int, memory: Array, rows: Integers, out: Array) -> None:
    """Write the signals of each command row after the history."""
    path = memory[:0]
    for k in range(history + length):
        row_of_steps(k, commands[k], history, substeps, memory, path, rows, out)


@compiled
def note_free(memory: Array, free: Array) -> None:
    """Mark the joints that their sensors do not show, within a gap of the transmission."""
    for a in range(C * n):
        if signals_of(a // n, memory)[sig.GAP, a % n] == 2.0:
            free[a] = 1.0


@compiled
def copy_into(trial: Array, memory: Array) -> None:
    """Copy by `trial[:] = memory`, whose general form takes the compiler seconds."""
    for k in range(len(memory)):
        trial[k] = memory[k]


@compiled
def look_ahead(
    commands: Array, history: int, first: int, last: int, memory: Array, path: Array, trial: Array, free: Array
) -> None:
    """Note free joints in the steps first..last of `commands` to come, if any joint has a gap at all."""
    gaps = 0.0
    for a in range(C * n):
        gaps += signals_of(a // n, memory)[sig.GAP, a % n]
    if gaps > 0.0:
        copy_into(trial, memory)
        for k in range(first, min(last, len(commands))):
            free_step(commands[k], trial, path, k - history)
            note_free(trial, free)


@compiled
def start_segment(position: Array, speed: Array, free: Array, trial: Array, memory: Array) -> None:
    """Put the sensor to its measured position and speed; effects keep their past.

    `trial` has made the coming step already, which says how far the sensor is from the joint and how fast it leaves it.
    A joint that is `free` of its sensor around the start goes on as it was.
    """
    for a in range(C * n):
        column = a % n
        x = signals_of(a // n, trial)
        if free[a] == 0.0:
            memory[plant.Q + a] = position[a] - (x[sig.MOTOR_POSITION, column] - x[sig.POSITION, column])
            memory[plant.V + a] = speed[a] - (x[sig.SENSOR_VELOCITY, column] - x[sig.VELOCITY, column])


@compiled
def move(by: Array, memory: Array) -> None:
    """Move all joints by so much, in position and in speed."""
    for a in range(C * n):
        memory[plant.Q + a] += by[a]
        memory[plant.V + a] += by[C * n + a]


@compiled
def start_first(
    command: Array,
    position: Array,
    speed: Array,
    initial_state: Array,
    free: Array,
    trial: Array,
    memory: Array,
    path: Array,
) -> None:
    """Set the first start of a window, moved by its `initial_state`; the torque there is a guess at first."""
    for _ in range(4):
        copy_into(trial, memory)
        free_step(command, trial, path, 0)
        start_segment(position, speed, free, trial, memory)
        for a in range(C * n):  # torques that are added after the closed form bend the drive from the start
            memory[plant.EXTRA + a] = trial[plant.EXTRA + a]
            memory[plant.EXTRA_COMPLIANCE + a] = trial[plant.EXTRA_COMPLIANCE + a]
    move(initial_state, memory)


@compiled
def roll_segments(
    commands: Array,
    length: int,
    history: int,
    substeps: int,
    segment: int,
    position: Array,
    speed: Array,
    initial_state: Array,
    correction: Array,
    memory: Array,
    path: Array,
    rows: Integers,
    out: Array,
) -> None:
    """Roll, started anew from the measured `position` and `speed` (K, C n) every `segment` rows.

    `initial_state` (2 C n,) moves the first start in position and speed, `correction` (2 C n,) every start. A `path`
    is noted, or followed, see `free_step`; its rows are single steps.
    """
    trial, free = memory.copy(), np.zeros(C * n)
    around = round(memory[plant.UNSURE] / memory[plant.DT])  # steps from which the measured speed is read
    for k in range(history + length):
        if k >= history and (k - history) % segment == 0:
            part = (k - history) // segment
            if part == 0:
                start_first(commands[k], position[0], speed[0], initial_state, free, trial, memory, path)
            else:
                look_ahead(commands, history, k, min(k + around, history + length), memory, path, trial, free)
                copy_into(trial, memory)
                free_step(commands[k], trial, path, k - history)
                start_segment(position[part], speed[part], free, trial, memory)
            move(correction, memory)
            for a in range(C * n):
                free[a] = 0.0
        elif (k - history) % segment >= segment - around:
            note_free(memory, free)
        row_of_steps(k, commands[k], history, substeps, memory, path, rows, out)
