"""Middle finger and thumb hold a box between two opposite faces; the line through both contacts is the axis."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.hand import DLR_HAND2, Hand, grasp_angles
from tactile_cube.hand.urdf import CollisionShape
from tactile_cube.simulation.constants import EpisodeConstants, Start
from tactile_cube.simulation.world import World

Array = NDArray[np.float64]

SIZE = 0.08
"""Edge of the box [m]."""
GRAVITY = 9.81
"""Gravity [m/s^2]."""
CLOSING = 2.0
"""Time without weight, in which the tips close and forces settle [s]."""
STIFFNESS = 30.0
"""Stiffness of the joints [N m/rad], ten times the hand's: tips that hardly move in closing leave the box upright."""
_RIGID = 1e4
_NEVER = 10**6
_CLEARANCE, _RETRACTED = 1e-3, 2e-2
_TAKING_PART = np.array([False, True, False, True])


def _with_round_tips(hand: Hand) -> Hand:
    """The hand with spheres for fingertips: a capsule along a face touches at two points, which bear more than one."""
    fingers = []
    for finger in hand.fingers:
        tip = finger.shapes[-1][0]
        end = 0.5 * (tip.size[1] - 1e-4) * tip.rotation[:, 2]
        sphere = CollisionShape("capsule", (hand.tip_radius, 1e-4), tip.position + end)
        fingers.append(replace(finger, shapes=(*finger.shapes[:-1], (sphere,))))
    return replace(hand, fingers=tuple(fingers))


ROUND_TIPS = _with_round_tips(DLR_HAND2)
"""The hand that pinches."""


@dataclass(frozen=True)
class Grip:
    """The two contacts at one time.

    Attributes:
        normal: Normal force at each tip (2,) [N].
        sideways: Friction force at each tip (2,) [N].
        axis: Unit vector through both contacts (3,).
        point: The first contact (3,) [m].
    """

    normal: Array
    sideways: Array
    axis: Array
    point: Array

    def lever(self, centre: Array) -> float:
        """Torque of a weight of 1 N at a point (3,) about the axis [m]."""
        return abs(float(self.axis @ np.cross(centre - self.point, [0.0, 0.0, -1.0])))

    def bearable(self, friction: float, spinning: float) -> float:
        """Torque about the axis that both tips bear beside their sideways forces [N m].

        On each tip (f / (mu N))^2 + (t / (s N))^2 <= 1: sideways force f and torque t share one limit surface.
        Source: Howe and Cutkosky, "Practical force-motion models for sliding manipulation", 1996.
        """
        share = np.clip(self.sideways / (friction * self.normal), 0.0, 1.0)
        return float(np.sum(spinning * self.normal * np.sqrt(1.0 - share**2)))


def box(mass: float, com: tuple[float, float, float], friction: float, spinning: float) -> EpisodeConstants:
    """Constants of an episode in which stiff fingers pinch a box, whose weight is given by hand.

    Args:
        mass: [kg].
        com: Its centre of mass (3,) [m].
        friction: Lateral friction factor of the tips.
        spinning: Their torque against spinning per normal force [m].
    """
    return EpisodeConstants(
        kp=STIFFNESS,
        stiffness=_RIGID,
        cube_size=SIZE,
        cube_mass=mass,
        cube_com=com,
        gravity=GRAVITY,
        gravity_onset=_NEVER,
        tip_friction=friction,
        tip_spinning_friction=spinning,
    )


def pinch(world: World, constants: EpisodeConstants, squeeze: float, roll: float = 0.0) -> Array:
    """Closes both tips on a box without weight.

    Args:
        world: To use; it is reset.
        constants: See `box`.
        squeeze: How deep inside the faces the tips aim [m].
        roll: Angle about the axis at which the box is held [rad].

    Returns:
        Targets to go on with (12,) [rad].
    """
    turned = Rotation.from_euler("x", roll).as_quat()
    start = Start(_angles(_CLEARANCE), cube_quaternion=turned)
    world.reset(constants, start)
    target = _angles(-squeeze)
    for _ in range(round(CLOSING / world.options.policy_dt)):
        world.step(target)
    return target


def grip(world: World) -> Grip:
    """The contacts of the two tips with the box.

    Raises:
        ValueError: One of them does not touch.
    """
    touching = [one for one in world.contacts() if one.other == "cube" and one.force > 0.0]
    tips = [[one for one in touching if one.finger == finger] for finger in ("thumb", "middle")]
    if not all(tips) or sum(map(len, tips)) < len(touching):
        raise ValueError(f"thumb and middle finger shall hold the box, not {[one.finger for one in touching]}")
    normal = np.array([sum(one.force for one in tip) for tip in tips])
    friction = np.array([np.sum([one.friction for one in tip], axis=0) for tip in tips])
    first, second = (
        np.sum([one.force * one.position for one in tip], axis=0) / force
        for tip, force in zip(tips, normal, strict=True)
    )
    axis = (second - first) / np.linalg.norm(second - first)
    return Grip(normal, np.linalg.norm(friction, axis=1), axis, first)


def centre_of_mass(world: World) -> Array:
    """Of the box in the world (3,) [m]."""
    turn = Rotation.from_quat(world.cube_quaternion)
    return np.asarray(world.cube_position + turn.apply(np.array(world.constants.cube_com)))


def roll_of(world: World) -> float:
    """Angle of the box about x [rad]."""
    return float(Rotation.from_quat(world.cube_quaternion).as_rotvec()[0])


def _angles(gap: float) -> Array:
    """Joint angles (12,) [rad] with this gap at the two tips that hold; the others stay away."""
    size, centre, upright = [SIZE] * 3, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]
    near, away = (grasp_angles(DLR_HAND2, size, centre, upright, one).reshape(-1, 3) for one in (gap, _RETRACTED))
    return np.where(_TAKING_PART[:, None], near, away).ravel()
