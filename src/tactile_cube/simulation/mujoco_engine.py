"""Hand and cube in MuJoCo."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.hand import Hand
from tactile_cube.simulation.constants import EpisodeConstants, Start
from tactile_cube.simulation.contact import Contact, named_contact
from tactile_cube.simulation.drive import HandDrive
from tactile_cube.simulation.engine import OBJECT_STATE
from tactile_cube.simulation.mujoco_model import HandSpec
from tactile_cube.simulation.options import SimulationOptions

Array = NDArray[np.float64]


class MujocoEngine:
    """See `Engine`. Newton's method on soft contacts; rotors are native, tendons are equality constraints."""

    def __init__(self, hand: Hand, options: SimulationOptions, drive: HandDrive) -> None:
        """Describes the bodies; the model comes with each episode."""
        self._spec = HandSpec(hand, options, drive)
        self._dofs = hand.links_per_finger * len(hand.fingers)
        self._control, self._memory = drive.plant.kernel.control_step, drive.memory

    def place(self, constants: EpisodeConstants, start: Start, q: Array, v: Array) -> None:
        """See `Engine.place`."""
        self._model = self._spec.compile(constants)
        self._data = mujoco.MjData(self._model)
        x, y, z, w = np.asarray(start.cube_quaternion)
        turn = Rotation.from_quat(np.array(start.cube_quaternion)).inv()
        self._data.qpos[:] = [*q.ravel(), *np.asarray(start.cube_position), w, x, y, z]
        angular = turn.apply(np.array(start.cube_angular_velocity))
        self._data.qvel[:] = [*v.ravel(), *np.asarray(start.cube_linear_velocity), *angular]
        data = self._data
        self._driven = data.qpos[: self._dofs], data.qvel[: self._dofs], data.qfrc_applied[: self._dofs]
        self.q, self.v = (joints.reshape(q.shape) for joints in self._driven[:2])

    def set_gravity(self, acceleration: Array) -> None:
        """See `Engine.set_gravity`."""
        self._model.opt.gravity[:] = acceleration

    def run(self, steps: int, wrench: Array | None, record: bool) -> Array | None:
        """See `Engine.run`."""
        self._data.body("cube").xfrc_applied[:] = 0.0 if wrench is None else wrench
        states = np.empty((steps + 1, OBJECT_STATE)) if record else None
        for i in range(steps):
            if states is not None:
                states[i] = self._free_joint()
            self._control(i, *self._driven, self._memory)
            mujoco.mj_step(self._model, self._data)
        if states is None:
            return None
        states[steps] = self._free_joint()
        return _in_world(states)

    def cube_state(self) -> Array:
        """See `Engine.cube_state`."""
        return _in_world(self._free_joint()[None]).ravel()

    def gaps(self) -> list[float]:
        """See `Engine.gaps`."""
        gaps: list[float] = self._data.contact.dist.tolist()
        return gaps

    def contacts(self) -> list[Contact]:
        """See `Engine.contacts`."""
        return [self._contact(index) for index in range(self._data.ncon)]

    def close(self) -> None:
        """Nothing to end: MuJoCo has no server."""

    def _free_joint(self) -> Array:
        """State of the cube (13,) as MuJoCo has it."""
        return np.concatenate([self._data.qpos[self._dofs :], self._data.qvel[self._dofs :]])

    def _contact(self, index: int) -> Contact:
        """One contact with names; MuJoCo's force is that on the second shape."""
        contact, wrench = self._data.contact[index], np.zeros(6)
        mujoco.mj_contactForce(self._model, self._data, index, wrench)
        frame = np.reshape(contact.frame, (3, 3))
        names = [self._model.geom(shape).name.partition("#")[0].partition(" ") for shape in contact.geom]
        first, second = ((body, link) for body, _, link in names)
        friction = wrench[1:3] @ frame[1:]
        middle, normal = np.array(contact.pos), np.array(frame[0])
        return named_contact(first, second, middle, normal, float(contact.dist), float(wrench[0]), friction)


def _in_world(states: Array) -> Array:
    """Rows of MuJoCo's free joint (n, 13) as `OBJECT_STATE`: quaternion xyzw, angular velocity in the world."""
    quaternion: Any = states[:, [4, 5, 6, 3]]
    angular = Rotation.from_quat(quaternion).apply(states[:, 10:])
    return np.concatenate([states[:, :3], quaternion, states[:, 7:10], angular], axis=1)
