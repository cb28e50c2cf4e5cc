"""The safety of commands that use half of what is allowed."""

import numpy as np

from tactile_cube.identification.safe_commands import QUANTITIES, Envelope, Limits, Safety


def half_used(joints: int) -> Safety:
    """Limits of 1 rad either way, 10 rad/s and 2 N m that the URDF states."""
    one = np.ones(joints)
    limits = Limits(Envelope(-one, one, 10.0 * one, 2.0 * one), {key: ("URDF",) * joints for key in QUANTITIES})
    reached = Envelope(-0.45 * one, 0.45 * one, 4.5 * one, 0.9 * one)
    return Safety(limits, 0.1, reached, 0.64, 14, np.zeros((1, joints)), open_loop=False)
