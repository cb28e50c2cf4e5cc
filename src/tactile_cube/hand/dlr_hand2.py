"""The DLR-Hand II in the published numbers.

Sources: P = Sievers, Pitz, Bäuml, "Learning Purely Tactile In-Hand Manipulation with a Torque-Controlled Hand",
ICRA 2022; W = the authors' website for it; scene = static transforms of the hand scene on the authors' Humanoids 2023
page, which agree with the public robot description `rokin` (JustinHand12).
"""

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.hand.chain import PlanarChain
from tactile_cube.hand.hand import Finger, Hand
from tactile_cube.hand.urdf import Array, CollisionShape, origin_element

KP = 3.69  # stiffness of the impedance law [N m/rad]. Source: W, table.
KD = 0.25  # damping of the impedance law [N m s/rad]. Source: W, table (its picture says 0.28).
STIFFNESS = 25.0  # elasticity K_e between motor and joint [N m/rad]. Source: W, table.
STATIC_FRICTION = 0.02  # dry friction of a joint [N m]. Source: W, table (its picture says 0.08 for q3).
REFLECTED_INERTIA = 1.5e-3
"""Rotor inertia seen at the joint [kg m^2]. Estimate within 1e-3..2e-3, where the 500 Hz loop is stable with margin;
gear ratios 120 and 200 with rotors of this size give 1.4e-3..6e-3, critical damping K_D^2 / 4 K_P = 4.2e-3."""
TORQUE_LIMIT = 1.0  # largest joint torque [N m]. Source: the authors' follow-up, ICRA 2023 page.

_LIMITS = np.radians([(-30.0, 30.0), (-20.0, 86.0), (-10.0, 105.0), (-10.0, 105.0)])
"""Of q1 .. q4 [rad]. Source: W, "theta_min .. theta_max" of the hardware."""

# Masses are estimates from the volumes of the public meshes; the finger with its drive base weighs 375 g (data sheet).
# The middle link's capsule and the proximal one's are convex stand-ins; the tip is the published shape (scene), a
# capsule from 16.5 mm to 33 mm, continued towards q4. All begin where their middle is the centre of mass: Bullet then
# needs no compound shape around them, which is faster. The middle link is slimmer than the tip: with 15 mm an upright
# finger would press on the cube's upper edge with its smooth middle link instead of its tip.
LINKS = {  # length to the next joint's axis [m], mass [kg], centre of mass along z [m]
    "knuckle": (0.0, 0.040, 0.0),
    "proximal": (0.075, 0.110, 0.0366),
    "middle": (0.040, 0.055, 0.0177),
    "distal": (0.045, 0.035, 0.0202),
}
_CAPSULES = {  # along z: radius, centres of the two half spheres [m]; nothing touches the knuckle
    "proximal": (0.0175, 0.0082, 0.065),
    "middle": (0.0130, -0.0026, 0.038),
    "distal": (0.01425, 0.0074, 0.033),
}
_ACROSS = f'<origin xyz="0 0 0" rpy="{np.pi} {-np.pi / 2.0} 0"/>'
"""From q1's frame to q2's: z along the finger, which is x of the base, y against y of the base."""


def _finger(
    name: str, position: tuple[float, ...], rotation_vector: tuple[float, ...], face: tuple[float, ...]
) -> Finger:
    """Make a finger with its base at a position [m] and rotation vector [rad]. Source: scene.

    Its root is the frame of q1, which turns about z. Every further link's z axis points along the link and its joint
    turns about y; q4 follows q3.
    """
    proximal, middle = LINKS["proximal"][0], LINKS["middle"][0]
    return Finger(
        name=name,
        position=np.array(position),
        rotation=Rotation.from_rotvec(rotation_vector).as_matrix(),
        face=np.array(face),
        joints=("q1", "q2", "q3", "q4"),
        links=tuple(LINKS),
        limits=_LIMITS,
        origins=(_ACROSS, *(origin_element(np.array([0.0, 0.0, length])) for length in (proximal, middle))),
        mass=np.array([mass for _, mass, _ in LINKS.values()]),
        com=np.array([[0.0, 0.0, along] for _, _, along in LINKS.values()]),
        inertia=np.array([_moments(link) for link in LINKS]),
        shapes=tuple(
            tuple(CollisionShape("capsule", (r, b - a), np.array([0.0, 0.0, 0.5 * (a + b)])) for r, a, b in capsule)
            for capsule in ([_CAPSULES[link]] if link in _CAPSULES else [] for link in LINKS)
        ),
        chain=PlanarChain((proximal, middle, _CAPSULES["distal"][2])),
        prefix=f"{name}_",
    )


