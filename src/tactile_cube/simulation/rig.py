"""Any single mechanism in PyBullet, without contacts: replays what a recorded rig was commanded.

The world that training uses and this one share engine, control step and loop; so errors stated from here are errors of
the simulation that a policy learns in.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pybullet
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.drivetrain import Plant
from tactile_cube.errors import InputError
from tactile_cube.hand.urdf import roll_pitch_yaw
from tactile_cube.simulation.bullet_engine import connect, load_chain
from tactile_cube.simulation.bullet_loop import make_loop
from tactile_cube.simulation.drive import LEAST_INERTIA, TENDON_DAMPING, TENDON_STIFFNESS
from tactile_cube.simulation.options import SimulationOptions

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_NUMBERS = ("placement_rotation", "placement_translation", "axis", "mass", "com", "inertia")
_OFF = np.inf


class RigWorld:
    """A plant of one chain, moved by PyBullet."""

    def __init__(self, plant: Plant) -> None:
        """Prepares an empty world.

        Args:
            plant: One chain; its step is the physics step.

        Raises:
            InputError: The plant has several chains.
        """
        if plant.topology.chains != 1:
            raise InputError(f"a rig world moves one chain, this plant has {plant.topology.chains}; give each its own")
        self.plant = plant
        self._client = connect(SimulationOptions(dt=plant.dt))
        self._loop = make_loop(self._client, plant)
        self._body = -1
        self._loaded = b""

    def rollout(self, commands: Array, memory: Array, rows: Integers, out: Array) -> None:
        """Plays commands from the state in memory, which stays as it is.

        Args:
            commands: Desired positions (T, joints) [rad], one a physics step.
            memory: Constants, effects and state (size,).
            rows: Signals to keep (R,).
            out: Filled with them (T, R, joints).
        """
        memory = self._prepared(memory)
        q, v = self._place(memory)
        self._loop.bind([self._body], q, v, memory)
        goal, signals = self.plant.view(memory, "goal"), [self.plant.signal(memory, int(row)) for row in rows]
        for k, command in enumerate(commands):
            goal[:] = command
            self._loop.run(1)
            for r, signal in enumerate(signals):
                out[k, r] = signal

    def close(self) -> None:
        """Ends the physics server."""
        if pybullet.isConnected(self._client):
            pybullet.disconnect(self._client)

    def _prepared(self, memory: Array) -> Array:
        """A copy that drives Bullet: targets reach the controller unfiltered, offsets sit in the joints' frames."""
        plant, memory = self.plant, memory.copy()
        for key, value in (("time_constant", 0.0), ("rate_limit", _OFF), ("command_torque_limit", _OFF)):
            plant.view(memory, key)[:] = value
        _fold_offsets(plant, memory)
        inertia = np.maximum(plant.view(memory, "reflected_inertia")[list(plant.topology.follow)], LEAST_INERTIA)
        plant.view(memory, "spin_inertia")[0] = np.where(plant.topology.prismatic, 0.0, 0.5 * inertia)
        plant.view(memory, "tendon_stiffness")[:] = TENDON_STIFFNESS
        plant.view(memory, "tendon_damping")[:] = TENDON_DAMPING
        return memory

    def _place(self, memory: Array) -> tuple[Array, Array]:
        """Puts Bullet's joints where the memory says; gives positions and speeds of all dofs (N,)."""
        self._load(memory)
        view, topology = self.plant.view, self.plant.topology
        follow = list(topology.follow)
        q = view(memory, "ratio")[0] * view(memory, "q")[follow] + view(memory, "offset")[0]
        v = view(memory, "ratio")[0] * view(memory, "v")[follow]
        for k in range(len(follow)):
            pybullet.resetJointState(self._body, k, q[k], v[k], physicsClientId=self._client)
        pybullet.setGravity(*view(memory, "engine_gravity")[0], physicsClientId=self._client)
        return q, v

    def _load(self, memory: Array) -> None:
        """Loads the mechanism into Bullet if its numbers have changed."""
        numbers = {key: self.plant.view(memory, key)[0].copy() for key in _NUMBERS}
        spin = self.plant.view(memory, "spin_inertia")[0]
        fingerprint = b"".join(value.tobytes() for value in (*numbers.values(), spin))
        if fingerprint == self._loaded:
            return
        if self._body >= 0:
            pybullet.removeBody(self._body, physicsClientId=self._client)
        outer = numbers["axis"][:, :, None] * numbers["axis"][:, None, :]
        moments, axes = np.linalg.eigh(numbers["inertia"] + spin[:, None, None] * outer)
        axes *= np.linalg.det(axes)[:, None, None]
        topology = self.plant.topology
        urdf = tree_urdf(numbers, topology.parent, topology.prismatic, axes)
        self._body = load_chain(self._client, urdf, np.zeros(3), np.eye(3))
        for k, diagonal in enumerate(moments):
            pybullet.changeDynamics(self._body, k, localInertiaDiagonal=diagonal.tolist(), physicsClientId=self._client)
        self._loaded = fingerprint


def _fold_offsets(plant: Plant, memory: Array) -> None:
    """Moves the offsets of actuated joints into their frames: Bullet counts joint positions as the drivetrain does."""
    offset = plant.view(memory, "offset")[0]
    rotation, translation = plant.view(memory, "placement_rotation")[0], plant.view(memory, "placement_translation")[0]
    axis = plant.view(memory, "axis")[0]
    for k in plant.topology.leader:
        if plant.topology.prismatic[k]:
            translation[k] += rotation[k] @ axis[k] * offset[k]
        else:
            rotation[k] = rotation[k] @ Rotation.from_rotvec(axis[k] * offset[k]).as_matrix()
        offset[k] = 0.0


def tree_urdf(numbers: dict[str, Array], parent: Sequence[int], prismatic: Sequence[int], axes: Array) -> str:
    """A robot with links `link0` .. and free joints `joint0` .., without shapes.

    Args:
        numbers: `placement_rotation` (N, 3, 3), `placement_translation`, `axis`, `com` (N, 3), `mass` (N,).
        parent: Index of each link's parent, -1 for the base.
        prismatic: 1 where a joint slides.
        axes: Principal axes of each link's inertia, in the link's frame (N, 3, 3); their moments are set afterwards.
    """
    base = '<link name="base"><inertial><mass value="1"/>' + _INERTIA + "</inertial></link>"
    parts = ['<?xml version="1.0"?>', '<robot name="rig">', base]
    for k, above in enumerate(parent):
        centre = _origin(numbers["com"][k], axes[k])
        mass = f'<mass value="{numbers["mass"][k]:.17g}"/>'
        parts.append(f'<link name="link{k}"><inertial>{centre}{mass}{_INERTIA}</inertial></link>')
        kind = "prismatic" if prismatic[k] else "continuous"
        limit = '<limit lower="1" upper="-1" effort="1e9" velocity="1e9"/>'  # Bullet: no limits
        place = _origin(numbers["placement_translation"][k], numbers["placement_rotation"][k])
        ends = f'<parent link="{"base" if above < 0 else f"link{above}"}"/><child link="link{k}"/>'
        axis = f'<axis xyz="{_text(numbers["axis"][k])}"/>'
        parts.append(f'<joint name="joint{k}" type="{kind}">{ends}{place}{axis}{limit}</joint>')
    return "\n".join([*parts, "</robot>"])


_INERTIA = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'


def _origin(position: Array, rotation: Array) -> str:
    return f'<origin xyz="{_text(position)}" rpy="{_text(roll_pitch_yaw(rotation))}"/>'


def _text(values: Array) -> str:
    return " ".join(f"{value:.17g}" for value in values)
