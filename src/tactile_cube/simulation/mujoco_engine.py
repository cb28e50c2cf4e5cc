"""Hand and object in MuJoCo, compiled anew for each episode."""

from itertools import combinations
from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.hand import Hand
from tactile_cube.hand.object_mesh import NamedShape, ObjectMesh, straight_half, unit_inertia
from tactile_cube.hand.urdf import CollisionShape
from tactile_cube.simulation.constants import Array, EpisodeConstants, Start
from tactile_cube.simulation.engine import (
    OBJECT_STATE,
    SKIN_RELAXATION,
    Contact,
    HandDrive,
    SimulationOptions,
    Surface,
    named_contact,
    surfaces,
)

TABLE_HALF_SIZE = (0.25, 0.25, 0.02)  # [m]
SOLVER_TOLERANCE = 1e-10
UNSAID = [np.nan, 0.0, 0.0, 0.0, 0.0, 0.0]
"""An inertia with products that MuJoCo is to take for none: the moments then hold."""
RIGID = [0.9999, 0.9999, 1e-3, 0.5, 2.0]  # impedance of tendons and joint stops, as hard as MuJoCo has it


class HandSpec:
    """Description of one world, from which a model is compiled for each episode.

    The joints come first in the state, finger by finger, q1..q4 each; the cube's free joint is last.
    """

    def __init__(self, hand: Hand, options: SimulationOptions, drive: HandDrive) -> None:
        self._hand, self._drive = hand, drive
        self.spec = mujoco.MjSpec()
        self.spec.compiler.degree = False
        option = self.spec.option
        option.timestep = options.dt
        option.integrator = mujoco.mjtIntegrator.mjINT_EULER
        option.cone, option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, IMPRATIO
        option.solver, option.tolerance = mujoco.mjtSolver.mjSOL_NEWTON, SOLVER_TOLERANCE
        option.iterations = options.solver_iterations
        option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        self._shapes: dict[str, str] = {}
        self._links = [self._add_finger(k) for k in range(len(hand.fingers))]
        body = self.spec.worldbody.add_body(name="cube", explicitinertial=True)
        body.add_freejoint()
        box = {"type": mujoco.mjtGeom.mjGEOM_BOX, "contype": 0, "conaffinity": 0}
        self._cube = body, body.add_geom(name="cube", size=(0.04, 0.04, 0.04), **box)
        self._table = self.spec.worldbody.add_geom(name="table", size=TABLE_HALF_SIZE, **box)
        self._shapes |= {"cube": "cube", "table": "table"}
        self._add_palm()
        # everything meets everything but its own finger, the palm the cube alone; the order is fixed
        self._pairs = [(a, b) for a, b in combinations(self._shapes, 2) if a.split()[0] != b.split()[0]]
        self._pairs = [(a, b) for a, b in self._pairs if not b.startswith("palm ") or a == "cube"]
        for a, b in self._pairs:
            self.spec.add_pair(name=f"{a} {b}", geomname1=a, geomname2=b, condim=CONDIM)
        self._mesh: Any = None

    def compile(self, constants: EpisodeConstants) -> Any:
        """Compile the model of an episode."""
        self._set_links()
        self._set_objects(constants)
        known = surfaces(constants)
        touching = [known[self._shapes[a]].on(known[self._shapes[b]]) for a, b in self._pairs]
        for pair, surface in zip(self.spec.pairs, touching, strict=True):
            pair.friction = [surface.lateral, surface.lateral, surface.spinning, 0.0, 0.0]  # the last two: rolling
        model = self.spec.compile()
        for (a, b), surface in zip(self._pairs, touching, strict=True):
            set_contact(model, model.pair(f"{a} {b}").id, surface)
        return model

    def _add_finger(self, k: int) -> list[tuple[Any, Any]]:
        view, finger = self._drive.view, self._hand.fingers[k]
        position, rotation = self._hand.base_in_world(k)
        parent = self.spec.worldbody.add_body(name=f"{finger.name} base", pos=position, quat=_wxyz(rotation))
        rigid = [2.0 * self.spec.option.timestep, 1.0]
        parts = []
        for i, link in enumerate(finger.links):
            place = {"pos": view("placement_translation")[k, i], "quat": _wxyz(view("placement_rotation")[k, i])}
            body = parent.add_body(name=f"{finger.name} {link}", explicitinertial=True, **place)
            joint = body.add_joint(
                name=f"{finger.name}_q{i + 1}",
                type=mujoco.mjtJoint.mjJNT_HINGE,
                axis=view("axis")[k, i],
                limited=mujoco.mjtLimited.mjLIMITED_TRUE,
                range=finger.limits[i].tolist(),
                solref_limit=rigid,
                solimp_limit=RIGID,
            )
            for number, shape in enumerate(finger.shapes[i]):
                name = f"{finger.name} {link}" + (f"#{number}" if number else "")
                self._add_shape(body, name, shape)
                self._shapes[name] = "tip" if link == finger.links[-1] else "link"
            parts.append((body, joint))
            parent = body
        for follower, leader in self._hand.coupled():
            tendon = self.spec.add_equality(
                type=mujoco.mjtEq.mjEQ_JOINT,
                objtype=mujoco.mjtObj.mjOBJ_JOINT,
                name1=f"{finger.name}_q{follower + 1}",
                name2=f"{finger.name}_q{leader + 1}",
                solref=rigid,
                solimp=RIGID,
            )
            tendon.data[:5] = [0.0, 1.0, 0.0, 0.0, 0.0]
        return parts

    def _add_palm(self) -> None:
        """Add what no joint moves, where the object touches it."""
        if self._hand.palm_contact:
            palm = self.spec.worldbody.add_body(name="palm", pos=self._hand.position, quat=_wxyz(self._hand.rotation))
            for number, shape in enumerate(self._hand.palm):
                self._add_shape(palm, f"palm #{number}", shape)
                self._shapes[f"palm #{number}"] = "link"

    def _add_shape(self, body: Any, name: str, shape: CollisionShape) -> None:
        """Add a link's collision geom; capsules and cylinders have half their length in MuJoCo."""
        kinds, size = mujoco.mjtGeom, shape.size
        kind, numbers = {
            "capsule": (kinds.mjGEOM_CAPSULE, [size[0], 0.5 * size[-1], 0.0]),
            "cylinder": (kinds.mjGEOM_CYLINDER, [size[0], 0.5 * size[-1], 0.0]),
            "sphere": (kinds.mjGEOM_SPHERE, [size[0], 0.0, 0.0]),
            "box": (kinds.mjGEOM_BOX, [0.5 * edge for edge in size]),
            "mesh": (kinds.mjGEOM_MESH, [0.0, 0.0, 0.0]),
        }[shape.kind]
        more: dict[str, Any] = {"quat": _wxyz(shape.rotation)} if not np.array_equal(shape.rotation, np.eye(3)) else {}
        if shape.kind == "mesh":
            self.spec.add_mesh(name=name, file=shape.file, scale=list(size))
            more["meshname"] = name
        body.add_geom(name=name, type=kind, size=numbers, pos=shape.position, contype=0, conaffinity=0, **more)

    def _set_links(self) -> None:
        """Set masses and rotors of the links; effects may have changed them for this episode."""
        view = self._drive.view
        for k, finger in enumerate(self._links):
            for i, (body, joint) in enumerate(finger):
                body.mass, body.ipos = view("mass")[k, i], view("com")[k, i]
                body.fullinertia = _six(view("inertia")[k, i])
                joint.armature = view("armature")[k, i]

    def _set_objects(self, constants: EpisodeConstants) -> None:
        """Set size and mass of the cube; without a table it lies too far away to be met."""
        body, shape = self._cube
        size, mass = np.asarray(constants.cube_size), constants.cube_mass
        kind = constants.object_shape
        if isinstance(kind, ObjectMesh):
            self._mesh = self._mesh or self.spec.add_mesh(name="object")
            self._mesh.uservert, self._mesh.userface = (
                (kind.vertices * size).ravel().tolist(),
                kind.faces.ravel().tolist(),
            )
            shape.type, shape.meshname = mujoco.mjtGeom.mjGEOM_MESH, "object"
        else:
            shape.meshname, body.fullinertia = "", UNSAID  # of a mesh before
            shape.type, shape.size = _geometry(kind, 0.5 * size)
        body.mass, body.ipos = mass, np.asarray(constants.cube_com)
        if kind == "box":
            body.inertia = mass / 12.0 * (np.sum(size**2) - size**2)
        elif isinstance(kind, ObjectMesh):
            body.inertia, body.fullinertia = np.zeros(3), _six(mass * kind.inertia(size))
        else:
            body.inertia = mass * np.diag(unit_inertia(kind, size))
        height = -1e3 if constants.table_height is None else constants.table_height
        self._table.pos = [0.0, 0.0, height - TABLE_HALF_SIZE[2]]


