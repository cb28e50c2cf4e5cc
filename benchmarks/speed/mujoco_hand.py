"""Peer: the same hand and cube in MuJoCo, with drive, filter and torque limit in its own compiled loop."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.hand import DLR_HAND2
from tactile_cube.simulation import EpisodeConstants

Array = NDArray[np.float64]

DT, SUBSTEPS = 0.002, 50


class MujocoHand:
    """Position servos of the stiffness that K_P and K_e in series have, filtered targets, armature, dry friction.

    The palm is MuJoCo's world, so the cube's pose and gravity are given in the hand's frame.
    """

    def __init__(self, mujoco: ModuleType, constants: EpisodeConstants, impratio: float, noslip: int) -> None:
        """Builds the model.

        Args:
            mujoco: the package.
            constants: of the episode.
            impratio: stiffness of friction over that of the normal force.
            noslip: iterations of the solver that removes slip.
        """
        self._mujoco = mujoco
        self.constants = constants
        self.steps = 0
        self._rotation = DLR_HAND2.rotation
        self.model = _model(mujoco, constants, impratio, noslip)
        self.data = mujoco.MjData(self.model)
        angles = DLR_HAND2.start_angles.reshape(-1, 3)
        self.data.qpos[: angles.size + len(angles)] = np.column_stack([angles, angles[:, 2]]).ravel()
        self.data.act[:] = DLR_HAND2.start_angles

    @property
    def cube_position(self) -> Array:
        """Centre of the cube (3,) [m]."""
        return np.asarray(DLR_HAND2.position + self._rotation @ self.data.body("cube").xpos)

    def step(self, q_n: Array, /) -> None:
        """One policy step of 0.1 s towards desired joint angles (12,) [rad]."""
        if self.steps == self.constants.gravity_onset:
            self.model.opt.gravity[:] = self._rotation.T @ np.array([0.0, 0.0, -self.constants.gravity])
        self.steps += 1
        self.data.ctrl[:] = q_n
        self._mujoco.mj_step(self.model, self.data, nstep=SUBSTEPS)

    def close(self) -> None:
        """Nothing to end: MuJoCo has no server."""


def _model(mujoco: ModuleType, c: EpisodeConstants, impratio: float, noslip: int) -> Any:
    spec = mujoco.MjSpec.from_string(DLR_HAND2.urdf())
    option = spec.option
    option.timestep, option.impratio, option.noslip_iterations = DT, impratio, noslip
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.gravity = np.zeros(3)
    for index, geom in enumerate(spec.geoms):
        _touch(geom, c.tip_friction if index % 3 == 2 else c.link_friction, c.tip_spinning_friction)
    for index, name in enumerate(DLR_HAND2.joint_names):
        _drive(mujoco, spec, name, c, index)
    _add_cube(mujoco, spec, c)
    return spec.compile()


def _touch(geom: Any, lateral: float, spinning: float) -> None:
    # the finger's own friction holds, as the cube's factor is 1
    geom.friction, geom.condim, geom.priority = [lateral, spinning, 1e-4], 4, 1


def _drive(mujoco: ModuleType, spec: Any, name: str, c: EpisodeConstants, index: int) -> None:
    kp, kd, stiffness, friction, inertia = (
        float(np.broadcast_to(value, len(DLR_HAND2.joint_names))[index])
        for value in (c.kp, c.kd, c.stiffness, c.static_friction, c.reflected_inertia)
    )
    softer = 1.0 + kp / stiffness
    joint = spec.joint(name)
    joint.armature, joint.frictionloss = inertia, friction
    actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    actuator.dyntype, actuator.dynprm[0] = mujoco.mjtDyn.mjDYN_FILTEREXACT, c.filter_time
    actuator.gaintype, actuator.gainprm[0] = mujoco.mjtGain.mjGAIN_FIXED, kp / softer
    actuator.biastype, actuator.biasprm[:3] = mujoco.mjtBias.mjBIAS_AFFINE, [0.0, -kp / softer, -kd / softer]
    actuator.forcelimited, actuator.forcerange = True, [-c.torque_limit, c.torque_limit]


def _add_cube(mujoco: ModuleType, spec: Any, c: EpisodeConstants) -> None:
    x, y, z, w = Rotation.from_matrix(DLR_HAND2.rotation.T).as_quat()
    position = -DLR_HAND2.rotation.T @ DLR_HAND2.position
    body = spec.worldbody.add_body(name="cube", pos=position, quat=[w, x, y, z])
    body.add_freejoint()
    half = 0.5 * np.asarray(c.cube_size)
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=half, mass=c.cube_mass, friction=[1.0, 0.0, 0.0], condim=4)