def _moments(link: str) -> tuple[float, float, float]:
    """Return the moments about the centre of mass, of a solid cylinder in the capsule's place (x, y, z) [kg m^2]."""
    length, mass, _ = LINKS[link]
    radius, length = (_CAPSULES[link][0], length) if link in _CAPSULES else (0.012, 0.02)
    across = mass * (3.0 * radius**2 + length**2) / 12.0
    return across, across, 0.5 * mass * radius**2


_LIKE_RING = (-1.63850239, -0.74407776, -1.79289304)
_LIKE_MIDDLE = (-1.90822554, 0.04794712, -2.36863463)
_FINGERS = (
    _finger("ring", (-0.005785206, -0.061149354, 0.132621405), _LIKE_RING, (0.0, -1.0, 0.0)),
    _finger("middle", (-0.048151365, -0.012101809, 0.133300263), _LIKE_MIDDLE, (1.0, 0.0, 0.0)),
    _finger("fore", (-0.045982316, 0.027691585, 0.138843566), _LIKE_MIDDLE, (0.0, 1.0, 0.0)),
    _finger("thumb", (0.052264236, 0.026986124, 0.102620128), (0.20806912, -1.05993301, -0.25277084), (-1.0, 0.0, 0.0)),
)


_BASES = np.array([finger.position for finger in _FINGERS])
_LOW, _HIGH = _BASES.min(axis=0), _BASES.max(axis=0)
_SLAB = (_HIGH[0] - _LOW[0], _HIGH[1] - _LOW[1] + 0.03, 0.10)
_PALM = CollisionShape("box", _SLAB, np.array([*(0.5 * (_LOW + _HIGH))[:2], _LOW[2] - 0.05]))
"""A slab under the finger bases, for pictures only: nothing ever reaches it."""


def _every_finger(*degrees: float) -> Array:
    """Repeat the same (q1, q2, q3) for all fingers: [deg] -> (12,) [rad]."""
    return np.tile(np.radians(degrees), len(_FINGERS))


DLR_HAND2 = Hand(
    name="dlr_hand2",
    fingers=_FINGERS,
    columns=(0, 1, 2, 2),
    axes=(2, 1, 1, 1),
    tip_radius=_CAPSULES["distal"][0],
    # Source: W, "theta_lower .. theta_upper" of the simulation's actions.
    action_lower=_every_finger(-30.0, -10.0, -5.0),
    action_upper=_every_finger(30.0, 30.0, 30.0),
    # Palm down. The scene's pose is for a cube of 0.932 x 8 cm; this one, fitted for an 8 cm cube, lets all four tips
    # reach their faces at mid height within the action limits, one finger per face.
    position=np.array([-0.0576, 0.0136, 0.2559]),
    rotation=Rotation.from_euler("ZYX", [191.98, 17.82, 184.69], degrees=True).as_matrix(),
    start_angles=np.radians([14.4, -1.6, 28.0, -3.9, 16.7, 7.1, -16.0, 21.1, 25.9, 9.9, 7.8, 14.2]),
    palm=(_PALM,),
)
"""The hand of the paper, palm down over a cube at the origin."""


def published_hand() -> Hand:
    """Return the hand of the paper, for conf/hand."""
    return DLR_HAND2
