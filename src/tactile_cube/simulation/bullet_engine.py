"""Hand, cube and table in PyBullet, placed so that nothing of the past remains.

One multibody per finger: the solver couples the rows of everything that hangs on one multibody, and four small ones are
several times faster than one hand.
"""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pybullet
from scipy.spatial.transform import Rotation

from tactile_cube.errors import InputError
from tactile_cube.hand import Hand
from tactile_cube.hand.object_mesh import NamedShape, ObjectMesh, ObjectShape, straight_half, unit_inertia
from tactile_cube.simulation.constants import Array, EpisodeConstants, Start
from tactile_cube.simulation.engine import (
    OBJECT_STATE,
    SKIN_RELAXATION,
    Contact,
    HandDrive,
    SimulationOptions,
    named_contact,
)

_TABLE_SIZE = np.array([0.5, 0.5, 0.04])
TILTED = 0.05
"""Products of inertia that Bullet may neglect, as a share of the smallest moment: moments are then right to 1 %."""
_ALL_GROUPS = 0xFFFF
_FIRST_FINGER_GROUP = 0x10
"""Collision group of the first finger, one bit for each; Bullet gives bits below to bodies of its own accord."""
_CUBE_GROUP, _PALM_GROUP = 0x1, 0x8  # Bullet's own of moving bodies; one that nothing else here has
_URDF_FLAGS = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_IGNORE_VISUAL_SHAPES
_NO_DAMPING = {"linearDamping": 0.0, "angularDamping": 0.0, "jointDamping": 0.0}


def connect(options: SimulationOptions) -> int:
    """Start a physics server of its own in this process and return the id of its client.

    Its broadphase compares all pairs of boxes at every step. Bullet's default, a tree, is faster only with more bodies:
    for a hand it takes 8 % longer, with the same contacts.
    """
    client = int(pybullet.connect(pybullet.DIRECT))
    pybullet.resetSimulation(pybullet.RESET_USE_SIMPLE_BROADPHASE, physicsClientId=client)
    pybullet.setPhysicsEngineParameter(
        fixedTimeStep=options.dt,
        numSolverIterations=options.solver_iterations,
        numSubSteps=0,
        deterministicOverlappingPairs=1,
        enableFileCaching=0,
        physicsClientId=client,
    )
    return client


def load_chain(client: int, urdf: str, position: Array, rotation: Array) -> int:
    """Load a robot with a fixed base and free joints: no motors, no damping. Return its body id."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "chain.urdf"
        file.write_text(urdf, encoding="utf-8")
        quaternion = Rotation.from_matrix(rotation).as_quat().tolist()
        body = pybullet.loadURDF(
            str(file), list(position), quaternion, useFixedBase=True, flags=_URDF_FLAGS, physicsClientId=client
        )
    for joint in range(-1, pybullet.getNumJoints(body, physicsClientId=client)):
        pybullet.changeDynamics(body, joint, **_NO_DAMPING, physicsClientId=client)
        if joint >= 0:
            pybullet.setJointMotorControl2(body, joint, pybullet.VELOCITY_CONTROL, force=0.0, physicsClientId=client)
    return int(body)


def com_arm(constants: EpisodeConstants, quaternion: Array) -> Array:
    """Return the vector from the cube's centre to its centre of mass, in the world (3,) [m]."""
    com = np.asarray(constants.cube_com)
    return Rotation.from_quat(quaternion).as_matrix() @ com if com.any() else np.zeros(3)


