"""The blind world in another engine: MuJoCo integrates the links and their dry friction, the drive stays the same.

What the drive and every hidden effect do is that of physics.py; how links move, couple, stick and slip is MuJoCo's.
Its dry friction is made as stiff as its step allows: by default a joint eases into sticking over 20 ms.
"""

import mujoco
import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.physics import follow, load_on_joint, read_sensors
from benchmarks.blind.plant import ASYMMETRY, DELAY, MATRICES, VECTORS, Plant
from benchmarks.blind.rig import Rig

Array = NDArray[np.float64]
STEP = 5e-4
"""Integration step [s]."""
STIFF = 'solreffriction="0.002 1" solimpfriction="0.99 0.99 0.001"'


def model(rig: Rig, plant: Plant, step: float) -> mujoco.MjModel:
    """The rig with its coupling and hidden mass; rotors are joint armatures."""
    text = lambda values: " ".join(f"{x:.9g}" for x in values)  # noqa: E731
    lines = [f'<mujoco><option timestep="{step}" gravity="{text(rig.gravity)}" integrator="implicitfast"/><worldbody>']
    for link, axis, origin, com, mass, inertia, _ in zip(rig.links, *rig.arrays(), strict=True):
        own = ""
        if link.follows is None:
            i = rig.actuated.index(link.joint)
            own = f'frictionloss="{plant.static_friction[i]}" armature="{plant.reflected_inertia[i]}" {STIFF}'
        lines.append(
            f'<body pos="{text(origin)}"><joint name="{link.joint}" type="hinge" axis="{text(axis)}" {own}/>'
            f'<inertial pos="{text(com)}" mass="{mass:.9g}" diaginertia="{text(inertia)}"/>'
        )
    lines.append("</body>" * len(rig.links) + "</worldbody><equality>")
    for link in rig.links:
        if link.follows is not None:
            curve = text([rig.coupling_offset, rig.coupling_ratio, 0, 0, 0])
            lines.append(f'<joint joint1="{link.joint}" joint2="{link.follows}" polycoef="{curve}" solref="0.002 1"/>')
    return mujoco.MjModel.from_xml_string("".join([*lines, "</equality></mujoco>"]))


def simulate(
    rig: Rig, plant: Plant, command: Array, rate: float, start: Array, settle: float = 0.0, step: float = STEP
) -> tuple[Array, Array, Array]:
    """Motor positions [rad], controller torques [N m] and joint positions [rad] as of physics.simulate."""
    samples, n = command.shape
    engine = model(rig, plant, step)
    data = mujoco.MjData(engine)
    dofs = [engine.joint(joint).dofadr[0] for joint in rig.actuated]
    select, shift = rig.selection()
    data.qpos[:] = select @ start + shift
    p, m = (np.stack([getattr(plant, name) for name in names]) for names in (VECTORS, MATRICES))
    position, torque_out, joint_out = np.empty((samples, n)), np.empty((samples, n)), np.empty((samples, n))
    held, state, filtered, relay = command[0].copy(), np.zeros(n), np.zeros(n), np.ones(n)
    felt, bristle, memory = np.zeros(n), np.zeros((n, 4)), np.zeros((n, 3))
    per, lead = round(1.0 / (rate * step)), round(settle / step)
    for k in range(-lead, samples * per):
        t = k * step
        q, v = data.qpos[dofs], data.qvel[dofs]
        for i in range(n):
            late = int(np.floor((t - p[DELAY, i]) * rate + 1e-6))
            target = command[min(max(late, 0), samples - 1), i]
            follow(p, i, q[i], v[i], target, 0.0, step, held, filtered, state, relay, memory)
        for i in range(n):
            torque, level = load_on_joint(p, m, i, t, q, v, step, state, relay, bristle, felt)
            data.qfrc_applied[dofs[i]] = torque
            engine.dof_frictionloss[dofs[i]] = level * (1.0 + np.sign(v[i]) * p[ASYMMETRY, i])
        mujoco.mj_step(engine, data)
        felt += (data.qacc[dofs] - felt) * step / 0.005
        if not np.abs(data.qpos).max() < 100.0:
            position[:] = np.nan
            break
        if k >= 0 and (k + 1) % per == 0:
            row = k // per
            q = data.qpos[dofs]
            read_sensors(p, q, held, filtered, state, memory, position[row], torque_out[row], joint_out[row])
    return position, torque_out, joint_out
