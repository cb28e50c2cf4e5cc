"""Hand and cube in MuJoCo."""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.hand import Hand
from tactile_cube.simulation.constants import Array, EpisodeConstants, Start
from tactile_cube.simulation.drive import HandDrive
from tactile_cube.simulation.engine import OBJECT_STATE, Contact, SimulationOptions, named_contact
from tactile_cube.simulation.mujoco_model import HandSpec


class MujocoEngine:
    """See `Engine`. Newton's method on soft contacts; rotors are native, tendons are equality constraints."""

    def __init__(self, hand: Hand, options: SimulationOptions, drive: HandDrive) -> None:
        self._spec = HandSpec(hand, options, drive)
        self._hand = hand
        self._dofs = hand.links_per_finger * len(hand.fingers)
        self._control, self._memory = drive.plant.kernel.control_step, drive.memory

    def place(self, constants: EpisodeConstants, start: Start, q: Array, v: Array) -> None:
        self._model = self._spec.compile(constants)
        self._data = mujoco.MjData(self._model)
        x, y, z, w = np.asarray(start.cube_quaternion)
        turn = Rotation.from_quat(np.array(start.cube_quaternion)).inv()
        self._data.qpos[:] = [*q.ravel(), *np.asarray(start.cube_position), w, x, y, z]
        angular = turn.apply(np.array(start.cube_angular_velocity))
        self._data.qvel[:] = [*v.ravel(), *np.asarray(start.cube_linear_velocity), *angular]
        data = self._data
        self._driven = data.qpos[: self._dofs], data.qvel[: self._dofs], data.qfrc_applied[: self._dofs]
        self._free_joint = data.qpos[self._dofs :], data.qvel[self._dofs :]
        self._cube = int(self._model.geom("cube").id)
        self._fingers = [self._touching(shape) for shape in range(self._model.ngeom)]
        self.q, self.v = (joints.reshape(q.shape) for joints in self._driven[:2])

    def set_gravity(self, acceleration: Array) -> None:
        self._model.opt.gravity[:] = acceleration

    def run(self, steps: int, wrench: Array | None, record: bool) -> Array | None:
        self._data.body("cube").xfrc_applied[:] = 0.0 if wrench is None else wrench
        states = np.empty((steps + 1, OBJECT_STATE)) if record else None
        for i in range(steps):
            if states is not None:
                states[i] = self.cube_state()
            self._control(i, *self._driven, self._memory)
            mujoco.mj_step(self._model, self._data)
        if states is not None:
            states[steps] = self.cube_state()
        return states

    def cube_state(self) -> Array:
        state, pose, velocity = np.empty(OBJECT_STATE), *self._free_joint
        state[:3], state[3:6], state[6] = pose[:3], pose[4:], pose[3]  # wxyz in MuJoCo
        state[7:10] = velocity[:3]
        mujoco.mju_rotVecQuat(state[10:], velocity[3:], pose[3:])  # of the cube's frame in MuJoCo
        return state

    def gaps(self) -> list[float]:
        gaps: list[float] = self._data.contact.dist.tolist()
        return gaps

    def contacts(self) -> list[Contact]:
        found = []
        for index in range(self._data.ncon):
            contact, wrench = self._data.contact[index], np.zeros(6)
            mujoco.mj_contactForce(self._model, self._data, index, wrench)  # on the second shape
            frame = np.reshape(contact.frame, (3, 3))
            first, second = map(self._names, contact.geom.tolist())
            place, friction = (np.array(contact.pos), np.array(frame[0])), wrench[1:3] @ frame[1:]
            found.append(named_contact(first, second, *place, float(contact.dist), float(wrench[0]), friction))
        return found

    def normal_forces(self) -> Array:
        force, wrench = np.zeros((2, len(self._hand.fingers))), np.zeros(6)
        for index, (first, second) in enumerate(self._data.contact.geom.tolist()):
            finger = self._fingers[first] or self._fingers[second]
            if finger is not None and self._cube in (first, second):
                mujoco.mj_contactForce(self._model, self._data, index, wrench)
                force[finger] += wrench[0]
        return force

    def close(self) -> None:
        """Nothing to end: MuJoCo has no server."""

    def _names(self, shape: int) -> tuple[str, str]:
        """The body (finger, `cube` or `table`) and link of a shape."""
        body, _, link = self._model.geom(shape).name.partition("#")[0].partition(" ")
        return body, link

    def _touching(self, shape: int) -> tuple[int, int] | None:
        """Of a finger's shape: 1 for the tip's and 0 for another link's, and which finger; else None."""
        body, link = self._names(shape)
        found = [k for k, finger in enumerate(self._hand.fingers) if finger.name == body]
        return (int(link == self._hand.fingers[found[0]].links[-1]), found[0]) if found else None
