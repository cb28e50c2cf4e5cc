"""A coupled joint that does not follow its leader exactly."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Place, Stage, View
from tactile_cube.drivetrain.effects.scales import Scales


class CouplingError(Effect):
    """Coupled joint that does not follow its leader exactly.

    q4 = (r + ratio) q3 + c + offset, for the joint q4 that follows the joint q3 with the stated r and c.

    In data: an error of the outer joint that follows the inner one.
    Confused with: `payload` and `position_offset` of the leader.
    Source: tendon couplings under load, 1-3 deg.
    """

    name = "coupling_error"
    stage = Stage.MECHANISM
    parameters = (
        Parameter("ratio", "1", 0.0, -0.9, 1.0, 0.1, "stretch of the coupling tendon"),
        Parameter("offset", "rad", 0.0, -0.5, 0.5, 0.0, "1-3 deg"),
    )
    forms = ({"ratio": 0.1}, {"offset": 0.05}, {"ratio": 0.1, "offset": 0.05})

    @classmethod
    def can_act(cls, scales: Scales) -> bool:
        """Return whether another joint follows this one."""
        return scales.leads

    @staticmethod
    def configure(view: View, place: Place, p: Array) -> None:
        """Change ratio and offset of the followers."""
        view("ratio")[..., place.chain, list(place.followers)] += p[..., 0, None]
        view("offset")[..., place.chain, list(place.followers)] += p[..., 1, None]
