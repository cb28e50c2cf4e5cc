"""A hand of one's own: any number of fingers with equally many joints, from its URDF and a short description."""

import hashlib
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.errors import InputError
from tactile_cube.hand.chain import Chain
from tactile_cube.hand.hand import Finger, Hand
from tactile_cube.hand.kinematics import grasp_angles
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.hand.urdf import Array, CollisionShape, origin_element
from tactile_cube.hand.urdf_elements import Placement, number, placement_of, triple
from tactile_cube.hand.urdf_tree import package_of, require_mesh, with_own_files
from tactile_cube.untrusted_file import read_text


def read_shapes(robot: ElementTree.Element, tree: RigidBodyTree, carrier: int, turn: Array) -> list[CollisionShape]:
    """Read the collision shapes that move with dof `carrier` (-1: with none), seen from axes (3, 3) in its frame.

    The files that the robot, of which `tree` was read, names have absolute names.

    Raises:
        InputError: a shape that no engine has, a mesh that none reads.
    """
    shapes = []
    for link in robot.findall("link"):
        name = str(link.get("name"))
        dof, place = tree.homes[name]
        for collision in link.findall("collision") if dof == carrier else ():
            geometry, where = collision.find("geometry"), f"link '{name}'"
            kinds = list(geometry) if geometry is not None else []
            if len(kinds) != 1:
                raise InputError(f"URDF: a <collision> of {where} has {len(kinds)} geometries; give one")
            at = place.then(placement_of(collision, where))
            seen = Placement(turn.T @ at.rotation, turn.T @ at.translation)
            shapes.append(_shape(kinds[0], seen, where))
    return shapes


def _shape(element: ElementTree.Element, at: Placement, where: str) -> CollisionShape:
    kind = element.tag
    if kind == "box":
        return CollisionShape("box", tuple(triple(element, "size", where).tolist()), at.translation, at.rotation)
    if kind == "sphere":
        return CollisionShape("sphere", (number(element, "radius", where, 0.0),), at.translation, at.rotation)
    if kind == "cylinder" or kind == "capsule":
        size = (number(element, "radius", where, 0.0), number(element, "length", where, 0.0))
        return CollisionShape("cylinder" if kind == "cylinder" else "capsule", size, at.translation, at.rotation)
    if kind == "mesh":
        scale = tuple(triple(element, "scale", where).tolist()) if element.get("scale") else (1.0, 1.0, 1.0)
        file = Path(element.get("filename", ""))
        require_mesh(file, where)
        return CollisionShape("mesh", scale, at.translation, at.rotation, str(file))
    raise InputError(f"URDF: {where} has the shape <{kind}>; use box, sphere, cylinder, capsule or mesh")


def _finger(name: str, one: Mapping[str, Any], text: str) -> tuple[Finger, tuple[int, ...]]:
    """Cut a described finger out of a URDF; return it and the actuated joint that each of its joints moves with.

    Products of inertia about a joint's axis are left out: they are negligible beside the rotor's inertia about it.
    """
    where = f"hand.fingers.{name}"
    for key in ("joints", "tip", "side"):
        if key not in one:
            raise InputError(f"{where}: lacks '{key}'; give joints, tip and side")
    side = _vector(f"fingers.{name}.side", one["side"])
    length = float(np.linalg.norm(side[:2]))
    if length < 1e-9:
        raise InputError(f"{where}.side is {side.tolist()}; give a horizontal direction")
    joints, tip = tuple(one["joints"]), str(one["tip"])
    tree = RigidBodyTree.from_urdf(text, joints)
    _require_chain(tree, joints, where)
    last, tip_place = tree.homes.get(tip, (-1, Placement()))
    if last != tree.dofs - 1:
        raise InputError(f"{where}.tip is '{tip}', no link that joint '{tree.dof_names[-1]}' carries; name one")
    robot = ElementTree.fromstring(text)
    turns = [_principal_axes(tree.axis[k], tree.inertia[k]) for k in range(tree.dofs)]
    before = [np.eye(3), *turns]
    rotations = [before[k].T @ tree.placement_rotation[k] @ turns[k] for k in range(tree.dofs)]
    translations = [before[k].T @ tree.placement_translation[k] for k in range(tree.dofs)]
    columns = tuple(int(column) for column in tree.follow)
    finger = Finger(
        name=name,
        position=translations[0],
        rotation=rotations[0],
        face=side * [1.0, 1.0, 0.0] / length,
        joints=tree.dof_names,
        links=tree.link_names,
        limits=np.stack([tree.lower, tree.upper], axis=1),
        origins=tuple(map(origin_element, translations[1:], rotations[1:])),
        mass=tree.mass,
        com=np.stack([turn.T @ com for turn, com in zip(turns, tree.com, strict=True)]),
        inertia=np.stack([np.diag(turn.T @ own @ turn) for turn, own in zip(turns, tree.inertia, strict=True)]),
        shapes=tuple(tuple(read_shapes(robot, tree, k, turn)) for k, turn in enumerate(turns)),
        chain=Chain(np.array(rotations[1:]), np.array(translations[1:]), columns, turns[-1].T @ tip_place.translation),
    )
    return finger, columns


