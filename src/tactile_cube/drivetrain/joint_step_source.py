"""What every step of a chain computes, as text for a kernel: equations, drive, speeds under dry friction.

The names in capitals are offsets into the memory, see `memory_layout`; C chains, N dofs and n joints in each.
"""

JOINT_STEP = '''
@inner
def shaped(memory, offset, rows, columns):
    return shaped_view(memory, offset, (rows, columns))


@inner
def signals_of(c, memory):
    return shaped(memory, SIGNALS + c * ROWS * n, ROWS, n)


@inner
def find_equations(c, q, v, memory):
    """Fills M, h of all dofs of chain c and their actuated-joint form."""
    mass_matrix_and_bias(
        PARENT, PRISMATIC,
        shaped_view(memory, PLACEMENT_ROTATION + 9 * c * N, (N, 3, 3)),
        shaped(memory, PLACEMENT_TRANSLATION + 3 * c * N, N, 3),
        shaped(memory, LINK_AXIS + 3 * c * N, N, 3),
        memory[MASS + c * N : MASS + (c + 1) * N],
        shaped(memory, COM + 3 * c * N, N, 3),
        shaped_view(memory, INERTIA + 9 * c * N, (N, 3, 3)),
        q, v, memory[GRAVITY + 3 * c : GRAVITY + 3 * c + 3],
        shaped(memory, WORK, N + 1, WORK_COLUMNS), shaped(memory, MASS_MATRIX, N, N), memory[BIAS : BIAS + N],
    )
    reduce_equations(
        FOLLOW, memory[RATIO + c * N : RATIO + (c + 1) * N],
        shaped(memory, MASS_MATRIX, N, N), memory[BIAS : BIAS + N],
        memory[REFLECTED_INERTIA + c * n : REFLECTED_INERTIA + (c + 1) * n],
        shaped(memory, JOINT_MASS_MATRIX, n, n), memory[JOINT_BIAS : JOINT_BIAS + n],
    )


@inner
def drive(x, c, dt, memory):
    """Command to motor torque, q_m and the further torques on the joint."""
    for j in range(n):
        x[MEASURED_VELOCITY, j] = x[VELOCITY, j]
        x[DAMPING, j] = 1.0
        x[MOTOR_POSITION, j] = x[POSITION, j]
        x[ANGLE, j] = x[POSITION, j] + memory[ANGLE_OFFSET + c * n + j]
    effects_velocity_sensor(x, c, dt, memory)
    for j in range(n):
        damped = memory[KD + c * n + j] * x[MEASURED_VELOCITY, j] / memory[KP + c * n + j]
        x[LEAD, j] = x[COMMAND, j] - x[POSITION, j] - damped
        x[GAP, j] = 0.0
    effects_position_sensor_ahead(x, c, dt, memory)
    for j in range(n):
        a = c * n + j
        ahead = x[MOTOR_POSITION, j] - x[POSITION, j]  # of sensor laws that need no torque: known now, not a step late
        x[CONTROLLER_TORQUE, j] = impedance_torque(
            x[COMMAND, j], x[POSITION, j], x[MEASURED_VELOCITY, j],
            memory[KP + a], memory[KD + a], memory[COMPLIANCE + a] + memory[EXTRA_COMPLIANCE + a],
            memory[EXTRA + a] + ahead, memory[TORQUE_LIMIT + a],
        )
        memory[EXTRA + a] = -ahead
        x[TORQUE, j] = x[CONTROLLER_TORQUE, j]
        soft = memory[KP + a] * (memory[COMPLIANCE + a] + memory[EXTRA_COMPLIANCE + a])
        limited = abs(x[CONTROLLER_TORQUE, j]) >= memory[TORQUE_LIMIT + a]
        x[DAMPING, j] = 0.0 if limited else x[DAMPING, j] * memory[KD + a] / (1.0 + soft)
    effects_motor_torque(x, c, dt, memory)
    for j in range(n):
        x[DEFLECTION, j] = memory[COMPLIANCE + c * n + j] * x[TORQUE, j]
    effects_deflection(x, c, dt, memory)
    for j in range(n):
        x[MOTOR_POSITION, j] = x[POSITION, j] + x[DEFLECTION, j]
    effects_position_sensor(x, c, dt, memory)
    for j in range(n):
        compliance = memory[COMPLIANCE + c * n + j]
        # what the closed form does not know, exactly zero without such effects: the slope of a further deflection,
        # which would not converge if it was taken for a constant, and the rest
        more = x[DEFLECTION, j] - compliance * x[TORQUE, j]
        slope = max(more / x[TORQUE, j], 0.0) if abs(x[TORQUE, j]) > 1e-9 else 0.0
        memory[EXTRA_COMPLIANCE + c * n + j] = slope
        memory[EXTRA + c * n + j] += (
            (x[MOTOR_POSITION, j] - (x[POSITION, j] + x[DEFLECTION, j]))
            + (more - slope * x[TORQUE, j])
            + (compliance + slope) * (x[TORQUE, j] - x[CONTROLLER_TORQUE, j])
        )
        x[JOINT_TORQUE, j] = 0.0
    effects_joint_torque(x, c, dt, memory)


@inner
def add_midpoint_damping(x, c, dt, memory):
    """Damping acts on the mean of the speeds before and after the step: second order in dt.

    An explicit K_D dq would act half a step late, which fitting to a measurement takes for a delay.
    """
    for j in range(n):
        memory[JOINT_MASS_MATRIX + j * n + j] += 0.5 * dt * x[DAMPING, j]


@inner
def next_speeds(x, c, dt, memory):
    """Speeds of chain c after the step, under dry friction, in memory[SPEED]; its accelerations beside them."""
    for j in range(n):
        a = c * n + j
        net = x[TORQUE, j] + x[JOINT_TORQUE, j] - x[LOAD, j]
        x[DIRECTION, j] = np.sign(x[VELOCITY, j]) if x[VELOCITY, j] != 0.0 else np.sign(net)
        x[FRICTION, j] = memory[STATIC_FRICTION + a]
        memory[SPEED + j] = x[VELOCITY, j]
    effects_friction(x, c, dt, memory)  # may also add to JOINT_TORQUE: bristles in place of dry friction
    add_midpoint_damping(x, c, dt, memory)
    for j in range(n):
        memory[MOMENTUM + j] = dt * (x[TORQUE, j] + x[JOINT_TORQUE, j] - x[LOAD, j])
        for k in range(n):
            memory[MOMENTUM + j] += memory[JOINT_MASS_MATRIX + j * n + k] * x[VELOCITY, k]
        memory[FRICTION_IMPULSE + j] = dt * (max(x[FRICTION, j], 0.0) + memory[BRAKE + c * n + j])
        creep = memory[FRICTION_CREEP + c * n + j]
        memory[GRIP + j] = dt / creep if creep > 0.0 else 0.0
    solve_speeds(
        shaped(memory, JOINT_MASS_MATRIX, n, n), memory[MOMENTUM : MOMENTUM + n],
        memory[FRICTION_IMPULSE : FRICTION_IMPULSE + n], memory[GRIP : GRIP + n], memory[SPEED : SPEED + n],
        memory[SIDE : SIDE + n], shaped(memory, FACTOR, n, n), memory[TRIAL : TRIAL + n],
    )
    for j in range(n):
        memory[JOINT_ACCELERATION + j] = (memory[SPEED + j] - x[VELOCITY, j]) / dt
'''