class BulletEngine:
    """See `Engine`. Sequential impulses; rotors and tendons are worked into the torques, see `spin_inertia`.

    Attributes:
        client: PyBullet's client id.
        fingers: Body ids of the fingers.
        cube: Body id of the cube.
        table: Body id of the table, -1 without one.
        palm: Body id of the palm, -1 where nothing touches it.
    """

    def __init__(self, hand: Hand, options: SimulationOptions, drive: HandDrive) -> None:
        self._hand, self._drive = hand, drive
        self.client = connect(options)
        self._here = {"physicsClientId": self.client}
        half = (0.5 * _TABLE_SIZE).tolist()
        self._table_shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, **self._here)
        self._cube_shape = -1
        self._cube_size = self._cube_com = np.zeros(3)
        self._cube_kind: ObjectShape = "box"
        self._links = list(range(hand.links_per_finger))
        self._bare = [[link for link in self._links if not finger.shapes[link]] for finger in hand.fingers]
        self.table, self.cube = self._new_table(0.0), self._new_table(0.0)  # hold the places before the fingers'
        bases = [hand.base_in_world(k) for k in range(len(hand.fingers))]
        self.fingers = [
            load_chain(self.client, urdf, *base) for urdf, base in zip(drive.finger_urdfs(), bases, strict=True)
        ]
        self.palm = load_chain(self.client, hand.palm_urdf(), hand.position, hand.rotation) if hand.palm_contact else -1
        self._inertias = [
            [pybullet.getDynamicsInfo(body, link, **self._here)[2] for link in self._links] for body in self.fingers
        ]
        for body, bare in zip(self.fingers, self._bare, strict=True):  # Bullet boxes links without a shape too
            for link in (-1, *bare):
                pybullet.setCollisionFilterGroupMask(body, link, 0, 0, **self._here)
        self.q, self.v = np.zeros((2, len(hand.fingers), hand.links_per_finger))

    def place(self, constants: EpisodeConstants, start: Start, q: Array, v: Array) -> None:
        self._constants = constants
        self.q[:], self.v[:] = q, v
        # the table goes last: a new body gets the place in the broadphase that was left last, and the solver goes
        # through contacts in the order of these places, which must be the same in every episode
        for body in (self.cube, self.table):
            if body >= 0:
                pybullet.removeBody(body, **self._here)
        self.table = -1
        if constants.table_height is not None:  # even a distant body takes 6 % of the time
            self.table = self._new_table(constants.table_height)
            friction = {"lateralFriction": constants.table_friction}
            pybullet.changeDynamics(self.table, -1, **friction, **self._here)
        self._set_cube(constants, start)
        for body, position, velocity in zip(self.fingers, q, v, strict=True):
            for k in self._links:
                pybullet.resetJointState(body, k, position[k], velocity[k], **self._here)
        self._set_links(constants)
        self._forget_contacts()

    def set_gravity(self, acceleration: Array) -> None:
        pybullet.setGravity(*acceleration, **self._here)

    def run(self, steps: int, wrench: Array | None, record: bool) -> Array | None:
        states = np.empty((steps + 1, OBJECT_STATE)) if record else None
        control, memory = self._drive.plant.kernel.control_step, self._drive.memory
        torque = np.zeros_like(self.q)
        for i in range(steps):
            control(i, self.q.reshape(-1), self.v.reshape(-1), torque.reshape(-1), memory)
            for body, forces in zip(self.fingers, torque.tolist(), strict=True):
                pybullet.setJointMotorControlArray(
                    body, self._links, pybullet.TORQUE_CONTROL, forces=forces, **self._here
                )
            if states is not None:
                states[i] = self.cube_state()
            if wrench is not None:
                centre, _ = pybullet.getBasePositionAndOrientation(self.cube, **self._here)
                force, torque_on, frame = wrench[:3].tolist(), wrench[3:].tolist(), pybullet.WORLD_FRAME
                pybullet.applyExternalForce(self.cube, -1, force, centre, frame, **self._here)
                pybullet.applyExternalTorque(self.cube, -1, torque_on, frame, **self._here)
            pybullet.stepSimulation(**self._here)
            read = [one for body in self.fingers for one in pybullet.getJointStates(body, self._links, self.client)]
            self.q.reshape(-1)[:] = [state[0] for state in read]
            self.v.reshape(-1)[:] = [state[1] for state in read]
        if states is not None:
            states[steps] = self.cube_state()
        return states

    def cube_state(self) -> Array:
        position, quaternion = pybullet.getBasePositionAndOrientation(self.cube, **self._here)
        linear, angular = pybullet.getBaseVelocity(self.cube, **self._here)
        state = np.array([*position, *quaternion, *linear, *angular])
        if np.asarray(self._constants.cube_com).any():  # Bullet speaks of the centre of mass
            arm = com_arm(self._constants, state[3:7])
            state[:3] -= arm
            state[7:10] -= np.cross(state[10:13], arm)
        return state

    def gaps(self) -> list[float]:
        return [row[8] for row in pybullet.getContactPoints(**self._here)]

    def contacts(self) -> list[Contact]:
        fixed = ((self.cube, "cube"), (self.table, "table"), (self.palm, "palm"))
        names = {(body, -1): (name, "") for body, name in fixed}
        for body, finger in zip(self.fingers, self._hand.fingers, strict=True):
            names |= {(body, k): (finger.name, link) for k, link in enumerate(finger.links)}
        found = []
        for row in pybullet.getContactPoints(**self._here):
            first, second = names[row[1], row[3]], names[row[2], row[4]]
            middle = 0.5 * (np.array(row[5]) + np.array(row[6]))
            friction_on_first = row[10] * np.array(row[11]) + row[12] * np.array(row[13])
            found.append(named_contact(first, second, middle, -np.array(row[7]), row[8], row[9], -friction_on_first))
        return found

    def normal_forces(self) -> Array:
        force, tip = np.zeros((2, len(self.fingers))), self._links[-1]
        for row in pybullet.getContactPoints(**self._here):
            body, link = (row[2], row[4]) if row[1] == self.cube else (row[1], row[3])
            if self.cube in row[1:3] and body in self.fingers:
                force[int(link == tip), self.fingers.index(body)] += row[9]
        return force

    def close(self) -> None:
        """End the physics server."""
        if pybullet.isConnected(self.client):
            pybullet.disconnect(self.client)

    def _new_table(self, height: float) -> int:
        centre = [0.0, 0.0, height - 0.5 * float(_TABLE_SIZE[2])]
        return int(
            pybullet.createMultiBody(
                0.0, self._table_shape, basePosition=centre, useMaximalCoordinates=True, **self._here
            )
        )

    def _set_cube(self, constants: EpisodeConstants, start: Start) -> None:
        """Make a new body each time: Bullet keeps the world inertia of a used one for a step after it is moved.

        It is a plain rigid body; as a multibody without links it would make the solver 8 % slower. Its origin is its
        centre of mass. The skin of the fingertips is set on the cube, since Bullet cannot remove it again.
        """
        arm = com_arm(constants, np.asarray(start.cube_quaternion))
        self.cube = int(
            pybullet.createMultiBody(
                constants.cube_mass,
                self._shape_of(constants),
                basePosition=list(np.asarray(start.cube_position) + arm),
                baseOrientation=list(np.asarray(start.cube_quaternion)),
                useMaximalCoordinates=True,
                **self._here,
            )
        )
        pybullet.changeDynamics(
            self.cube,
            -1,
            lateralFriction=constants.cube_friction,
            spinningFriction=0.0,
            rollingFriction=0.0,
            activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
            **_NO_DAMPING,
            **self._here,
        )
        if constants.object_shape not in ("box", "cylinder"):  # Bullet takes that of a box for the others
            # without its mass it would lose the inertia; without a margin a mesh ends where its corners are
            inertia = constants.cube_mass * unit_inertia(constants.object_shape, np.asarray(constants.cube_size))
            heavy = {"mass": constants.cube_mass, "localInertiaDiagonal": np.diag(inertia).tolist()}
            heavy |= {"collisionMargin": 0.0} if isinstance(constants.object_shape, ObjectMesh) else {}
            pybullet.changeDynamics(self.cube, -1, **heavy, **self._here)
        if constants.tip_compliance > 0.0:
            skin = {
                "contactStiffness": 1.0 / constants.tip_compliance,
                "contactDamping": SKIN_RELAXATION / constants.tip_compliance,
            }
            pybullet.changeDynamics(self.cube, -1, **skin, **self._here)
        turning = np.asarray(start.cube_angular_velocity)
        linear = np.asarray(start.cube_linear_velocity) + np.cross(turning, arm)
        pybullet.resetBaseVelocity(self.cube, linear.tolist(), turning.tolist(), **self._here)

    def _shape_of(self, constants: EpisodeConstants) -> int:
        """Return the last object's shape if kind, size and centre of mass are the same, else a new one.

        Only an object with its centre of mass off the middle needs a compound shape around it.
        """
        kind, size, com = constants.object_shape, np.asarray(constants.cube_size), np.asarray(constants.cube_com)
        same = kind == self._cube_kind and np.array_equal(size, self._cube_size)
        if not (same and np.array_equal(com, self._cube_com)):
            if isinstance(kind, ObjectMesh):
                _refuse_tilted_inertia(kind, size)
                geometry = {"shapeType": pybullet.GEOM_MESH, "vertices": (kind.vertices * size - com).tolist()}
            else:
                place = {"collisionFramePosition": (-com).tolist()} if com.any() else {}
                geometry = _geometry(kind, size) | place
            shape = pybullet.createCollisionShape(**geometry, **self._here)
            self._cube_shape, self._cube_kind = int(shape), kind
            self._cube_size, self._cube_com = size.copy(), com.copy()
        return self._cube_shape

    def _set_links(self, constants: EpisodeConstants) -> None:
        """Set the links' friction, which Bullet multiplies with the object's, and their inertia about their joints."""
        for body, inertias, spins in zip(self.fingers, self._inertias, self._drive.view("spin_inertia"), strict=True):
            for link, (diagonal, spin) in enumerate(zip(inertias, spins, strict=True)):
                tip, spinning = link == self._links[-1], list(diagonal)
                spinning[self._hand.axes[link]] += spin
                numbers = {
                    "lateralFriction": constants.tip_friction if tip else constants.link_friction,
                    "spinningFriction": constants.tip_spinning_friction if tip else 0.0,
                    "localInertiaDiagonal": spinning,
                }
                pybullet.changeDynamics(body, link, **numbers, **self._here)
        if self.palm >= 0:
            pybullet.changeDynamics(self.palm, -1, lateralFriction=constants.link_friction, **self._here)

    def _forget_contacts(self) -> None:
        """Register palm and fingers anew with the broadphase; cube and table are new themselves.

        That drops cached contacts and their impulses, so an episode depends on nothing that happened before it.
        A finger meets everything but itself and the palm, the palm the cube alone.
        """
        if self.palm >= 0:
            pybullet.setCollisionFilterGroupMask(self.palm, -1, _PALM_GROUP, _CUBE_GROUP, **self._here)
        for k, body in enumerate(self.fingers):
            group = _FIRST_FINGER_GROUP << k
            mask = _ALL_GROUPS & ~group & ~_PALM_GROUP  # PyBullet lets two meet where either mask has the other
            for link in (one for one in self._links if one not in self._bare[k]):
                pybullet.setCollisionFilterGroupMask(body, link, group, mask, **self._here)


def _refuse_tilted_inertia(mesh: ObjectMesh, size: Array) -> None:
    """Refuse a tilted inertia: Bullet knows an object's moments of inertia about its own axes alone."""
    inertia = mesh.inertia(size)
    tilted = float(np.abs(inertia - np.diag(np.diag(inertia))).max() / np.diag(inertia).min())
    if tilted > TILTED:
        raise InputError(
            f"object.file={mesh.file}: its products of inertia are {tilted:.2f} of its smallest moment, engine=bullet "
            f"takes up to {TILTED}; turn the mesh along its principal axes, or choose engine=mujoco"
        )


def _geometry(kind: NamedShape, size: Array) -> dict[str, Any]:
    half = 0.5 * size
    if kind == "box":
        return {"shapeType": pybullet.GEOM_BOX, "halfExtents": half.tolist()}
    radius = float(half[0])
    if kind == "cylinder":
        return {"shapeType": pybullet.GEOM_CYLINDER, "radius": radius, "height": float(size[2])}
    length = 2.0 * straight_half(half)
    if length == 0.0:
        return {"shapeType": pybullet.GEOM_SPHERE, "radius": radius}
    return {"shapeType": pybullet.GEOM_CAPSULE, "radius": radius, "height": length}
