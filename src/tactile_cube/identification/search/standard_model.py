"""The field's standard model of a joint, asked first: friction, offset torque and torque constant stated wrongly."""

from __future__ import annotations

import numpy as np

from tactile_cube.identification.fitting.gauss_newton import Fit, fit, precision
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.explanation import Explanation
from tactile_cube.identification.search.relatives import with_effects
from tactile_cube.identification.search.residual_shape import Missing, missing_torques
from tactile_cube.identification.search.search import Search

ITERATIONS = 12
MOVES = 0.05  # of a joint's speed: slower samples say little of its friction


def standard_explanation(search: Search, base: Explanation) -> Explanation | None:
    """Return what of the standard model the recording's owner states wrongly, or None where that is no explanation.

    All laws are regressed on the torque that the base model lacks, then fitted at all joints at once. Those stay that
    the fit needs for its error, then those that the trials to judge by ask for.

    Source: Gautier, Dynamic identification of robots with power model, ICRA 1997; viscous friction by direction as in
    Janot, Gautier, Brunot, EMPS benchmark, 2019.
    """
    frozen = search.frozen(base.fit)
    missing = missing_torques(search.problem, search.fitted, frozen.model, frozen.residual)
    known = {effect.name: effect for effect in search.effects}
    wanted = [
        Candidate(known[name], (one.joint,), form, search.shooting.sizes)
        for one in missing
        for name, form in regressed(one).items()
        if name in known
    ]
    needed = _needed(search, frozen, search.new(wanted))
    if not needed:
        return None
    search.say(f"standard model: {' & '.join(one.label for one in needed)}")
    fitted = search.refitted(with_effects(base.fit.model, needed))
    found = search.pruned(search.explanation(base, tuple(needed), fitted.model, 1))
    enough = found.explained(base) > search.criteria.most and search.worthwhile(found, base, base)
    return found if enough else None


def regressed(missing: Missing) -> dict[str, dict[str, float]]:
    """Return effect -> parameters of the laws that are linear in the missing torque, by least squares.

    Torque (samples,) [N m] = -Fc sgn v - b v - d / 2 |v| + bias + g tau, of samples that move.
    """
    speed = missing.signals[f"velocity of {missing.joint} [rad/s]"]
    drive = missing.signals[f"torque of {missing.joint} [N m]"]
    moving = np.abs(speed) > MOVES * np.abs(speed).max()
    v = speed[moving]
    columns = np.stack([-np.sign(v), -v, -0.5 * np.abs(v), np.ones_like(v), drive[moving]], axis=1)
    sizes = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    friction, damping, difference, bias, gain = (
        np.linalg.lstsq(columns / sizes, missing.torque[moving], rcond=1e-6)[0] / sizes
    ).tolist()
    return {
        "coulomb_friction": {"friction": max(friction, 0.0)},
        "viscous_friction": {"damping": max(damping, 0.5 * abs(difference)), "difference": difference},
        "torque_bias": {"bias": bias},
        "torque_gain": {"error": float(np.clip(gain, -0.7, 0.7))},
    }


def _needed(search: Search, frozen: Fit, wanted: list[Candidate]) -> list[Candidate]:
    """Those of the laws, fitted together, without which the fit's squared error grows by a large part of itself."""
    left = list(wanted)
    while left:
        model = with_effects(frozen.model, left)
        fitted = fit(search.problem, model, search.unknowns(model)[len(frozen.unknowns) :], ITERATIONS, frozen)
        inverse = np.linalg.pinv(fitted.information + np.diag(precision(fitted.unknowns)))
        least = search.criteria.large_gain * fitted.cost
        worth, first = [], len(frozen.unknowns)
        for one in left:
            own = slice(first, first := first + one.size)
            values = np.array([u.of(fitted.model) / u.scale for u in fitted.unknowns[own]])
            worth.append(float(values @ np.linalg.solve(inverse[own, own], values)))
        kept = [one for one, cost in zip(left, worth, strict=True) if cost >= least]
        if len(kept) == len(left) or not kept:
            return kept
        left = kept
    return left
