"""A hand of one's own: any number of fingers with equally many joints, from its URDF and a short description."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.errors import InputError
from tactile_cube.hand.hand import Array, CollisionShape, FingerBase, Hand
from tactile_cube.hand.kinematics import grasp_angles
from tactile_cube.hand.urdf import ROBOT_ROOT, origin_element, robot_element
from tactile_cube.hand.urdf_finger import UrdfFinger, palm_shapes, read_finger, visual_elements
from tactile_cube.hand.urdf_tree import package_of, with_own_files
from tactile_cube.untrusted_file import read_text

DESCRIPTIONS = Path(__file__).parent / "descriptions"
"""URDFs that the package ships."""
NOMINAL_OBJECT = (0.08, 0.08, 0.08)
"""That the start angles are for where a description names none [m]."""


@dataclass(frozen=True)
class UrdfHand(Hand):
    """A hand read from a URDF; see `hand_from_urdf`.

    Attributes:
        label: what it is called.
        chains: its fingers.
        palm: shapes of what no joint moves, for pictures.
        radius: of the fingertips [m].
        file: name of the URDF's file.
        sha256: of that file.
    """

    label: str
    chains: tuple[UrdfFinger, ...]
    palm: tuple[CollisionShape, ...]
    radius: float
    file: str
    sha256: str

    @property
    def name(self) -> str:
        """See `Hand`."""
        return self.label

    @property
    def joint_names(self) -> tuple[str, ...]:
        """See `Hand`; as in the URDF."""
        leaders = self._own()
        return tuple(chain.joints[link] for chain in self.chains for link in leaders)

    @property
    def joints_per_finger(self) -> int:
        """See `Hand`."""
        return len(self._own())

    @property
    def links_per_finger(self) -> int:
        """See `Hand`."""
        return len(self.chains[0].links)

    @property
    def tip_radius(self) -> float:
        """See `Hand`."""
        return self.radius

    def coupled(self) -> tuple[tuple[int, int], ...]:
        """See `Hand`."""
        columns = self.chains[0].columns
        return tuple((k, columns.index(column)) for k, column in enumerate(columns) if columns.index(column) != k)

    def link_names(self, finger: int) -> tuple[str, ...]:
        """See `Hand`; as in the URDF."""
        return self.chains[finger].links

    def shapes(self, finger: int) -> tuple[tuple[CollisionShape, ...], ...]:
        """See `Hand`."""
        return self.chains[finger].shapes

    def link_limits(self, finger: int) -> Array:
        """See `Hand`."""
        return self.chains[finger].limits

    def spin_axes(self) -> tuple[int, ...]:
        """See `Hand`."""
        return (2,) * self.links_per_finger

    def finger_urdf(self, finger: int) -> str:
        """See `Hand`."""
        root = f"{self.fingers[finger].name} base"
        parts = self.chains[finger].parts(root, origin_element(np.zeros(3)))
        return robot_element(self.fingers[finger].name, [ROBOT_ROOT.format(name=root), parts])

    def urdf(self) -> str:
        """See `Hand`."""
        colour = '<material name="palm"><color rgba="0.35 0.37 0.40 1"/></material>'
        drawn = "".join(visual_elements(shape, colour) for shape in self.palm)
        bases = (origin_element(finger.position, finger.rotation) for finger in self.fingers)
        fingers = [chain.parts("palm", base) for chain, base in zip(self.chains, bases, strict=True)]
        return robot_element(self.label, [f'<link name="palm">{drawn}</link>', *fingers])

    @property
    def urdf_name(self) -> str:
        """See `Hand`."""
        return self.file

    @property
    def urdf_sha256(self) -> str:
        """See `Hand`."""
        return self.sha256

    def chain_joints(self, finger: int) -> tuple[str, ...]:
        """See `Hand`."""
        return self.chains[finger].joints

    def followed(self, joint: str) -> str:
        """See `Hand`."""
        for chain in self.chains:
            if joint in chain.joints:
                column = chain.columns[chain.joints.index(joint)]
                return chain.joints[chain.columns.index(column)]
        return joint

    def finger_tips(self, finger: int, q: Array) -> Array:
        """See `Hand`."""
        return self.chains[finger].chain(*self.base_in_world(finger)).tips(q)[0]

    def finger_angles(self, finger: int, targets: Array) -> Array:
        """See `Hand`; within the action limits."""
        own = self.of_finger(finger)
        chain = self.chains[finger].chain(*self.base_in_world(finger))
        points = np.asarray(targets, dtype=np.float64).reshape(-1, 3)
        return chain.angles(points, self.action_lower[own], self.action_upper[own])

    def angles_at(self, tips: Array) -> Array:
        """See `Hand`."""
        return np.concatenate([self.finger_angles(k, tips[:, k]) for k in range(len(self.fingers))], axis=1)

    def _own(self) -> list[int]:
        followers = {link for link, _ in self.coupled()}
        return [link for link in range(self.links_per_finger) if link not in followers]


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
    sha256: str | None = None,
) -> UrdfHand:
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
        start: joint angles in which episodes start [rad]; None: fingertips 1 mm off a cube of 8 cm.
        drive: constants of the drives by their names in EpisodeConstants, e.g. kp [N m/rad].
        sha256: that the URDF's file has to have; None: any.

    Raises:
        InputError: what does not fit, by its key.
    """
    file, text, digest = _read(urdf, sha256)
    chains, bases = _fingers(fingers, text)
    own = sorted({chains[0].columns.index(column) for column in chains[0].columns})
    limits = np.concatenate([chain.limits[own] for chain in chains])
    lower, upper = _action_limits(action, limits, len(chains))
    hand = UrdfHand(
        fingers=bases,
        lower=limits[:, 0],
        upper=limits[:, 1],
        action_lower=lower,
        action_upper=upper,
        position=_vector("position", position),
        rotation=Rotation.from_euler("xyz", _vector("rotation", rotation)).as_matrix(),
        start_angles=np.zeros(len(limits)),
        drive={key: np.asarray(value) if np.ndim(value) else float(value) for key, value in (drive or {}).items()},  # type: ignore[arg-type]
        label=name,
        chains=chains,
        palm=tuple(palm_shapes(text, tuple(joint for chain in chains for joint in chain.joints))),
        radius=float(tip_radius),
        file=file.name,
        sha256=digest,
    )
    return replace(hand, start_angles=_start(hand, start))


