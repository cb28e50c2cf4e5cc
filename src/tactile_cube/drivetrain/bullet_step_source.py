"""Torques for a physics engine's links, as text for a kernel: target filter, contact estimate, inverse dynamics.

The names in capitals are offsets into the memory, see `memory_layout`; C chains, N dofs and n joints in each.
"""

BULLET_STEP = '''
@inner
def shape_target(x, c, dt, memory):
    """q_n -> low-pass -> rate limit -> torque limit -> q_d."""
    for j in range(n):
        a = c * n + j
        memory[FILTERED + a] = low_pass(memory[FILTERED + a], memory[GOAL + a], memory[TIME_CONSTANT], dt)
        memory[LIMITED + a] = limit_rate(memory[LIMITED + a], memory[FILTERED + a], memory[RATE_LIMIT + a], dt)
        x[COMMAND, j] = limit_torque(
            memory[LIMITED + a], x[MOTOR_POSITION, j], x[VELOCITY, j],
            memory[KP + a], memory[KD + a], memory[COMMAND_TORQUE_LIMIT + a],
        )


@inner
def sense_contact(x, c, v, dt, memory):
    """CONTACT and ACCELERATION from the speeds (N,) that the last step's torques led to."""
    if memory[SEEN] == 0.0:
        memory[CONTACT_TORQUE + c * n : CONTACT_TORQUE + (c + 1) * n] = 0.0
    else:
        for k in range(N):
            memory[V_ALL + k] = (v[k] - memory[LAST_SPEED + c * N + k]) / dt
        estimate_contact(
            FOLLOW, memory[RATIO + c * N : RATIO + (c + 1) * N],
            shaped(memory, LAST_MASS_MATRIX + c * N * N, N, N), memory[LAST_BIAS + c * N : LAST_BIAS + (c + 1) * N],
            memory[LAST_TORQUE + c * N : LAST_TORQUE + (c + 1) * N], memory[V_ALL : V_ALL + N],
            memory[CONTACT_TORQUE_LIMIT], memory[CONTACT_TORQUE + c * n : CONTACT_TORQUE + (c + 1) * n],
        )
        for j in range(n):
            x[ACCELERATION, j] = memory[V_ALL + LEADER[j]]
    for j in range(n):
        x[CONTACT, j] = memory[CONTACT_TORQUE + c * n + j] + memory[EXTERNAL_TORQUE + c * n + j]


@inner
def torques_for_engine(c, q, v, torque, memory):
    """Torques (N,) that give the engine's links the accelerations of the exact model, and what the next step needs.

    The engine's links have spin inertia (PyBullet, in place of rotors) or armature (MuJoCo, native rotors), or neither.
    """
    M, h = shaped(memory, MASS_MATRIX, N, N), memory[BIAS : BIAS + N]
    ratio = memory[RATIO + c * N : RATIO + (c + 1) * N]
    add_spin_inertia(
        PARENT, PRISMATIC, memory[SPIN_INERTIA + c * N : SPIN_INERTIA + (c + 1) * N],
        shaped(memory, WORK, N + 1, WORK_COLUMNS), M, h,
    )
    for k in range(N):
        M[k, k] += memory[ARMATURE + c * N + k]
    add_weight(
        PARENT, PRISMATIC, memory[MASS + c * N : MASS + (c + 1) * N], memory[GRAVITY + 3 * c : GRAVITY + 3 * c + 3],
        memory[ENGINE_GRAVITY + 3 * c : ENGINE_GRAVITY + 3 * c + 3], shaped(memory, WORK, N + 1, WORK_COLUMNS), h,
    )
    link_torques(
        FOLLOW, LEADER, ratio, M, h, memory[JOINT_ACCELERATION : JOINT_ACCELERATION + n],
        memory[CONTACT_TORQUE + c * n : CONTACT_TORQUE + (c + 1) * n], torque,
    )
    add_tendons(
        FOLLOW, LEADER, ratio, memory[OFFSET + c * N : OFFSET + (c + 1) * N], q, v,
        memory[TENDON_STIFFNESS], memory[TENDON_DAMPING], torque,
    )
    for k in range(N):
        memory[LAST_SPEED + c * N + k] = v[k]
        memory[LAST_TORQUE + c * N + k] = torque[k]
        memory[LAST_BIAS + c * N + k] = h[k]
    for k in range(N * N):
        memory[LAST_MASS_MATRIX + c * N * N + k] = memory[MASS_MATRIX + k]


@inner
def control(i, q, v, torque, memory):
    """Torques (C N,) for the engine from the positions and speeds (C N,) of all its joints; row i of the trace."""
    dt = memory[DT]
    for c in range(C):
        x = signals_of(c, memory)
        q_c, v_c = q[c * N : (c + 1) * N], v[c * N : (c + 1) * N]
        sense_contact(x, c, v_c, dt, memory)
        find_equations(c, q_c, v_c, memory)
        for j in range(n):
            x[POSITION, j] = q_c[LEADER[j]]
            x[VELOCITY, j] = v_c[LEADER[j]]
            memory[Q + c * n + j] = x[POSITION, j]
            memory[V + c * n + j] = x[VELOCITY, j]
            x[LOAD, j] = memory[JOINT_BIAS + j] - x[CONTACT, j]
            x[TIME, j] = memory[STEP] * dt
        shape_target(x, c, dt, memory)
        effects_command(x, c, dt, memory)
        drive(x, c, dt, memory)
        next_speeds(x, c, dt, memory)
        torques_for_engine(c, q_c, v_c, torque[c * N : (c + 1) * N], memory)
    memory[SEEN] = 1.0
    memory[STEP] += 1.0
    if i < memory[TRACE_ROWS]:
        start = int(memory[TRACE_OFFSET]) + i * C * ROWS * n
        memory[start : start + C * ROWS * n] = memory[SIGNALS : SIGNALS + C * ROWS * n]


@outer
def control_step(i, q, v, torque, memory):
    control(i, borrowed(q), borrowed(v), borrowed(torque), borrowed(memory))


def control_callback():
    """The control step as a C function: void(int64 i, double *q, double *v, double *torque, double *memory)."""
    pointer = types.CPointer(types.float64)

    @cfunc(types.void(types.int64, pointer, pointer, pointer, pointer), error_model="numpy", cache=True)
    def callback(i, q, v, torque, memory):
        size = int(carray(memory, (1,))[0])
        control(i, carray(q, (C * N,)), carray(v, (C * N,)), carray(torque, (C * N,)), carray(memory, (size,)))

    return callback
'''
