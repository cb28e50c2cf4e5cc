"""Links and rotors that are not as described."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Place, Scales, Stage, View


class ReflectedInertia(Effect):
    """Rotor that is heavier, seen from the joint, than stated.

    M_jj += excess, where the nominal rotor counts with i^2 J for the gear ratio i.

    In data: an error proportional to the acceleration.
    Confused with: `actuator_lag`, `command_delay`, `payload`.
    Source: data sheets give J; gear ratios of 100 to 200 square its error.
    """

    name = "reflected_inertia"
    stage = Stage.MECHANISM
    parameters = (Parameter("excess", "kg m^2", 0.0, -0.003, 0.1, 0.003, "0.002-0.01 kg m^2"),)

    @staticmethod
    def configure(view: View, place: Place, p: Array) -> None:
        """Add to the reflected inertia."""
        view("reflected_inertia")[..., place.joint] += p[..., 0]


class Payload(Effect):
    """Point mass on the outermost link that the joint moves by itself.

    The mass lies `distance` from that link's joint, on the line through the link's centre of mass; below zero behind
    the joint, as a counterweight does. A negative mass makes the link lighter than stated.

    In data: an error like the weight: sin q, also at rest; more inertia in fast motion.
    Confused with: `torque_gain`; a second configuration or a known weight separates them. `gravity_compensation`: a
    torque sensor separates them. `position_offset`; `reflected_inertia`.
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


class MountTilt(Effect):
    """Base that is tilted: gravity has another direction than stated.

    Gravity turns by `first` about that axis of the base which is nearest to level, and by `second` about the level axis
    across it. Where gravity points along -z these are x and y. The joint says which chain of links it is.

    In data: an error of the weight's torque, in every configuration; none where a joint's axis points along gravity.
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
    forms = ({"second": 0.1}, {"first": 0.2}, {"first": 0.2, "second": 0.1})
    details = ("first", "second")
    detail_starts: ClassVar[Mapping[str, float]] = {"first": 0.1, "second": 0.1}  # a joint feels one as its cosine only

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
    """Turn vectors (..., 3) about unit axes by angles (..., 1) [rad]; bit for bit the same at zero."""
    along = np.sum(axis * vector, axis=-1, keepdims=True) * axis
    return vector + np.sin(angle) * np.cross(axis, vector) - (1.0 - np.cos(angle)) * (vector - along)


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
