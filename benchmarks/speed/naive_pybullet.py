"""Peer: the hand as most PyBullet projects write it, one body, one Python call for each joint and physics step."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pybullet
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.hand import DLR_HAND2
from tactile_cube.simulation import EpisodeConstants

Array = NDArray[np.float64]

DT, SUBSTEPS, ITERATIONS = 0.002, 50, 50
FRICTION_SPEED = 0.05
"""Speed at which the friction of the joints has risen to three quarters [rad/s]."""
_PALM = '<link name="palm">'
_INERTIAL = '<inertial><mass value="1"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>'
"""The palm never moves; its numbers do nothing, but PyBullet warns about links without any."""


class NaivePyBullet:
    """The same hand, cube, masses and gains, with a gear constraint for each coupled joint."""

    def __init__(self, constants: EpisodeConstants) -> None:
        """Loads hand and cube at the start of an episode."""
        self.constants = constants
        self.client = pybullet.connect(pybullet.DIRECT)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=DT, numSolverIterations=ITERATIONS, physicsClientId=self.client
        )
        self.hand = self._load_hand()
        names = [self._info(joint)[1].decode() for joint in range(self._count())]
        self.driven = [names.index(name) for name in DLR_HAND2.joint_names]
        for joint in range(len(names)):
            pybullet.setJointMotorControl2(
                self.hand, joint, pybullet.VELOCITY_CONTROL, force=0.0, physicsClientId=self.client
            )
        self._set_start(names)
        self._couple(names)
        self._set_contact()
        self.cube = self._load_cube()
        self.filtered = np.array(DLR_HAND2.start_angles)
        self.steps = 0

    @property
    def cube_position(self) -> Array:
        """Centre of the cube (3,) [m]."""
        return np.array(pybullet.getBasePositionAndOrientation(self.cube, physicsClientId=self.client)[0])

    def step(self, q_n: Array, /) -> None:
        """One policy step of 0.1 s towards desired joint angles (12,) [rad]."""
        c = self.constants
        if self.steps == c.gravity_onset:
            pybullet.setGravity(0.0, 0.0, -c.gravity, physicsClientId=self.client)
        self.steps += 1
        share = 1.0 - np.exp(-DT / c.filter_time)
        for _ in range(SUBSTEPS):
            self.filtered += share * (q_n - self.filtered)
            states = [pybullet.getJointState(self.hand, j, physicsClientId=self.client) for j in self.driven]
            q, v = np.array([s[0] for s in states]), np.array([s[1] for s in states])
            # tau = K_P (q_d - q_m) - K_D dq with q_m = q + tau / K_e, solved for tau
            torque = (c.kp * (self.filtered - q) - c.kd * v) / (1.0 + c.kp / np.asarray(c.stiffness))
            torque = np.clip(torque, -c.torque_limit, c.torque_limit)
            torque -= c.static_friction * np.tanh(v / FRICTION_SPEED)
            for joint, value in zip(self.driven, torque, strict=True):
                pybullet.setJointMotorControl2(
                    self.hand, joint, pybullet.TORQUE_CONTROL, force=value, physicsClientId=self.client
                )
            pybullet.stepSimulation(physicsClientId=self.client)

    def close(self) -> None:
        """Ends the physics server."""
        pybullet.disconnect(self.client)

    def _count(self) -> int:
        return int(pybullet.getNumJoints(self.hand, physicsClientId=self.client))

    def _info(self, joint: int) -> tuple[bytes, ...]:
        return tuple(pybullet.getJointInfo(self.hand, joint, physicsClientId=self.client))

    def _load_hand(self) -> int:
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_SELF_COLLISION_EXCLUDE_ALL_PARENTS
        quaternion = Rotation.from_matrix(DLR_HAND2.rotation).as_quat().tolist()
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "hand.urdf"
            file.write_text(DLR_HAND2.urdf().replace(_PALM, _PALM + _INERTIAL), encoding="utf-8")
            pose = DLR_HAND2.position.tolist(), quaternion
            return int(
                pybullet.loadURDF(
                    str(file),
                    *pose,
                    useFixedBase=True,
                    flags=flags | pybullet.URDF_USE_SELF_COLLISION,
                    physicsClientId=self.client,
                )
            )

    def _set_start(self, names: list[str]) -> None:
        angles = dict(zip(DLR_HAND2.joint_names, DLR_HAND2.start_angles, strict=True))
        for joint, name in enumerate(names):
            angle = angles[name.replace("q4", "q3")]
            pybullet.resetJointState(self.hand, joint, angle, physicsClientId=self.client)

    def _couple(self, names: list[str]) -> None:
        for finger in DLR_HAND2.fingers:
            parent, child = (names.index(f"{finger.name}_q{j}") for j in (3, 4))
            gear = pybullet.createConstraint(
                self.hand,
                parent,
                self.hand,
                child,
                pybullet.JOINT_GEAR,
                [0, 1, 0],
                [0, 0, 0],
                [0, 0, 0],
                physicsClientId=self.client,
            )
            pybullet.changeConstraint(gear, gearRatio=-1, maxForce=100, erp=0.2, physicsClientId=self.client)

    def _set_contact(self) -> None:
        """Friction, no damping, and rotor inertia as spin inertia of the links, which is all that PyBullet offers."""
        c = self.constants
        extra = float(np.asarray(c.reflected_inertia).flat[0])
        for joint in range(self._count()):
            tip = joint % 4 == 3
            inertia = pybullet.getDynamicsInfo(self.hand, joint, physicsClientId=self.client)[2]
            pybullet.changeDynamics(
                self.hand,
                joint,
                lateralFriction=c.tip_friction if tip else c.link_friction,
                spinningFriction=c.tip_spinning_friction if tip else 0.0,
                localInertiaDiagonal=[value + extra for value in inertia],
                linearDamping=0.0,
                angularDamping=0.0,
                jointDamping=0.0,
                physicsClientId=self.client,
            )

    def _load_cube(self) -> int:
        half = (0.5 * np.asarray(self.constants.cube_size)).tolist()
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=self.client)
        cube = int(pybullet.createMultiBody(self.constants.cube_mass, shape, physicsClientId=self.client))
        friction = self.constants.cube_friction
        pybullet.changeDynamics(cube, -1, lateralFriction=friction, spinningFriction=0.0, physicsClientId=self.client)
        return cube
