"""What every step of a chain computes: equations, drive, speeds under dry friction."""

import numpy as np
import numpy.typing as npt

from tactile_cube.compiled import compiled, shaped_view
from tactile_cube.drivetrain import signals as sig
from tactile_cube.drivetrain.laws import impedance_torque, reduce_equations, solve_speeds
from tactile_cube.hand.rigid_body_equations import WORK_COLUMNS, mass_matrix_and_bias, pull_of_gravity

from . import plant
from .plant import N, n

Array = npt.NDArray[np.float64]


@compiled
def block(memory: Array, offset: int, shape: tuple[int, ...], c: int = 0) -> Array:
    """Return chain c's part of what lies at an offset, as an array of this shape."""
    size = 1
    for length in shape:
        size *= length
    return shaped_view(memory, offset + c * size, shape)


@compiled
def signals_of(c: int, memory: Array) -> Array:
    """Return the signals x (ROWS, n) of chain c."""
    return block(memory, plant.SIGNALS, (sig.ROWS, n), c)


@compiled
def find_equations(c: int, q: Array, v: Array, memory: Array) -> None:
    """Fill in M, h of all dofs of chain c, their actuated-joint form, and the joints' part of h that is weight."""
    M, h = block(memory, plant.MASS_MATRIX, (N, N)), block(memory, plant.BIAS, (N,))
    mass, gravity = block(memory, plant.MASS, (N,), c), block(memory, plant.GRAVITY, (3,), c)
    work = block(memory, plant.WORK, (N + 1, WORK_COLUMNS))
    mass_matrix_and_bias(
        plant.PARENT,
        plant.PRISMATIC,
        block(memory, plant.PLACEMENT_ROTATION, (N, 3, 3), c),
        block(memory, plant.PLACEMENT_TRANSLATION, (N, 3), c),
        block(memory, plant.AXIS, (N, 3), c),
        mass,
        block(memory, plant.COM, (N, 3), c),
        block(memory, plant.INERTIA, (N, 3, 3), c),
        q,
        v,
        gravity,
        work,
        M,
        h,
    )
    M_joint, h_joint = block(memory, plant.JOINT_MASS_MATRIX, (n, n)), block(memory, plant.JOINT_BIAS, (n,))
    ratio, rotor = block(memory, plant.RATIO, (N,), c), block(memory, plant.REFLECTED_INERTIA, (n,), c)
    reduce_equations(plant.FOLLOW, ratio, M, h, rotor, M_joint, h_joint)
    if memory[plant.NEEDS_WEIGHT] != 0.0:
        x, weight = signals_of(c, memory), block(memory, plant.WEIGHT, (N,))
        x[sig.WEIGHT, :] = 0.0
        weight[:] = 0.0
        pull_of_gravity(plant.PARENT, plant.PRISMATIC, mass, (-gravity[0], -gravity[1], -gravity[2]), work, weight)
        for k in range(N):
            x[sig.WEIGHT, plant.FOLLOW[k]] += ratio[k] * weight[k]


@compiled
def drive(x: Array, c: int, dt: float, memory: Array) -> None:
    """Turn a command into motor torque, q_m and the further torques on the joint."""
    read_sensors(x, c, dt, memory)
    control_torque(x, c, dt, memory)
    for j in range(n):
        memory[plant.TRIAL + j] = x[sig.DAMPING, j]
    plant.effects_motor_torque(x, c, dt, memory)
    for j in range(n):
        asked = memory[plant.TRIAL + j]
        memory[plant.HELD_BACK + c * n + j] = 1.0 - x[sig.DAMPING, j] / asked if asked > 0.0 else 0.0
    for j in range(n):
        x[sig.DEFLECTION, j] = memory[plant.COMPLIANCE + c * n + j] * x[sig.TORQUE, j]
    plant.effects_deflection(x, c, dt, memory)
    for j in range(n):
        x[sig.MOTOR_POSITION, j] = x[sig.POSITION, j] + x[sig.DEFLECTION, j]
    plant.effects_position_sensor(x, c, dt, memory)
    note_extra_deflection(x, c, memory)
    for j in range(n):
        x[sig.JOINT_TORQUE, j] = 0.0
    plant.effects_joint_torque(x, c, dt, memory)


@compiled
def read_sensors(x: Array, c: int, dt: float, memory: Array) -> None:
    """Read the measured speed, and the part of q_m that needs no torque to be known."""
    for j in range(n):
        x[sig.MEASURED_VELOCITY, j] = x[sig.VELOCITY, j]
        x[sig.SENSOR_VELOCITY, j] = x[sig.VELOCITY, j]
        x[sig.DAMPING, j] = 1.0
        x[sig.MOTOR_SHARE, j] = 0.0
        x[sig.INERTIA, j] = memory[plant.JOINT_MASS_MATRIX + j * n + j]
        x[sig.MOTOR_POSITION, j] = x[sig.POSITION, j]
        x[sig.ANGLE, j] = x[sig.POSITION, j] + memory[plant.ANGLE_OFFSET + c * n + j]
    plant.effects_velocity_sensor(x, c, dt, memory)
    for j in range(n):
        a = c * n + j
        kp, compliance = memory[plant.KP + a], memory[plant.COMPLIANCE + a] + memory[plant.EXTRA_COMPLIANCE + a]
        damped = memory[plant.KD + a] * x[sig.MEASURED_VELOCITY, j] / kp
        x[sig.LEAD, j] = x[sig.COMMAND, j] - x[sig.POSITION, j] - damped
        asked = kp * (x[sig.COMMAND, j] - x[sig.POSITION, j] - memory[plant.EXTRA + a])
        asked = (asked - memory[plant.KD + a] * x[sig.MEASURED_VELOCITY, j]) / (1.0 + kp * compliance)
        passed = 1.0 - memory[plant.HELD_BACK + a]  # by the laws of the motor's torque
        x[sig.LOOP_GAIN, j] = passed * kp / (1.0 + kp * compliance)
        x[sig.LOOSE_TORQUE, j] = x[sig.TORQUE, j] + passed * (asked - x[sig.CONTROLLER_TORQUE, j])
        x[sig.GAP, j] = 0.0
    plant.effects_position_sensor_ahead(x, c, dt, memory)


