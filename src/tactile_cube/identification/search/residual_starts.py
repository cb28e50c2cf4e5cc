"""Candidates whose starts have to be read from what is missing: harmonics and profiles over the position."""

from __future__ import annotations

from collections.abc import Sequence

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.periodicity import periodic_candidates
from tactile_cube.identification.search.position_profile import profile_candidates
from tactile_cube.identification.search.residual_shape import missing_torques
from tactile_cube.measurement.recordings.recording import Recording


def residual_candidates(
    problem: Problem, recording: Recording, fitted: Fit, effects: Sequence[type[Effect]]
) -> list[Candidate]:
    """Candidates for what a fit leaves unexplained.

    Args:
        problem: the windows that were fitted.
        recording: names the joints.
        fitted: with its residual on them.
        effects: classes to try.
    """
    missing = missing_torques(problem, recording, fitted.model, fitted.residual)
    sizes = problem.shooting.sizes
    periodic = periodic_candidates(missing, recording, fitted.model, effects, sizes)
    return [*periodic, *profile_candidates(missing, sizes, effects)]