def _require_chain(tree: RigidBodyTree, joints: tuple[str, ...], where: str) -> None:
    actuated = tuple(name for k, name in enumerate(tree.dof_names) if name in joints)
    if list(tree.parent) != list(range(-1, tree.dofs - 1)) or actuated != joints:
        raise InputError(f"{where}.joints are {', '.join(joints)}; list a chain, from the palm to the tip")
    for k, name in enumerate(tree.dof_names):
        if tree.prismatic[k]:
            raise InputError(f"{where}: joint '{name}' slides; fingers have revolute joints")
        if not np.all(np.isfinite([tree.lower[k], tree.upper[k]])):
            raise InputError(f"{where}: joint '{name}' has no limits; give it <limit lower= upper=> [rad]")
        if not tree.lower[k] < tree.upper[k]:
            raise InputError(
                f"{where}: joint '{name}' has the limits {tree.lower[k]:g} to {tree.upper[k]:g} rad; lower < upper"
            )
        if not (tree.ratio[k] == 1.0 and tree.offset[k] == 0.0):
            raise InputError(
                f"{where}: joint '{name}' follows another with a ratio other than 1; that is not simulated"
            )
        if not tree.mass[k] > 0.0:
            raise InputError(f"{where}: what joint '{name}' carries has no mass; give its link <inertial>")


def _principal_axes(axis: Array, inertia: Array) -> Array:
    """Return the axes (3, 3) of which z is `axis` (3,) and x, y are principal for `inertia` (3, 3) seen along it."""
    least = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = np.cross(least, axis)
    x /= np.linalg.norm(x)
    frame = np.stack([x, np.cross(axis, x), axis], axis=1)
    seen = frame.T @ inertia @ frame
    angle = 0.5 * np.arctan2(2.0 * seen[0, 1], seen[0, 0] - seen[1, 1])
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(frame @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))


DESCRIPTIONS = Path(__file__).parent / "descriptions"  # URDFs that the package ships
LARGEST_TIP = 0.1  # radius of a fingertip [m]: a ball for a hand
NOMINAL_OBJECT = (0.08, 0.08, 0.08)  # that the start angles are for where a description names none [m]


