"""A coupled joint that does not follow its leader exactly."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Place, Stage, View
from tactile_cube.drivetrain.effects.scales import Scales


class CouplingError(Effect):
    """q4 = (r + ratio) q3 + c + offset, for the dof that follows the joint.

    Source: tendon couplings under load, 1-3 deg.
    """

    name = "coupling_error"
    stage = Stage.MECHANISM
    parameters = (
        Parameter("ratio", "1", 0.0, -0.9, 1.0, 0.1, "stretch of the coupling tendon"),
        Parameter("offset", "rad", 0.0, -0.5, 0.5, 0.0, "1-3 deg"),
    )
    forms = (
        {"ratio": 0.1},
        {"offset": 0.05},
        {"ratio": 0.1, "offset": 0.05},
    )

    @classmethod
    def can_act(cls, scales: Scales) -> bool:
        """Only a joint that another one follows has a coupling."""
        return scales.leads

    @staticmethod
    def configure(view: View, place: Place, p: Array) -> None:  # noqa: D102
        view("ratio")[..., place.chain, list(place.followers)] += p[..., 0, None]
        view("offset")[..., place.chain, list(place.followers)] += p[..., 1, None]
