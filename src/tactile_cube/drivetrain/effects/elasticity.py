"""A drive that is softer than stated."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import DEFLECTION, TORQUE


class Elasticity(Effect):
    """Linear elasticity in series with the nominal one: q_m - q = tau (1 / K_e + compliance).

    Source: Sievers et al., ICRA 2022, eq. (2); Spong, Modeling and control of elastic joint robots, 1987.
    """

    name = "elasticity"
    stage = Stage.DEFLECTION
    parameters = (
        Parameter(
            "compliance", unit="rad/(N m)", neutral=0.0, low=-0.03, high=1.0, typical=0.05, source="5-50 N m/rad"
        ),
    )

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Deflection q_m - q [rad]."""
        return x[DEFLECTION, j] + p[0] * x[TORQUE, j]
