"""The translation of contact into MuJoCo's terms: friction, spring and damper of each pair of shapes.

MuJoCo's contact force is f = -(a + b v + k r) / R for acceleration a, speed v and gap r, with one regularisation R a
contact that follows from the impedance d and a weight A of the two bodies: R = A (1 - d) / d. With

    1 / R = K h^2 + B h,   b = (B + K h) R,   k = K R

at time step h this is the force of a spring K with damper B at the end of the step (implicit Euler), for any masses.
Friction has 1 / R as large by `impratio`; what slips holds f by creeping at f R h / impratio.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_cube.simulation.surface import SKIN_RELAXATION, Surface

Array = NDArray[np.float64]

IMPRATIO = 100.0
"""Regularisation of the normal force over that of friction."""
HARD = 2e-5
"""Compliance of surfaces that are called hard [m/N]: 3 N sink in by 60 um."""
HARD_RELAXATION = 2e-2
"""Damping over stiffness of hard surfaces [s]. A body overlaps by up to its way in one step before it is met, which the
spring gives back as speed unless that takes much longer than a step."""
CONDIM = 4
"""Normal force, two of lateral friction and a torque against spinning, under one elliptic cone."""
LEAST_IMPEDANCE, MOST_IMPEDANCE = 1e-4, 0.9999


def friction(pair: Surface) -> list[float]:
    """MuJoCo's five numbers of a pair: lateral twice, spinning [m], rolling twice (not used)."""
    return [pair.lateral, pair.lateral, pair.spinning, 0.0, 0.0]


def spring_and_damper(compliance: float, dt: float) -> tuple[float, float, float]:
    """R [1/kg], k [1/s^2] and b [1/s] of a contact with this compliance [m/N]."""
    stiffness = 1.0 / max(compliance, HARD)
    damping = stiffness * (SKIN_RELAXATION if compliance > HARD else HARD_RELAXATION)
    regularisation = 1.0 / (stiffness * dt**2 + damping * dt)
    return regularisation, stiffness * regularisation, (damping + stiffness * dt) * regularisation


def set_contact(model: Any, pair: int, surface: Surface) -> None:
    """Writes spring and damper of a pair into a compiled model."""
    bodies = model.geom_bodyid[[model.pair_geom1[pair], model.pair_geom2[pair]]]
    weight = float(model.body_invweight0[bodies, 0].sum())
    regularisation, k, b = spring_and_damper(surface.compliance, float(model.opt.timestep))
    impedance = float(np.clip(weight / (weight + regularisation), LEAST_IMPEDANCE, MOST_IMPEDANCE))
    model.pair_solimp[pair] = [impedance, impedance, 1e-3, 0.5, 2.0]
    # MuJoCo divides the one by d^2 and takes d times the gap; it divides the other by d
    model.pair_solref[pair] = [-k * impedance, -b * impedance]