def _read(urdf: str, sha256: str | None) -> tuple[Path, str, str]:
    """A hand's URDF: its file, its text with the absolute names of its own meshes, and its SHA-256."""
    file = urdf_file(urdf)
    text, left_out = with_own_files(read_text(file), file, package_of(file), ("collision",))
    if left_out:
        raise InputError(left_out[0])
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    if sha256 not in (None, digest):
        raise InputError(f"hand.urdf={urdf}: has the SHA-256 {digest}, wanted is {sha256}; the file has changed")
    return file, text, digest


def urdf_file(urdf: str) -> Path:
    """Return the file that a hand's `urdf` means.

    Raises:
        InputError: there is none.
    """
    file = next((at for at in (Path(urdf), DESCRIPTIONS / urdf) if at.exists()), None)
    if file is None:
        raise InputError(f"hand.urdf={urdf}: no such file, nor one of the package's in {DESCRIPTIONS.name}/")
    return file


def _fingers(
    fingers: Mapping[str, Mapping[str, Any]], text: str
) -> tuple[tuple[UrdfFinger, ...], tuple[FingerBase, ...]]:
    if not fingers:
        raise InputError("hand.fingers is empty; describe at least one finger")
    chains, bases = zip(*(_finger(str(key), one, text) for key, one in fingers.items()), strict=True)
    if len({(len(chain.joints), chain.columns) for chain in chains}) > 1:
        counts = ", ".join(f"{base.name} {len(chain.joints)}" for base, chain in zip(bases, chains, strict=True))
        raise InputError(
            f"hand.fingers have different joints ({counts}); fingers of equally many joints can be simulated"
        )
    return chains, bases


def _finger(name: str, one: Mapping[str, Any], text: str) -> tuple[UrdfFinger, FingerBase]:
    where = f"hand.fingers.{name}"
    for key in ("joints", "tip", "side"):
        if key not in one:
            raise InputError(f"{where}: lacks '{key}'; give joints, tip and side")
    chain = read_finger(text, tuple(one["joints"]), str(one["tip"]), where)
    side = _vector(f"fingers.{name}.side", one["side"])
    length = float(np.linalg.norm(side[:2]))
    if length < 1e-9:
        raise InputError(f"{where}.side is {side.tolist()}; give a horizontal direction")
    across = side * [1.0, 1.0, 0.0] / length
    return chain, FingerBase(name, chain.base.translation, chain.base.rotation, across)


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


def _start(hand: UrdfHand, start: Sequence[float] | None) -> Array:
    if start is None:
        return grasp_angles(hand, NOMINAL_OBJECT, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    angles = np.asarray(start, dtype=np.float64)
    if angles.shape != hand.lower.shape:
        raise InputError(f"hand.start has {angles.size} angles; the hand has {hand.lower.size} joints")
    return angles


def _vector(key: str, values: Sequence[float]) -> Array:
    vector = np.asarray(values, dtype=np.float64)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        raise InputError(f"hand.{key} is {list(values)}; give three numbers")
    return vector
