"""The DLR-Hand II in the published numbers.

Sources: P = Sievers, Pitz, Bäuml, "Learning Purely Tactile In-Hand Manipulation with a Torque-Controlled Hand",
ICRA 2022; W = the authors' website for it; scene = static transforms of the hand scene on the authors' Humanoids 2023
page, which agree with the public robot description `rokin` (JustinHand12).
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.hand.hand import Array, FingerBase
from tactile_cube.hand.model import Capsule, HandModel, Link

KP = 3.69
"""Stiffness of the impedance law [N m/rad]. Source: W, table."""
KD = 0.25
"""Damping of the impedance law [N m s/rad]. Source: W, table (its picture says 0.28)."""
STIFFNESS = 25.0
"""Elasticity K_e between motor and joint [N m/rad]. Source: W, table."""
STATIC_FRICTION = 0.02
"""Dry friction of a joint [N m]. Source: W, table (its picture says 0.08 for q3)."""
REFLECTED_INERTIA = 1.5e-3
"""Rotor inertia seen at the joint [kg m^2]. Estimate within 1e-3..2e-3, where the 500 Hz loop is stable with margin;
gear ratios 120 and 200 with rotors of this size give 1.4e-3..6e-3, critical damping K_D^2 / 4 K_P = 4.2e-3."""
TORQUE_LIMIT = 1.0
"""Largest joint torque [N m]. Source: the authors' follow-up, ICRA 2023 page."""

_FOUR = 4

# Masses are estimates from the volumes of the public meshes; the finger with its drive base weighs 375 g (data sheet).
# The middle link's capsule and the proximal one's are convex stand-ins; the tip is the published shape (scene), a
# capsule from 16.5 mm to 33 mm, continued towards q4. All begin where their middle is the centre of mass: Bullet then
# needs no compound shape around them, which is faster. The middle link is slimmer than the tip: with 15 mm an upright
# finger would press on the cube's upper edge with its smooth middle link instead of its tip.
_LINKS = (
    Link("knuckle", 0.0, 0.040, 0.0, None),
    Link("proximal", 0.075, 0.110, 0.0366, Capsule(0.0175, 0.0082, 0.065)),
    Link("middle", 0.040, 0.055, 0.0177, Capsule(0.0130, -0.0026, 0.038)),
    Link("distal", 0.045, 0.035, 0.0202, Capsule(0.01425, 0.0074, 0.033)),
)


def _finger(
    name: str, position: tuple[float, ...], rotation_vector: tuple[float, ...], face: tuple[float, ...]
) -> FingerBase:
    """A finger's base from position [m] and rotation vector [rad]. Source: scene."""
    return FingerBase(name, np.array(position), Rotation.from_rotvec(rotation_vector).as_matrix(), np.array(face))


_LIKE_RING = (-1.63850239, -0.74407776, -1.79289304)
_LIKE_MIDDLE = (-1.90822554, 0.04794712, -2.36863463)
_FINGERS = (
    _finger("ring", (-0.005785206, -0.061149354, 0.132621405), _LIKE_RING, (0.0, -1.0, 0.0)),
    _finger("middle", (-0.048151365, -0.012101809, 0.133300263), _LIKE_MIDDLE, (1.0, 0.0, 0.0)),
    _finger("fore", (-0.045982316, 0.027691585, 0.138843566), _LIKE_MIDDLE, (0.0, 1.0, 0.0)),
    _finger("thumb", (0.052264236, 0.026986124, 0.102620128), (0.20806912, -1.05993301, -0.25277084), (-1.0, 0.0, 0.0)),
)


def _every_finger(*degrees: float) -> Array:
    """The same (q1, q2, q3) for all fingers: [deg] -> (12,) [rad]."""
    return np.tile(np.radians(degrees), _FOUR)


DLR_HAND2 = HandModel(
    fingers=_FINGERS,
    links=_LINKS,
    # Source: W, "theta_min .. theta_max" of the hardware and "theta_lower .. theta_upper" of the simulation's actions.
    lower=_every_finger(-30.0, -20.0, -10.0),
    upper=_every_finger(30.0, 86.0, 105.0),
    action_lower=_every_finger(-30.0, -10.0, -5.0),
    action_upper=_every_finger(30.0, 30.0, 30.0),
    coupled_upper=float(np.radians(105.0)),
    # Palm down. The scene's pose is for a cube of 0.932 x 8 cm; this one, fitted for an 8 cm cube, lets all four tips
    # reach their faces at mid height within the action limits, one finger per face.
    position=np.array([-0.0576, 0.0136, 0.2559]),
    rotation=Rotation.from_euler("ZYX", [191.98, 17.82, 184.69], degrees=True).as_matrix(),
    start_angles=np.radians([14.4, -1.6, 28.0, -3.9, 16.7, 7.1, -16.0, 21.1, 25.9, 9.9, 7.8, 14.2]),
)
"""The hand of the paper, palm down over a cube at the origin."""


def published_hand() -> HandModel:
    """The same, for conf/hand."""
    return DLR_HAND2
