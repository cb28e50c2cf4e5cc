"""What the simulation's time step does to fitted values: constants soak it up, and no residual shows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.fitting.gauss_newton import Fit, precision
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.measurement.replay.windows import Windows

Array = NDArray[np.float64]
FINER = 8  # times as short are the steps that show what the model's own ones do: 0.25 ms beside 2 ms
ENOUGH = 12  # windows that tell it, spread over the recording: up to 53 s of a finger


def step_shift(problem: Problem, fitted: Fit) -> Array:
    """How far the unknowns (P,) would move were the simulation's steps `FINER` times as short.

    To first order: the least-squares answer of the unknowns to what finer steps change in the prediction.
    """
    part = spread(problem.windows)
    own, fine = Problem(problem.shooting, part), Problem(problem.shooting.finer(FINER), finer(part, FINER))
    for one in (own, fine):
        one.linearise_starts(fitted.model)
    prediction, columns = own.columns(fitted.model, fitted.unknowns)
    moved = own.limited(fine.predictions([fitted.model])[0] - prediction) * own.weight
    freed = own.free(columns)
    information = np.einsum("grp,grq->pq", columns, freed, optimize=True) + np.diag(precision(fitted.unknowns))
    pull = np.einsum("grp,gr->p", freed, moved, optimize=True)
    scales = np.array([unknown.scale for unknown in fitted.unknowns])
    return np.asarray(-scales * np.linalg.solve(information, pull))


def spread(windows: Windows) -> Windows:
    """As many windows as tell what a time step does, spread over the recording."""
    return windows.take(np.unique(np.linspace(0, len(windows) - 1, ENOUGH).round().astype(np.int64)))


def finer(windows: Windows, times: int) -> Windows:
    """Windows for simulation steps so many times as short.

    The first step of a row takes the mean of two commands, all others the later one. Where a row is one step that is
    what the next row's jump begins with; of the past, which only wakes memories, the mean is kept.
    """
    count, _, joints = windows.commands.shape
    rows = windows.commands.reshape(count, -1, windows.substeps, joints)
    held = rows[:, :, -1:].copy()
    if windows.substeps == 1:
        held[:, windows.history : -1, 0] = (held[:, windows.history + 1 :, 0] - windows.jump[:, 1:]).copy()
        held[:, -1, 0] += windows.jump[:, -1]
    fine = windows.substeps * times
    commands = np.concatenate([rows[:, :, :1], np.repeat(held, fine - 1, axis=2)], axis=2)
    return replace(windows, commands=commands.reshape(count, -1, joints), substeps=fine)