def hand_from_urdf(
    name: str,
    urdf: str,
    fingers: Mapping[str, Mapping[str, Any]],
    tip_radius: float,
    position: Sequence[float],
    rotation: Sequence[float] = (0.0, 0.0, 0.0),
    action: Mapping[str, Sequence[float]] | None = None,
    start: Sequence[float] | None = None,
    drive: Mapping[str, float | Sequence[float]] | None = None,
    palm_contact: bool = False,
    sha256: str | None = None,
) -> Hand:
    """Describe a hand.

    Args:
        name: what it is called.
        urdf: file; one that the package ships by its name alone.
        fingers: for each finger, in the order of joint vectors, `joints` (actuated ones, from the palm to the tip),
            `tip` (link whose origin is the middle of the fingertip's sphere) and `side` (horizontal direction from the
            object towards the finger, in the world).
        tip_radius: of the fingertips' spheres [m].
        position: of the URDF's root link in the world, where the object's middle is the origin [m].
        rotation: of the root link, as URDF's roll, pitch and yaw [rad].
        action: `lower` and `upper` of the desired angles that actions -1 and +1 mean, for the joints of one finger or
            of all [rad]; None: the URDF's limits.
        start: joint angles in which episodes start [rad]; None: fingertips 1 mm off the object.
        drive: constants of the drives by their names in EpisodeConstants, e.g. kp [N m/rad].
        palm_contact: whether the object touches what no joint moves, as on a hand that lies palm up.
        sha256: that the URDF's file has to have; None: any.

    Raises:
        InputError: what does not fit, by its key.
    """
    file = urdf_file(urdf)
    text, left_out = with_own_files(read_text(file), file, package_of(file), ("collision",))
    if left_out:
        raise InputError(left_out[0])
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    if sha256 not in (None, digest):
        raise InputError(f"hand.urdf={urdf}: has the SHA-256 {digest}, wanted is {sha256}; the file has changed")
    if not 0.0 < tip_radius < LARGEST_TIP:
        raise InputError(f"hand.tip_radius is {tip_radius}; give a radius above 0 and below {LARGEST_TIP:g} m")
    if not fingers:
        raise InputError("hand.fingers is empty; describe at least one finger")
    chains, columns = zip(*(_finger(str(key), one, text) for key, one in fingers.items()), strict=True)
    if len(set(columns)) > 1:
        counts = ", ".join(f"{chain.name} {len(chain.joints)}" for chain in chains)
        raise InputError(
            f"hand.fingers have different joints ({counts}); fingers of equally many joints can be simulated"
        )
    moving = RigidBodyTree.from_urdf(text, [str(joint) for one in fingers.values() for joint in one["joints"]])
    for line in moving.corrected:
        warnings.warn(f"{file}: {line}", stacklevel=2)
    hand = Hand(
        name=name,
        fingers=chains,
        columns=columns[0],
        axes=(2,) * len(columns[0]),
        tip_radius=float(tip_radius),
        position=_vector("position", position),
        rotation=Rotation.from_euler("xyz", _vector("rotation", rotation)).as_matrix(),
        palm=tuple(read_shapes(ElementTree.fromstring(text), moving, -1, np.eye(3))),
        palm_contact=bool(palm_contact),
        start_fixed=start is not None,
        drive={key: np.asarray(value) if np.ndim(value) else float(value) for key, value in (drive or {}).items()},  # type: ignore[arg-type]
        file=file.name,
        sha256=digest,
    )
    lower, upper = _action_limits(action, np.stack([hand.lower, hand.upper], axis=1), len(chains))
    hand = replace(hand, action_lower=lower, action_upper=upper)
    if start is None:
        return replace(hand, start_angles=grasp_angles(hand, NOMINAL_OBJECT, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
    angles = np.asarray(start, dtype=np.float64)
    if angles.shape != hand.lower.shape:
        raise InputError(f"hand.start has {angles.size} angles; the hand has {hand.lower.size} joints")
    outside = ~((hand.lower <= angles) & (angles <= hand.upper))
    if outside.any():
        at = int(np.argmax(outside))
        limits = f"{hand.lower[at]:g} to {hand.upper[at]:g} rad"
        raise InputError(f"hand.start: {hand.joint_names[at]} at {angles[at]:g} rad, its limits are {limits}")
    return replace(hand, start_angles=angles)


def urdf_file(urdf: str) -> Path:
    """Return the file that a hand's `urdf` means; an InputError if there is none."""
    file = next((at for at in (Path(urdf), DESCRIPTIONS / urdf) if at.exists()), None)
    if file is None:
        raise InputError(f"hand.urdf={urdf}: no such file, nor one of the package's in {DESCRIPTIONS.name}/")
    return file


def _action_limits(action: Mapping[str, Sequence[float]] | None, limits: Array, fingers: int) -> tuple[Array, Array]:
    if action is None:
        return limits[:, 0], limits[:, 1]
    ends = []
    for k, key in enumerate(("lower", "upper")):
        values = np.asarray(action.get(key, limits[:, k]), dtype=np.float64)
        if values.size not in (len(limits), len(limits) // fingers):
            raise InputError(
                f"hand.action.{key} has {values.size} numbers; give {len(limits) // fingers}, one for each joint of a "
                f"finger, or {len(limits)}"
            )
        ends.append(np.resize(values, len(limits)))
    if not np.all(ends[0] < ends[1]):
        raise InputError("hand.action: each lower must be below its upper")
    return np.maximum(ends[0], limits[:, 0]), np.minimum(ends[1], limits[:, 1])


def _vector(key: str, values: Sequence[float]) -> Array:
    vector = np.asarray(values, dtype=np.float64)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        raise InputError(f"hand.{key} is {list(values)}; give three numbers")
    return vector
