"""A mechanism as a tree of links: the numbers behind its equations of motion, read from any URDF."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tactile_cube.hand.rigid_body_equations import WORK_COLUMNS, Array, Integers, mass_matrix_and_bias
from tactile_cube.hand.urdf_elements import Mimic, Placement
from tactile_cube.hand.urdf_tree import read_movable_joints

__all__ = ["Mimic", "RigidBodyTree"]


@dataclass(frozen=True)
class RigidBodyTree:
    """N degrees of freedom (dofs), parents first, of which n are actuated and the others follow an actuated one.

    A dof's position is `ratio * q[follow] + offset` with q (n,) the actuated positions; for an actuated joint itself
    ratio is 1 and offset 0. Frames: each link's frame sits in its joint; links joined by fixed joints are merged.

    Attributes:
        joint_names: (n) actuated joints in the order of every actuated quantity.
        dof_names: (N) all movable joints.
        link_names: (N) the links that they carry.
        homes: the dof that each link of the URDF moves with, -1 for none, and where its frame is in that dof's link.
        follow: (N,) index of the actuated joint that a dof follows.
        ratio: (N,).
        offset: (N,) [rad or m].
        parent: (N,) index of the parent link, -1 for the base.
        prismatic: (N,) 1 where the joint slides, 0 where it turns.
        placement_rotation: (N, 3, 3) joint frame in the parent link's frame.
        placement_translation: (N, 3) [m].
        axis: (N, 3) unit axis in the joint frame.
        mass: (N,) [kg].
        com: (N, 3) centre of mass in the link's frame [m].
        inertia: (N, 3, 3) about the centre of mass, in the link's axes [kg m^2].
        lower: (N,) joint limits [rad or m], infinite where the URDF has none.
        upper: (N,).
        corrected: what was changed to make a mechanism of the description, a line each.
    """

    joint_names: tuple[str, ...]
    dof_names: tuple[str, ...]
    link_names: tuple[str, ...]
    homes: Mapping[str, tuple[int, Placement]]
    follow: Integers
    ratio: Array
    offset: Array
    parent: Integers
    prismatic: Integers
    placement_rotation: Array
    placement_translation: Array
    axis: Array
    mass: Array
    com: Array
    inertia: Array
    lower: Array
    upper: Array
    corrected: tuple[str, ...] = ()

    @classmethod
    def from_urdf(
        cls, text: str, joints: Sequence[str] | None = None, coupled: Mapping[str, Mimic] | None = None
    ) -> RigidBodyTree:
        """Read a mechanism.

        Args:
            text: the URDF.
            joints: the actuated joints in the order wanted; by default all that do not mimic another, in the order of
                the file. A movable joint that is neither listed nor coupled is locked at zero.
            coupled: joints that follow another one, beside (and in place of) the URDF's own <mimic>.

        Raises:
            InputError: no tree, an unknown joint, a coupling to a joint that is not actuated, impossible masses.
        """
        dofs, homes, actuated, corrected = read_movable_joints(text, joints, coupled)
        leaders = [actuated.index(d.coupling.joint if d.coupling else d.name) for d in dofs]
        index = {d.link: k for k, d in enumerate(dofs)}
        return cls(
            joint_names=actuated,
            dof_names=tuple(d.name for d in dofs),
            link_names=tuple(d.link for d in dofs),
            homes={link: (index.get(carrier, -1), place) for link, (carrier, place) in homes.items()},
            follow=np.array(leaders, dtype=np.int64),
            ratio=np.array([d.coupling.ratio if d.coupling else 1.0 for d in dofs]),
            offset=np.array([d.coupling.offset if d.coupling else 0.0 for d in dofs]),
            parent=np.array([index.get(d.parent, -1) for d in dofs], dtype=np.int64),
            prismatic=np.array([d.prismatic for d in dofs], dtype=np.int64),
            placement_rotation=np.stack([d.placement.rotation for d in dofs]),
            placement_translation=np.stack([d.placement.translation for d in dofs]),
            axis=np.stack([d.axis for d in dofs]),
            mass=np.array([d.body.mass for d in dofs]),
            com=np.stack([d.body.com for d in dofs]),
            inertia=np.stack([d.body.inertia for d in dofs]),
            lower=np.array([d.lower for d in dofs]),
            upper=np.array([d.upper for d in dofs]),
            corrected=corrected,
        )

    @property
    def dofs(self) -> int:
        """N, all degrees of freedom, coupled ones included."""
        return len(self.dof_names)

    @property
    def coupling(self) -> Array:
        """J (N, n): velocities of all dofs from those of the actuated joints."""
        matrix = np.zeros((self.dofs, len(self.joint_names)))
        matrix[np.arange(self.dofs), self.follow] = self.ratio
        return matrix

    def expand(self, q: Array) -> Array:
        """Return the positions of all dofs (N,) from those of the actuated joints (n,)."""
        positions = np.asarray(q, dtype=float)[self.follow]
        return np.asarray(self.ratio * positions + self.offset)

    def equations(self, q: Array, v: Array, gravity: Array) -> tuple[Array, Array]:
        """Return M (N, N) [kg m^2] and h (N,) [N m] at positions q, velocities v (N,); gravity (3,) in the base."""
        M, h = np.zeros((self.dofs, self.dofs)), np.zeros(self.dofs)
        work = np.zeros((self.dofs + 1, WORK_COLUMNS))
        state = (np.asarray(q, dtype=float), np.asarray(v, dtype=float), np.asarray(gravity, dtype=float))
        numbers = (self.placement_rotation, self.placement_translation, self.axis, self.mass, self.com, self.inertia)
        mass_matrix_and_bias(self.parent, self.prismatic, *numbers, *state, work, M, h)
        return M, h

    def inverse_dynamics(self, q: Array, v: Array, a: Array, gravity: Array) -> Array:
        """Return torques (samples, n) [N m] of the drives for q, v, a (samples, n) of actuated joints, rotors apart."""
        J = self.coupling
        taken = np.empty_like(q)
        for k, (position, speed) in enumerate(zip(q, v, strict=True)):
            M, h = self.equations(self.expand(position), J @ speed, gravity)
            taken[k] = J.T @ (M @ (J @ a[k]) + h)
        return taken

    def actuated_mass_matrix(self, q: Array) -> Array:
        """Return J^T M J (n, n) [kg m^2] at actuated positions q (n,): the inertia that drives feel, rotors apart."""
        M, _ = self.equations(self.expand(q), np.zeros(self.dofs), np.zeros(3))
        J = self.coupling
        return np.asarray(J.T @ M @ J)