def _geometry(kind: NamedShape, half: Array) -> tuple[Any, Array]:
    kinds = mujoco.mjtGeom
    if kind == "box":
        return kinds.mjGEOM_BOX, half
    if kind == "cylinder":
        return kinds.mjGEOM_CYLINDER, np.array([half[0], half[2], 0.0])
    straight = straight_half(half)
    known = kinds.mjGEOM_CAPSULE if straight > 0.0 else kinds.mjGEOM_SPHERE
    return known, np.array([half[0], straight, 0.0])


def _wxyz(rotation: Array) -> Array:
    """Return MuJoCo's quaternion of a rotation matrix."""
    return np.asarray(Rotation.from_matrix(rotation).as_quat())[[3, 0, 1, 2]]


def _six(inertia: Array) -> list[float]:
    """Return Ixx, Iyy, Izz, Ixy, Ixz, Iyz."""
    return [float(inertia[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]


IMPRATIO = 100.0  # regularisation of the normal force over that of friction
HARD = 2e-5  # compliance of surfaces that are called hard [m/N]: 3 N sink in by 60 um
HARD_RELAXATION = 2e-2
"""Damping over stiffness of hard surfaces [s]. A body overlaps by up to its way in one step before it is met, which the
spring gives back as speed unless that takes much longer than a step."""
CONDIM = 4  # normal force, two of lateral friction and a torque against spinning, under one elliptic cone
LEAST_IMPEDANCE, MOST_IMPEDANCE = 1e-4, 0.9999


def set_contact(model: Any, pair: int, surface: Surface) -> None:
    """Write spring and damper of a pair into a compiled model."""
    bodies = model.geom_bodyid[[model.pair_geom1[pair], model.pair_geom2[pair]]]
    weight = float(model.body_invweight0[bodies, 0].sum())
    dt, stiffness = float(model.opt.timestep), 1.0 / max(surface.compliance, HARD)
    damping = stiffness * (SKIN_RELAXATION if surface.compliance > HARD else HARD_RELAXATION)
    regularisation = 1.0 / (stiffness * dt**2 + damping * dt)  # R [1/kg]
    k, b = stiffness * regularisation, (damping + stiffness * dt) * regularisation  # [1/s^2], [1/s]
    impedance = float(np.clip(weight / (weight + regularisation), LEAST_IMPEDANCE, MOST_IMPEDANCE))
    model.pair_solimp[pair] = [impedance, impedance, 1e-3, 0.5, 2.0]
    # MuJoCo divides the one by d^2 and takes d times the gap; it divides the other by d
    model.pair_solref[pair] = [-k * impedance, -b * impedance]


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
        """End nothing: MuJoCo has no server."""

    def _names(self, shape: int) -> tuple[str, str]:
        """Return the body (finger, `cube` or `table`) and link of a geom."""
        body, _, link = self._model.geom(shape).name.partition("#")[0].partition(" ")
        return body, link

    def _touching(self, shape: int) -> tuple[int, int] | None:
        """Return for a finger's geom 1 if it is the tip's, else 0, and the finger; None for another geom."""
        body, link = self._names(shape)
        found = [k for k, finger in enumerate(self._hand.fingers) if finger.name == body]
        return (int(link == self._hand.fingers[found[0]].links[-1]), found[0]) if found else None
