"""What the simulation's time step does to fitted values: constants soak it up, and no residual shows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.fitting.gauss_newton import Fit, covariance
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.stretches import Stretches

Array = NDArray[np.float64]
FINER = 8  # times as short are the steps that show what the model's own ones do: 0.25 ms beside 2 ms
TOGETHER = 12  # stretches that are simulated at once in finer steps, which bounds the memory they take


def step_shift(problem: Problem, fitted: Fit) -> Array:
    """How far the unknowns would move were the steps `FINER` times as short (P,), in units of their scales.

    One simulation in finer steps shows what they change; the shift is the Gauss-Newton step that follows it, with the
    derivatives of the fit.
    """
    shooting, stretches = problem.shooting.finer(FINER), problem.stretches
    turns = np.array_split(np.arange(len(stretches)), -(-len(stretches) // TOGETHER))
    parts = [shooting.positions([fitted.model], finer(stretches.take(turn), FINER))[0] for turn in turns]
    change = problem.residual(stretches.by_segment(np.concatenate(parts))) - fitted.residual
    gradient = np.einsum("grp,gr->p", fitted.columns, problem.free(change), optimize=True)
    return np.asarray(covariance(fitted) @ gradient)


def finer(stretches: Stretches, times: int) -> Stretches:
    """Stretches for simulation steps so many times as short.

    The first step of a row takes the mean of two commands, all others the later one. Where a row is one step the jump
    tells the later one; of the past, which only wakes memories, the mean is kept.
    """
    count, _, joints = stretches.commands.shape
    rows = stretches.commands.reshape(count, -1, stretches.substeps, joints)
    held = rows[:, :, -1:].copy()
    if stretches.substeps == 1:
        held[:, stretches.history :, 0] += stretches.jump if stretches.read_after else -stretches.jump
    fine = stretches.substeps * times
    commands = np.concatenate([rows[:, :, :1], np.repeat(held, fine - 1, axis=2)], axis=2)
    return replace(stretches, commands=commands.reshape(count, -1, joints), substeps=fine)
