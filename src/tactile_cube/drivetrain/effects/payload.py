"""A mass on the rig that its description does not know."""

import numpy as np

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Place, Stage, View
from tactile_cube.drivetrain.effects.scales import Scales


class Payload(Effect):
    """A point mass on the outermost link that the joint moves by itself, `distance` from that link's joint.

    It lies on the line through the link's centre of mass; a negative mass is a link lighter than stated.

    Source: parallel-axis theorem.
    """

    name = "payload"
    stage = Stage.MECHANISM
    parameters = (
        Parameter("mass", "kg", 0.0, -0.2, 5.0, 0.02, "0-20 % of the link's mass, or a tool"),
        Parameter("distance", "m", 0.03, 0.0, 1.0, 0.03, "within the link"),
    )

    @classmethod
    def forms_at(cls, scales: Scales) -> list[dict[str, float]]:
        """A joint that slides does not feel where on the link the mass lies."""
        (form,) = super().forms_at(scales)
        return [{"mass": form["mass"]} if scales.slides else form]

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Little mass more or less, and as much as a tool: half the link's own, as far out as that.

        From a few per cent a fit does not arrive at a mass several times the link's: the torque's gain is nearer.
        """
        tool = {"mass": 0.5 * scales.mass} if scales.slides else {"mass": 0.5 * scales.mass, "distance": scales.lever}
        return [*super().starts_at(scales), tool]

    @staticmethod
    def configure(view: View, place: Place, p: Array) -> None:  # noqa: D102
        chain, link = place.chain, place.outermost
        mass, com = view("mass")[..., chain, link], view("com")[..., chain, link, :]
        length = np.maximum(np.linalg.norm(com, axis=-1), 1e-9)[..., None]
        lever = com / length * p[..., 1, None] - com
        total = np.maximum(mass + p[..., 0], 1e-6)
        reduced = mass * p[..., 0] / total
        square = np.sum(lever * lever, axis=-1)[..., None, None] * np.eye(3)
        spread = square - lever[..., :, None] * lever[..., None, :]
        view("inertia")[..., chain, link, :, :] += reduced[..., None, None] * spread
        view("com")[..., chain, link, :] += lever * (p[..., 0] / total)[..., None]
        view("mass")[..., chain, link] = total
