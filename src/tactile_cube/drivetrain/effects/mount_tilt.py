"""A base that does not stand as it is said to."""

import numpy as np

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Place, Stage, View
from tactile_cube.drivetrain.effects.scales import Scales


class MountTilt(Effect):
    """Base that is tilted: gravity has another direction than stated.

    Gravity turns by `first` about that axis of the base which is nearest to level, and by `second` about the level axis
    across it. Where gravity points along -z these are x and y. The joint says which chain of links it is.

    In data: an error of the weight's torque, in every posture; none where a joint's axis points along gravity.
    Confused with: `position_offset` and the joint offset of an initialisation, exactly so where one joint alone moves;
    a level against the base separates them.
    Source: mounting by eye, 1-15 deg.
    """

    name = "mount_tilt"
    stage = Stage.MECHANISM
    parameters = (
        Parameter("first", "1", 0.0, -0.6, 0.6, 0.1, "1-15 deg, in rad"),
        Parameter("second", "1", 0.0, -0.6, 0.6, 0.1, "1-15 deg, in rad"),
    )
    forms = ({"second": 0.1}, {"first": 0.1}, {"first": 0.1, "second": 0.1})

    @classmethod
    def forms_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return the forms that a joint can show: a single one never shows both angles."""
        return super().forms_at(scales)[: 3 if scales.neighbours else 2]

    @classmethod
    def can_act(cls, scales: Scales) -> bool:
        """Return whether it is the first joint: a tilt is one of the whole machine."""
        return scales.first

    @staticmethod
    def configure(view: View, place: Place, p: Array) -> None:
        """Turn the chain's gravity (Rodrigues)."""
        gravity = view("gravity")[..., place.chain, :]
        size = np.linalg.norm(gravity, axis=-1, keepdims=True)
        down = gravity / np.maximum(size, np.finfo(float).tiny)
        level = np.eye(3)[np.argmin(np.round(np.abs(down), 9), axis=-1)]
        first = np.cross(down, np.cross(level, down))
        first = first / np.maximum(np.linalg.norm(first, axis=-1, keepdims=True), np.finfo(float).tiny)
        across = np.cross(first, down)
        gravity += size * (_turned(_turned(down, first, p[..., :1]), across, p[..., 1:]) - down)


def _turned(vector: Array, axis: Array, angle: Array) -> Array:
    """Vectors (..., 3) about unit axes by angles (..., 1) [rad]; bit for bit the same at zero."""
    along = np.sum(axis * vector, axis=-1, keepdims=True) * axis
    return vector + np.sin(angle) * np.cross(axis, vector) - (1.0 - np.cos(angle)) * (vector - along)
