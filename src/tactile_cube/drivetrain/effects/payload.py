"""A mass beyond those of the description."""

import numpy as np

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Place, Stage, View
from tactile_cube.drivetrain.effects.scales import Scales


class Payload(Effect):
    """Point mass on the outermost link that the joint moves by itself.

    The mass lies `distance` from that link's joint, on the line through the link's centre of mass; below zero behind
    the joint, as a counterweight does. A negative mass makes the link lighter than stated.

    In data: an error like the weight: sin q of the posture, also at rest; more inertia in fast motion.
    Confused with: `torque_gain`; a second posture or a known weight separates them. `gravity_compensation`: a torque
    sensor separates them. `position_offset`; `reflected_inertia`.
    Source: parallel-axis theorem.
    """

    name = "payload"
    stage = Stage.MECHANISM
    parameters = (
        Parameter("mass", "kg", 0.0, -0.2, 5.0, 0.02, "0-20 % of the link's mass, or a tool"),
        Parameter("distance", "m", 0.03, -1.0, 1.0, 0.03, "within the link; a counterweight behind it"),
    )

    @classmethod
    def forms_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return the form; of a joint that slides without `distance`, which does not change its motion."""
        (form,) = super().forms_at(scales)
        return [{"mass": form["mass"]} if scales.slides else form]

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return a little mass more and less, and half the mass that the joint moves, as counterweight and as tool.

        A fit that starts at a few per cent does not reach a mass several times the link's.
        """
        starts, tool = super().starts_at(scales), {"mass": 0.5 * scales.mass}
        if scales.slides:
            return [*starts, tool]
        return [*starts, *({**tool, "distance": lever} for lever in (-scales.lever, scales.lever))]

    @staticmethod
    def configure(view: View, place: Place, p: Array) -> None:
        """Change mass, centre of mass and inertia of the link."""
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
