"""A drive that is softer than stated."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Place, Stage, View


class Elasticity(Effect):
    """Linear elasticity in series with the nominal one: q_m - q = tau (1 / K_e + compliance).

    Source: Sievers et al., ICRA 2022, eq. (2); Spong, Modeling and control of elastic joint robots, 1987.
    """

    name = "elasticity"
    stage = Stage.MECHANISM
    parameters = (Parameter("compliance", "rad/(N m)", 0.0, -0.03, 1.0, 0.05, "5-50 N m/rad"),)

    @staticmethod
    def configure(view: View, place: Place, p: Array) -> None:  # noqa: D102
        view("compliance")[..., place.joint] += p[..., 0]
