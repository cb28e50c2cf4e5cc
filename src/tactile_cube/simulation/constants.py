"""Every physical constant of one episode, and how the episode starts."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects import Effect
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, Hand, dlr_hand2
from tactile_cube.hand.object_mesh import SHAPES, ObjectMesh, ObjectShape, read_mesh

Array = NDArray[np.float64]
_OF_SPACE = ("gravity_direction", "cube_size", "cube_com")
_OF_JOINTS = ("kp", "kd", "stiffness", "static_friction", "friction_creep", "reflected_inertia", "joint_offset")
_POSITIVE = {"gravity", "filter_time", "rate_limit", "torque_limit", "kp", "stiffness", "cube_size", "cube_mass"}
_POSITIVE |= {"force_interval"}
_ANY_SIGN = {"gravity_direction", "elasticity_sign", "joint_offset", "cube_com", "table_height", "effects"}
_ANY_SIGN |= {"object_shape"}


@dataclass(frozen=True)
class EpisodeConstants:
    """What stays constant during an episode; made anew for each one by randomisation.

    Vectors over the joints are in the hand's order, for the DLR-Hand II ring, middle, fore, thumb x (q1, q2, q3); a
    float means the same for all. `constants_of` gives those of a hand.

    Attributes:
        gravity: Acceleration of gravity [m/s^2].
        gravity_direction: Where it points in the world (3,); other than straight down means a tilted hand.
        gravity_scale: Share of the cube's weight that acts: 1 full, 0.05 "float". Fingers always weigh in full.
        gravity_onset: Policy steps after the start before the cube has weight.
        filter_time: T_s of the first-order low-pass from q_n to q_f [s].
        rate_limit: Largest change of the target [rad/s].
        torque_limit: Largest joint torque [N m].
        kp: Stiffness K_P of the impedance law (12,) [N m/rad].
        kd: Damping K_D of the impedance law (12,) [N m s/rad].
        stiffness: Elasticity K_e between motor and joint (12,) [N m/rad].
        elasticity_sign: +1: the motor is ahead of a driven joint (physical); -1: as printed in the paper's eq. (2).
        static_friction: Dry friction of the joint (12,) [N m].
        friction_creep: How fast a joint held by dry friction gives way (12,) [rad/s per N m].
        reflected_inertia: Rotor inertia seen at the joint (12,) [kg m^2].
        joint_offset: What the position sensors read too much (12,) [rad]; targets are meant in what the sensors read.
        object_shape: `box`, `cylinder`, `capsule` (upright bar with half spheres at its ends; a sphere where it is as
            high as wide) or an `ObjectMesh`. What is called cube is the object, whatever its shape.
        cube_size: Edge lengths of its bounding box (3,) [m]; a float means a cube.
        cube_mass: [kg].
        cube_com: Centre of mass from the cube's centre, in the cube's frame (3,) [m].
        cube_friction: Lateral friction factor of the cube; that of a contact is the product of both bodies'.
        tip_friction: Lateral friction factor of the fingertips.
        link_friction: Lateral friction factor of all other links.
        tip_spinning_friction: Torque against spinning under a fingertip per normal force [m]. A flat circular contact
            of radius a bears 2/3 mu a: 3 mm is a = 5 mm at mu = 0.9, a tip of 14 mm radius pressed in by 0.9 mm. The
            paper's 0.1 m, which `+experiment=paper` keeps, lies far beyond what a fingertip bears.
        tip_compliance: How far the tips' skin gives way per normal force on the cube [m/N]; 0: hard.
        table_height: Top of the table in the world [m]; None: no table.
        table_friction: Lateral friction factor of the table.
        force_mean: Mean size of the random force on the cube [N].
        force_std: Its standard deviation [N].
        torque_mean: Mean size of the random torque on the cube [N m].
        torque_std: Its standard deviation [N m].
        force_interval: Time after which force and torque are redrawn [s].
        force_seed: Seed of these draws.
        effects: Numbers that effects of the world's drivetrain take in this episode; none: as the world was built.
        joints: Number of the hand's joints, which the vectors have.
    """

    gravity: float = 9.81
    gravity_direction: Array | tuple[float, ...] = (0.0, 0.0, -1.0)
    gravity_scale: float = 1.0
    gravity_onset: int = 4
    filter_time: float = 0.5
    rate_limit: float = float("inf")
    torque_limit: float = dlr_hand2.TORQUE_LIMIT
    kp: Array | float = dlr_hand2.KP
    kd: Array | float = dlr_hand2.KD
    stiffness: Array | float = dlr_hand2.STIFFNESS
    elasticity_sign: int = 1
    static_friction: Array | float = dlr_hand2.STATIC_FRICTION
    friction_creep: Array | float = 0.0
    reflected_inertia: Array | float = dlr_hand2.REFLECTED_INERTIA
    joint_offset: Array | float = 0.0
    cube_size: Array | tuple[float, ...] | float = 0.08
    cube_mass: float = 0.05
    cube_com: Array | tuple[float, ...] | float = 0.0
    cube_friction: float = 1.0
    tip_friction: float = 0.9
    link_friction: float = 0.09
    tip_spinning_friction: float = 0.003
    tip_compliance: float = 0.0
    table_height: float | None = None
    table_friction: float = 0.5
    force_mean: float = 0.0
    force_std: float = 0.0
    torque_mean: float = 0.0
    torque_std: float = 0.0
    force_interval: float = 0.5
    force_seed: int = 0
    effects: tuple[Effect, ...] = ()
    joints: int = 12
    object_shape: ObjectShape = "box"

    def __post_init__(self) -> None:
        for name in (*_OF_SPACE, *_OF_JOINTS):
            count = 3 if name in _OF_SPACE else self.joints
            object.__setattr__(self, name, _vector(name, getattr(self, name), count))
        self._refuse_impossible_object()
        if self.elasticity_sign not in (1, -1):
            raise InputError(f"elasticity_sign is {self.elasticity_sign}; choose 1 (physical) or -1 (as printed)")
        for name in [field.name for field in fields(self) if field.name not in _ANY_SIGN]:
            numbers = np.asarray(getattr(self, name), dtype=np.float64)
            if not np.all(numbers > 0.0 if name in _POSITIVE else numbers >= 0.0):
                wanted = "a value above 0" if name in _POSITIVE else "0 or more"
                raise InputError(f"{name} is {numbers.tolist()}; choose {wanted}")

    def _refuse_impossible_object(self) -> None:
        if isinstance(self.object_shape, ObjectMesh):
            return
        if self.object_shape not in SHAPES:
            raise InputError(f"object_shape is {self.object_shape!r}; choose one of {', '.join(SHAPES)}")
        x, y, z = np.asarray(self.cube_size).tolist()
        if self.object_shape != "box" and (x != y or (self.object_shape == "capsule" and z < x)):
            raise InputError(
                f"cube_size of a {self.object_shape} is {[x, y, z]}; give diameter, diameter and height"
                + (", not lower than the diameter" if self.object_shape == "capsule" else "")
            )

    @property
    def down(self) -> Array:
        """Unit vector of gravity in the world (3,)."""
        direction = np.asarray(self.gravity_direction)
        return np.asarray(direction / np.linalg.norm(direction))

    @property
    def disturbed(self) -> bool:
        """Whether random forces act on the cube."""
        return bool(max(self.force_mean, self.force_std, self.torque_mean, self.torque_std) > 0.0)


@dataclass(frozen=True)
class Start:
    """State in which an episode starts.

    Attributes:
        angles: True joint angles (joints,) [rad].
        cube_position: Centre of the cube in the world (3,) [m].
        cube_quaternion: Orientation of the cube (4,), xyzw.
        target: Initial filtered target q_f (12,) [rad] as the sensors would read it; None: where the sensors read now.
        velocities: Joint velocities (12,) [rad/s]; a float means the same for all.
        cube_linear_velocity: (3,) [m/s].
        cube_angular_velocity: (3,) [rad/s].
    """

    angles: Array
    cube_position: Array | tuple[float, ...] = (0.0, 0.0, 0.0)
    cube_quaternion: Array | tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)
    target: Array | None = None
    velocities: Array | float = 0.0
    cube_linear_velocity: Array | tuple[float, ...] = (0.0, 0.0, 0.0)
    cube_angular_velocity: Array | tuple[float, ...] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        lengths = dict.fromkeys(("angles", "velocities"), np.size(self.angles))
        lengths |= dict.fromkeys(("cube_position", "cube_linear_velocity", "cube_angular_velocity"), 3)
        lengths |= {"cube_quaternion": 4} | ({} if self.target is None else {"target": np.size(self.angles)})
        for name, length in lengths.items():
            object.__setattr__(self, name, _vector(f"start.{name}", getattr(self, name), length))
        norm = float(np.linalg.norm(self.cube_quaternion))
        if norm < 1e-9:
            raise InputError("start.cube_quaternion is zero; give a unit quaternion xyzw")
        object.__setattr__(self, "cube_quaternion", np.asarray(self.cube_quaternion) / norm)


def constants_of(hand: Hand | None = None, object: Mapping[str, Any] | None = None, **values: Any) -> EpisodeConstants:
    """Return the constants of an episode with a hand and an object.

    Args:
        hand: whose drives they are; None: the DLR-Hand II.
        object: `shape`, `size` [m] and `mass` [kg] of the object; what is left out is as in EpisodeConstants. With the
            shape `mesh`: `file`, `scale` [m], `density` [kg/m^3] in place of a mass, `hull`; see `read_mesh`.
        values: further ones, which come before those of hand and object.

    Raises:
        InputError: a value without a physical meaning, a drive or an object that has what no constant names.
    """
    given, hand = _without_mesh(dict(object or {})), hand or DLR_HAND2
    known = {field.name for field in fields(EpisodeConstants)}
    for key in given.keys() - _OBJECT_KEYS.keys():
        raise InputError(f"object.{key}: no such setting; give {', '.join(_OBJECT_KEYS)}")
    for key in hand.drive.keys() - known:
        raise InputError(f"hand.drive.{key}: no such constant; choose from {', '.join(sorted(known))}")
    named = {_OBJECT_KEYS[key]: value for key, value in given.items() if value is not None}
    return EpisodeConstants(**{**hand.drive, **named, **values, "joints": hand.joints})


_OBJECT_KEYS = {"shape": "object_shape", "size": "cube_size", "mass": "cube_mass", "com": "cube_com"}
_MESH_KEYS = ("shape", "file", "scale", "mass", "density", "hull")


def _without_mesh(given: dict[str, Any]) -> dict[str, Any]:
    """Replace the mesh that an object's settings name by its shape, size, mass and centre of mass."""
    if given.get("shape") != "mesh":
        return given
    for key in given.keys() - set(_MESH_KEYS):
        raise InputError(f"object.{key}: no such setting of a mesh; give {', '.join(_MESH_KEYS)}")
    if given.get("file") is None:
        raise InputError("object=mesh needs object.file=FILE, an OBJ or STL file")
    mass, density = given.get("mass"), given.get("density")
    if (mass is None) == (density is None):
        raise InputError(f"object=mesh: mass is {mass}, density is {density}; give one, object.mass [kg] or "
                         "object.density [kg/m^3], and null for the other")  # fmt: skip
    mesh, size = read_mesh(given["file"], float(given.get("scale", 1.0)), bool(given.get("hull", False)))
    heavy = float(density) * mesh.volume * float(np.prod(size)) if density is not None else mass
    return {"shape": mesh, "size": size, "mass": heavy, "com": mesh.com * size}


def _vector(name: str, value: object, length: int) -> Array:
    """Return a read-only vector of the given length, from one number or as many as needed."""
    array = np.asarray(value, dtype=np.float64)
    if array.shape not in ((), (length,)):
        raise InputError(f"{name} has shape {array.shape}; give one number or {length}")
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} is {array.tolist()}; give finite numbers")
    array = np.broadcast_to(array, (length,)).copy()
    array.flags.writeable = False
    return array