@compiled
def control_torque(x: Array, c: int, dt: float, memory: Array) -> None:
    """Return the controller's torque within its limit, and its slope against the present speed."""
    for j in range(n):
        a = c * n + j
        kp, kd = memory[plant.KP + a], memory[plant.KD + a]
        compliance = memory[plant.COMPLIANCE + a] + memory[plant.EXTRA_COMPLIANCE + a]
        ahead = (
            x[sig.MOTOR_POSITION, j] - x[sig.POSITION, j]
        )  # of sensor laws that need no torque: known now, not a step late
        extra = memory[plant.EXTRA + a] + ahead
        torque = impedance_torque(
            x[sig.COMMAND, j], x[sig.POSITION, j], x[sig.MEASURED_VELOCITY, j], kp, kd, compliance, extra
        )
        memory[plant.EXTRA + a] = -ahead
        memory[plant.TRIAL + j] = torque
        x[sig.CONTROLLER_TORQUE, j] = torque
        x[sig.TORQUE, j] = min(max(torque, -memory[plant.TORQUE_LIMIT + a]), memory[plant.TORQUE_LIMIT + a])
        x[sig.DAMPING, j] = x[sig.DAMPING, j] * kd / (1.0 + kp * compliance)
    plant.effects_controller(x, c, dt, memory)
    for j in range(n):
        limit, asked, own = memory[plant.TORQUE_LIMIT + c * n + j], x[sig.CONTROLLER_TORQUE, j], memory[plant.TRIAL + j]
        x[sig.TORQUE, j] = min(max(asked, -limit), limit)
        x[sig.CONTROLLER_TORQUE, j] = own if x[sig.TORQUE, j] == asked else x[sig.TORQUE, j] - (asked - own)
        if abs(x[sig.TORQUE, j]) >= limit:
            x[sig.DAMPING, j] = 0.0


@compiled
def note_extra_deflection(x: Array, c: int, memory: Array) -> None:
    """Note what the closed form of the next torque does not know: zero without effects that deflect.

    The slope of a further deflection, which would not converge if it was taken for a constant, and the rest.
    """
    for j in range(n):
        compliance = memory[plant.COMPLIANCE + c * n + j]
        more = x[sig.DEFLECTION, j] - compliance * x[sig.TORQUE, j]
        slope = max(more / x[sig.TORQUE, j], 0.0) if abs(x[sig.TORQUE, j]) > 1e-9 else 0.0
        memory[plant.EXTRA_COMPLIANCE + c * n + j] = slope
        memory[plant.EXTRA + c * n + j] += (
            (x[sig.MOTOR_POSITION, j] - (x[sig.POSITION, j] + x[sig.DEFLECTION, j]))
            + (more - slope * x[sig.TORQUE, j])
            + (compliance + slope) * (x[sig.TORQUE, j] - x[sig.CONTROLLER_TORQUE, j])
        )


@compiled
def next_speeds(x: Array, c: int, dt: float, memory: Array) -> None:
    """Set the speeds of chain c after the step, under dry friction, in memory[SPEED], and its accelerations."""
    for j in range(n):
        net = x[sig.TORQUE, j] + x[sig.JOINT_TORQUE, j] - x[sig.LOAD, j]
        x[sig.DIRECTION, j] = np.sign(x[sig.VELOCITY, j]) if x[sig.VELOCITY, j] != 0.0 else np.sign(net)
        x[sig.FRICTION, j] = memory[plant.STATIC_FRICTION + c * n + j]
        memory[plant.SPEED + j] = x[sig.VELOCITY, j]
    plant.effects_friction(x, c, dt, memory)  # may also add to JOINT_TORQUE: bristles in place of dry friction
    M = block(memory, plant.JOINT_MASS_MATRIX, (n, n))
    # damping acts on the mean of the speeds before and after the step, second order in dt: an explicit K_D dq would act
    # half a step late, which fitting to a measurement takes for a delay
    for j in range(n):
        M[j, j] += 0.5 * dt * x[sig.DAMPING, j]
    for j in range(n):
        memory[plant.MOMENTUM + j] = dt * (x[sig.TORQUE, j] + x[sig.JOINT_TORQUE, j] - x[sig.LOAD, j])
        for k in range(n):
            memory[plant.MOMENTUM + j] += M[j, k] * x[sig.VELOCITY, k]
        memory[plant.FRICTION_IMPULSE + j] = dt * (
            max(x[sig.FRICTION, j], 0.0) * (1.0 - x[sig.MOTOR_SHARE, j]) + memory[plant.BRAKE + c * n + j]
        )
        creep = memory[plant.FRICTION_CREEP + c * n + j]
        memory[plant.GRIP + j] = dt / creep if creep > 0.0 else 0.0
    solve_speeds(
        M,
        block(memory, plant.MOMENTUM, (n,)),
        block(memory, plant.FRICTION_IMPULSE, (n,)),
        block(memory, plant.GRIP, (n,)),
        block(memory, plant.SPEED, (n,)),
        block(memory, plant.SIDE, (n,)),
        block(memory, plant.FACTOR, (n, n)),
        block(memory, plant.TRIAL, (n,)),
    )
    for j in range(n):
        memory[plant.JOINT_ACCELERATION + j] = (memory[plant.SPEED + j] - x[sig.VELOCITY, j]) / dt
