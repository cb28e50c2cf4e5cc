"""Stepping the mechanism without contacts, as text for a kernel: single steps, rollouts, multiple shooting.

The names in capitals are offsets into the memory, see `memory_layout`; C chains, N dofs and n joints in each.
"""

FREE_STEP = '''

@inner
def free_step(command, memory):
    """One step of the mechanism without contacts: semi-implicit Euler, as Bullet."""
    dt = memory[DT]
    for c in range(C):
        x = signals_of(c, memory)
        q, v = memory[Q + c * n : Q + (c + 1) * n], memory[V + c * n : V + (c + 1) * n]
        expand(
            FOLLOW, memory[RATIO + c * N : RATIO + (c + 1) * N], memory[OFFSET + c * N : OFFSET + (c + 1) * N], q, v,
            memory[Q_ALL : Q_ALL + N], memory[V_ALL : V_ALL + N],
        )
        find_equations(c, memory[Q_ALL : Q_ALL + N], memory[V_ALL : V_ALL + N], memory)
        for j in range(n):
            x[POSITION, j] = q[j]
            x[VELOCITY, j] = v[j]
            x[CONTACT, j] = memory[EXTERNAL_TORQUE + c * n + j]
            x[LOAD, j] = memory[JOINT_BIAS + j] - x[CONTACT, j]
            x[TIME, j] = memory[STEP] * dt
            x[COMMAND, j] = command[c * n + j]
        effects_command(x, c, dt, memory)
        drive(x, c, dt, memory)
        next_speeds(x, c, dt, memory)
        for j in range(n):
            x[ACCELERATION, j] = memory[JOINT_ACCELERATION + j]
            v[j] = memory[SPEED + j]
            q[j] += dt * v[j]
    memory[STEP] += 1.0


@inner
def listen(command, memory):
    """A step before the start: only effects on the command remember it."""
    for c in range(C):
        x = signals_of(c, memory)
        for j in range(n):
            x[COMMAND, j] = command[c * n + j]
        effects_command(x, c, memory[DT], memory)


@inner
def row_of_steps(k, command, history, substeps, memory, rows, out):
    """The steps of command row k; its signals are read at one of them, the last one or memory[READING] if earlier."""
    reading = min(int(memory[READING]), substeps - 1)
    for s in range(substeps):
        if k < history:
            listen(command, memory)
            continue
        free_step(command, memory)
        if s == reading:
            for r in range(len(rows)):
                for a in range(C * n):
                    out[k - history, r, a] = memory[SIGNALS + (a // n * ROWS + rows[r]) * n + a % n]


@inner
def roll(commands, length, history, substeps, memory, rows, out):
    """Signals of each command row after the history."""
    for k in range(history + length):
        row_of_steps(k, commands[k], history, substeps, memory, rows, out)


@inner
def note_free(memory, free):
    """Marks the joints that their sensors do not show, within a gap of the transmission."""
    for a in range(C * n):
        if signals_of(a // n, memory)[GAP, a % n] == 2.0:
            free[a] = 1.0


@inner
def look_ahead(commands, memory, trial, free):
    """Notes free joints in the steps to come, if any joint has a gap at all."""
    gaps = 0.0
    for a in range(C * n):
        gaps += signals_of(a // n, memory)[GAP, a % n]
    if gaps > 0.0:
        trial[:] = memory
        for command in commands:
            free_step(command, trial)
            note_free(trial, free)


@inner
def start_segment(position, speed, free, trial, memory):
    """Puts the sensor to its measured position and the joints to their measured speed; effects keep their past.

    `trial` has made the coming step already, which says how far the sensor is from the joint. A joint that is `free` of
    its sensor around the start goes on as it was.
    """
    for a in range(C * n):
        column = a % n
        x = signals_of(a // n, trial)
        if free[a] == 0.0:
            memory[Q + a] = position[a] - (x[MOTOR_POSITION, column] - x[POSITION, column])
            memory[V + a] = speed[a]


@inner
def move(by, memory):
    """Moves all joints by so much, in position and in speed."""
    for a in range(C * n):
        memory[Q + a] += by[a]
        memory[V + a] += by[C * n + a]


@inner
def roll_segments(
    commands, length, history, substeps, segment, position, speed, beginning, nudge, memory, rows, out
):
    trial, free = memory.copy(), np.zeros(C * n)
    around = round(memory[UNSURE] / memory[DT])  # steps from which the measured speed is read
    for k in range(history + length):
        if k >= history and (k - history) % segment == 0:
            part = (k - history) // segment
            if part > 0:
                look_ahead(commands[k : k + around], memory, trial, free)
            for _ in range(4 if part == 0 else 1):  # the first start's torque is a guess at first
                trial[:] = memory
                free_step(commands[k], trial)
                start_segment(position[part], speed[part], free, trial, memory)
            if part == 0:
                move(beginning, memory)
            move(nudge, memory)
            free[:] = 0.0
        elif (k - history) % segment >= segment - around:
            note_free(memory, free)
        row_of_steps(k, commands[k], history, substeps, memory, rows, out)


@outer
def step(command, memory):
    free_step(command, borrowed(memory))


@outer
def rollout(commands, history, substeps, memory, rows, out):
    roll(commands, len(out), history, substeps, borrowed(memory), rows, out)


@outer
def rollout_batch(commands, which, lengths, history, substeps, memory, rows, out):
    for b in range(len(memory)):
        roll(commands[which[b]], lengths[which[b]], history, substeps, borrowed(memory[b]), rows, out[b])


@outer
def segments_batch(
    commands, which, lengths, history, substeps, segment, position, speed, beginning, nudge, memory, rows,
    first, last, out
):
    """Blocks first..last of a batch, started anew from `position`, `speed` (S, K, n) every `segment` rows."""
    for b in range(first, last):
        s = which[b]
        roll_segments(
            commands[s], lengths[s], history, substeps, segment, position[s], speed[s],
            beginning[s], nudge[b], borrowed(memory[b]), rows, out[b],
        )
'''
