"""The compiled steps of a plant of C chains with N dofs and n joints each, D = C N.

Numba keeps machine code beside the file that a function stands in, and plants differ in their code: this file is copied
into each kernel's folder, the other steps are loaded from where they are.
"""

import numpy as np
import numpy.typing as npt

from tactile_cube.compiled import borrowed, compiled_once

from .engine_step import control
from .free_step import PATH_WIDTH as PATH_WIDTH
from .free_step import free_step, roll, roll_segments

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


@compiled_once
def control_step(i: int, q: Array, v: Array, torque: Array, memory: Array) -> None:
    """Return torques (D,) for an engine's joints at q, v (D,); row i of the trace."""
    control(i, borrowed(q), borrowed(v), borrowed(torque), borrowed(memory))


@compiled_once
def step(command: Array, memory: Array) -> None:
    """Advance the mechanism by a step without contacts, for a command (C n,)."""
    own = borrowed(memory)
    free_step(command, own, own[:0], 0)


@compiled_once
def rollout(commands: Array, history: int, substeps: int, memory: Array, rows: Integers, out: Array) -> None:
    """Write signals `rows` (R,) of each row of commands (H + T, C n) after the history into `out` (T, R, C n)."""
    roll(commands, len(out), history, substeps, borrowed(memory), rows, out)


@compiled_once
def segments_batch(
    commands: Array,
    which: Integers,
    lengths: Integers,
    history: int,
    substeps: int,
    segment: int,
    position: Array,
    speed: Array,
    initial_state: Array,
    correction: Array,
    memory: Array,
    paths: Array,
    rows: Integers,
    first: int,
    last: int,
    out: Array,
) -> None:
    """Simulate by multiple shooting: blocks first..last of memory (B, size) into `out` (B, T, R, C n).

    Block b plays commands[which[b]], (H + T, C n) each, and starts anew every `segment` rows from the measured
    `position` and `speed` (S, K, C n). `paths` (S, T PATH_WIDTH) are noted, or followed by blocks that say so; (S, 1)
    for neither.
    """
    for b in range(first, last):
        s = which[b]
        roll_segments(
            commands[s],
            lengths[s],
            history,
            substeps,
            segment,
            position[s],
            speed[s],
            initial_state[s],
            correction[b],
            borrowed(memory[b]),
            borrowed(paths[s]),
            rows,
            out[b],
        )
