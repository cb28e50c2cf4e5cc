"""A drive that is softer than stated."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Place, Stage, View
from tactile_cube.drivetrain.effects.scales import Scales

STIFF = 0.03
"""Part of a finger's compliance: its error of control is a third of its range, that of a machine tool a hundredth."""


class Elasticity(Effect):
    """Linear elasticity in series with the nominal one: q_m - q = tau (1 / K_e + compliance).

    Source: Sievers et al., ICRA 2022, eq. (2); Spong, Modeling and control of elastic joint robots, 1987.
    """

    name = "elasticity"
    stage = Stage.MECHANISM
    parameters = (Parameter("compliance", "rad/(N m)", 0.0, -0.03, 1.0, 0.05, "5-50 N m/rad"),)

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """As soft as a finger's drive for the torques of this one, and as a machine's that is controlled stiffly."""
        (form,) = cls.forms_at(scales)
        return [{"compliance": part * form["compliance"]} for part in (1.0, STIFF)]

    @staticmethod
    def configure(view: View, place: Place, p: Array) -> None:  # noqa: D102
        view("compliance")[..., place.joint] += p[..., 0]
