"""What happened in one episode, as plain arrays: the one thing that verdicts, pictures and recordings read."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2
from tactile_cube.hand.object_mesh import ObjectMesh, ObjectShape
from tactile_cube.untrusted_file import read_npz
from tactile_cube.whole_file import write_npz

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ContactTable:
    """Every contact between a finger and the cube, one row each, at the end of a policy step.

    Attributes:
        step: sample of the episode the row belongs to `(k,)`.
        finger: index into the record's `fingers` `(k,)`.
        tip: whether it is the fingertip that touches, and no other link `(k,)`.
        position: where the finger touches the cube, world frame `(k, 3)` [m].
        force: contact force on the cube, friction included, world frame `(k, 3)` [N].
        normal_force: its part along the contact normal `(k,)` [N].
        distance: separation of the shapes, negative when they overlap `(k,)` [m].
    """

    step: NDArray[np.int64]
    finger: NDArray[np.int64]
    tip: NDArray[np.bool_]
    position: Array
    force: Array
    normal_force: Array
    distance: Array


@dataclass(frozen=True)
class EpisodeRecord:
    """One episode at the policy's 10 Hz, samples 0 (start) to n (end), with a 500 Hz trace beside it.

    Attributes:
        time: `(n + 1,)` [s].
        theta: angle about the vertical, unwrapped, positive in the rewarded direction `(n + 1,)` [rad].
        joint_position: q, true link angles `(n + 1, joints)` [rad].
        filtered_target: q_f `(n + 1, joints)` [rad].
        target: q_n that reached the hand in each step, in the encoders' coordinates `(n, joints)` [rad].
        cube_position: `(n + 1, 3)` [m].
        cube_quaternion: x, y, z, w `(n + 1, 4)`.
        reward: `(n,)`.
        reward_terms: each term's contribution `(n,)`.
        contacts: who touched the cube where.
        ending: one of `env.OUTCOMES`: "time_limit", "dropped", "left_range", ...
        direction: +1 or -1: the sense about +z that is rewarded.
        cube_size: edge lengths `(3,)` [m].
        constants: what was drawn for this episode and what the run was given (seed, T_s, gravity, ...).
        trace: signals at the physics rate, each `(m, ...)`, with "time" [s] among them.
        policy: what went in and out of the policy in each step, each `(n, joints)`: its newest "q_m" and "e_q" with the
            sensors' offset and noise [rad], and the "action" it asked for, in [-1, 1], before any is repeated.
        fingers: of the hand, in the order of joint vectors; all have equally many joints.
        object_shape: "box", "cylinder", "capsule" or a mesh.
        axis: of the rotation, in the world.
    """

    time: Array
    theta: Array
    joint_position: Array
    filtered_target: Array
    target: Array
    cube_position: Array
    cube_quaternion: Array
    reward: Array
    reward_terms: dict[str, Array]
    contacts: ContactTable
    ending: str
    direction: int
    cube_size: Array
    constants: dict[str, float | str] = field(default_factory=dict)
    trace: dict[str, Array] = field(default_factory=dict)
    policy: dict[str, Array] = field(default_factory=dict)
    fingers: tuple[str, ...] = tuple(finger.name for finger in DLR_HAND2.fingers)
    object_shape: ObjectShape = "box"
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)

    def of_finger(self, finger: int) -> slice:
        """Return the slice of a finger's joints in joint vectors."""
        count = self.joint_position.shape[1] // len(self.fingers)
        return slice(count * finger, count * (finger + 1))

    @property
    def steps(self) -> int:
        """Number of policy steps."""
        return len(self.time) - 1

    @property
    def cut_short(self) -> bool:
        """Whether the episode ended before its time: the cube was lost, or the physics failed."""
        return self.ending != "time_limit"

    def save(self, path: Path) -> None:
        """Write the record as one compressed npz file."""
        shape, arrays = self.object_shape, {name: getattr(self, name) for name in ARRAY_FIELDS}
        groups: dict[str, Mapping[str, NDArray[Any]]] = {
            "contacts": vars(self.contacts),
            "reward": self.reward_terms,
            "trace": self.trace,
            "policy": self.policy,
            "mesh": shape.arrays() if isinstance(shape, ObjectMesh) else {},
        }
        for group, columns in groups.items():
            arrays |= {f"{group}.{name}": values for name, values in columns.items()}
        meta = [self.ending, self.direction, self.constants, self.fingers, str(shape), self.axis]
        write_npz(path, {"meta": np.array(json.dumps(meta))} | arrays)

    @classmethod
    def load(cls, path: Path) -> EpisodeRecord:
        """Read a record that `save` wrote.

        Raises:
            InputError: the file is missing, damaged or not an episode record.
        """
        data: dict[str, Any] = read_npz(path)
        try:
            ending, direction, constants, fingers, shape, axis = json.loads(str(data["meta"]))
            mesh = _with_prefix(data, "mesh.")
            return cls(
                **{name: data[name] for name in ARRAY_FIELDS},
                reward_terms=_with_prefix(data, "reward."),
                contacts=ContactTable(**{name: data[f"contacts.{name}"] for name in CONTACT_FIELDS}),
                ending=ending,
                direction=direction,
                constants=constants,
                trace=_with_prefix(data, "trace."),
                policy=_with_prefix(data, "policy."),
                fingers=tuple(fingers),
                object_shape=ObjectMesh.from_arrays(mesh) if mesh else shape,
                axis=tuple(axis),
            )
        except (LookupError, ValueError, TypeError, AttributeError) as error:
            raise InputError(f"{path}: not an episode recorded by evaluate (*.npz): {error}") from error


def _with_prefix(data: dict[str, Array], prefix: str) -> dict[str, Array]:
    return {name.removeprefix(prefix): value for name, value in data.items() if name.startswith(prefix)}


CONTACT_FIELDS = tuple(f.name for f in dataclasses.fields(ContactTable))
ARRAY_FIELDS = tuple(field.name for field in dataclasses.fields(EpisodeRecord) if field.type == "Array")
