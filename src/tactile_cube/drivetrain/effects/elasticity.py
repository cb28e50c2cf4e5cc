"""A drive that is softer than stated."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Place, Stage, View
from tactile_cube.drivetrain.effects.scales import Scales

STIFF = 0.03
"""Compliance of a stiffly controlled machine at which a search starts, as a part of a finger's."""


class Elasticity(Effect):
    """Drive that is softer than stated.

    q_m - q = tau (1 / K_e + compliance): a linear spring in series with the nominal stiffness K_e.

    In data: an error in phase with the torque; a resonance.
    Confused with: `backlash` in motion of one amplitude; `torque_gain`.
    Source: Sievers et al., ICRA 2022, eq. (2); Spong, Modeling and control of elastic joint robots, 1987.
    """

    name = "elasticity"
    stage = Stage.MECHANISM
    parameters = (Parameter("compliance", "rad/(N m)", 0.0, -0.03, 1.0, 0.05, "5-50 N m/rad"),)

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return the compliance of a finger's drive at this joint's sizes, and that of a stiffly controlled machine."""
        (form,) = cls.forms_at(scales)
        return [{"compliance": part * form["compliance"]} for part in (1.0, STIFF)]

    @staticmethod
    def configure(view: View, place: Place, p: Array) -> None:
        """Add to the drive's compliance."""
        view("compliance")[..., place.joint] += p[..., 0]
