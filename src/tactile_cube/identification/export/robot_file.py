"""A rig and its model as MJCF, with position or motor actuators, or as URDF: limits, friction and damping of joints."""

from collections.abc import Iterator
from html import escape
from math import ceil, isfinite
from typing import Literal
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.drivetrain.effects.effect import Stage
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.hand.urdf_tree import robot_of
from tactile_cube.identification.export.joint_drive import JointDrive, drives_of
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import nominal_model
from tactile_cube.measurement.replay.simulator import Simulator

Array = NDArray[np.float64]
OF_MECHANISM = ("mass", "com", "inertia", "gravity", "ratio", "offset")
OF_JOINT = ("kp", "kd", "torque_limit", "armature", "friction", "damping", "delay")
OF_LOOP = {True: ("stall", "no_load", "rate"), False: ("bias",)}
"""What the actuator of a position controller holds beside, as a servo or not."""
STEP = 1e-4
"""Longest time step [s]: MuJoCo's Euler acts half a step early, 0.15 mrad at 3 rad/s."""
DRY = 'solreffriction="0.002 1" solimpfriction="0.999 0.9999 0.001 0.5 2"'
"""Dry friction as hard as the time step allows: MuJoCo's own lets a held joint creep."""
Mode = Literal["position", "torque", "voltage"]
COMMANDS = {
    "position": "commands are joint angles [rad]",
    "torque": "commands are torques [N m]",
    "voltage": "commands are voltages, as the torque they make at standstill [N m]",
}
LIGHTEST = 1e-9
"""Mass [kg] and moment [kg m^2] that MuJoCo wants of a moving body at least."""


def as_mjcf(model: ModelFile, recording: Recording) -> tuple[str, list[str]]:
    """Return the text, and what it does not hold, a line each."""
    known, simulator = nominal_model(recording, model), Simulator(recording)
    memory, drives = simulator.memory(known), [drive.at_link() for drive in drives_of(model)]
    numbers = {key: simulator.plant.view(memory, key)[0] for key in OF_MECHANISM}
    mechanical = [term.effect.name for term in known.terms if term.effect.stage is Stage.MECHANISM]
    tree, mode = simulator.tree, recording.description.controller.mode
    left = [
        line
        for drive in drives
        for line in drive.not_in([*OF_JOINT, *mechanical, *(OF_LOOP[_is_servo(drive)] if mode == "position" else ())])
    ]
    step = recording.step / ceil(recording.step / STEP - 1e-6)
    followers = [
        f'    <joint joint1="{escape(name)}" joint2="{escape(tree.joint_names[tree.follow[k]])}" '
        f'polycoef="{numbers["offset"][k]:.12g} {numbers["ratio"][k]:.12g} 0 0 0" solref="0.002 1"/>'
        for k, name in enumerate(tree.dof_names)
        if name not in tree.joint_names
    ]
    parts = [
        f'<mujoco model="{escape(recording.name)}">',
        *(f"  <!-- {line} -->" for line in _said(left, drives, mode)),
        '  <compiler angle="radian"/>',
        f'  <option timestep="{step:.12g}" integrator="implicitfast" gravity="{_list(numbers["gravity"])}"/>',
        "  <worldbody>",
        *_bodies(tree, numbers, {drive.name: drive for drive in drives}, -1, 2),
        "  </worldbody>",
        *(["  <equality>", *followers, "  </equality>"] if followers else []),
        "  <actuator>",
        *(f"    {_actuator(drive, mode, step)}" for drive in drives),
        "  </actuator>",
        "</mujoco>",
    ]
    return "\n".join([*parts, ""]), left


def _is_servo(drive: JointDrive) -> bool:
    """Whether only MuJoCo's `dcmotor` has what limits its position controller."""
    return isfinite(drive.stall) or isfinite(drive.rate)


def _said(left: list[str], drives: list[JointDrive], mode: Mode) -> list[str]:
    lines = [f"by tactile_cube.export; {COMMANDS[mode]}", *(f"not held: {one}" for one in left)]
    if mode == "position" and any(isfinite(drive.rate) for drive in drives):
        lines.append("data.act holds commands that are limited in speed: begin with the joints' angles in it")
    if any(": stiffness " in line for line in left):
        lines.append("gains are those that links feel; a motor is ahead of its link by torque / stiffness")
    return [line.replace("--", "- -") for line in lines]


def _bodies(
    tree: RigidBodyTree, numbers: dict[str, Array], drives: dict[str, JointDrive], parent: int, depth: int
) -> Iterator[str]:
    pad = "  " * depth
    for k in np.flatnonzero(tree.parent == parent).tolist():
        turn = Rotation.from_matrix(tree.placement_rotation[k]).as_quat(scalar_first=True)
        place = f'pos="{_list(tree.placement_translation[k])}" quat="{_list(turn)}"'
        yield f'{pad}<body name="{escape(tree.link_names[k])}" {place}>'
        yield f"{pad}  {_inertial(numbers['mass'][k], numbers['com'][k], numbers['inertia'][k])}"
        yield f"{pad}  {_joint(tree, k, drives.get(tree.dof_names[k]))}"
        yield from _bodies(tree, numbers, drives, k, depth + 1)
        yield f"{pad}</body>"


def _inertial(mass: float, com: Array, inertia: Array) -> str:
    moments, axes = np.linalg.eigh(inertia)
    moments = np.maximum(moments, LIGHTEST)
    moments[0] = max(moments[0], moments[2] - moments[1])  # rounded numbers of a thin body
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    turn = Rotation.from_matrix(axes).as_quat(scalar_first=True)
    size = f'mass="{max(mass, LIGHTEST):.12g}" diaginertia="{_list(moments)}"'
    return f'<inertial pos="{_list(com)}" quat="{_list(turn)}" {size}/>'


def _joint(tree: RigidBodyTree, k: int, drive: JointDrive | None) -> str:
    kind = "slide" if tree.prismatic[k] else "hinge"
    words = [f'name="{escape(tree.dof_names[k])}" type="{kind}" axis="{_list(tree.axis[k])}"']
    if isfinite(tree.lower[k]) and isfinite(tree.upper[k]) and tree.lower[k] < tree.upper[k]:
        words.append(f'range="{tree.lower[k]:.12g} {tree.upper[k]:.12g}"')
    if drive is not None:
        held = {
            "armature": max(drive.armature, 0.0),
            "frictionloss": max(drive.friction, 0.0),
            "damping": drive.damping,
        }
        words += [f'{key}="{value:.12g}"' for key, value in held.items() if value]
        words += [DRY] if drive.friction > 0.0 else []
    return f"<joint {' '.join(words)}/>"


def _actuator(drive: JointDrive, mode: Mode, step: float) -> str:
    common = f'name="{escape(drive.name)}" joint="{escape(drive.name)}"'
    if drive.delay > 0.0:
        common += f' delay="{drive.delay:.12g}" nsample="{ceil(drive.delay / step) + 2}" interp="linear"'
    most, kp, kd = drive.torque_limit, f"{drive.kp:.12g}", f"{drive.kd:.12g}"
    limited = f' forcerange="-{most:.12g} {most:.12g}"' if isfinite(most) else ""
    saturated = f' saturation="{most:.12g} 0 0"' if isfinite(most) else ""
    if mode == "torque":
        asked = most / drive.gain
        limited = f' forcerange="-{asked:.12g} {asked:.12g}"' if isfinite(most) else ""
        return f'<motor {common}{limited} gear="{drive.gain:.12g}"/>'
    if mode == "voltage":
        return f"<dcmotor {common}{saturated} {_motor(drive.kd / drive.gain, drive.gain)}/>"
    if _is_servo(drive):
        rate, supplied = drive.rate if isfinite(drive.rate) else 0.0, isfinite(drive.stall)
        motor = _motor(1.0 / drive.no_load, drive.stall) if supplied else _motor(1.0, 1.0)
        controller = f"{kp} 0 {kd} {rate:.12g} 0 {supplied:d}"  # a volt is the supply
        return f'<dcmotor {common}{saturated} input="pos" controller="{controller}" {motor}/>'
    if drive.bias:
        return f'<general {common}{limited} biastype="affine" gainprm="{kp}" biasprm="{drive.bias:.12g} -{kp} -{kd}"/>'
    return f'<position {common}{limited} kp="{kp}" kv="{kd}"/>'


def _motor(constant: float, torque: float) -> str:
    """A motor's constant [V s/rad], and the resistance at which a volt makes so much torque at standstill [N m]."""
    return f'motorconst="{constant:.12g}" resistance="{constant / torque:.12g}"'


def _list(values: Array) -> str:
    return " ".join(f"{value:.12g}" for value in values)


def as_urdf(model: ModelFile, recording: Recording) -> tuple[str, list[str]]:
    """Return the recording's URDF with <dynamics> and efforts of the model, and what it does not hold, a line each."""
    drives = drives_of(model)
    left = [line for drive in drives for line in drive.not_in(("torque_limit", "friction", "damping"))]
    robot = robot_of(recording.urdf)
    by_name = {drive.name: drive for drive in drives}
    for joint in robot.findall("joint"):
        if (drive := by_name.get(str(joint.get("name")))) is None:
            continue
        for old in joint.findall("dynamics"):
            joint.remove(old)
        values = {"damping": f"{drive.damping:.12g}", "friction": f"{max(drive.friction, 0.0):.12g}"}
        joint.append(ElementTree.Element("dynamics", values))
        if isfinite(drive.torque_limit):
            limit = joint.find("limit")
            if limit is None:
                limit = ElementTree.SubElement(joint, "limit", {"velocity": "0"})
            limit.set("effort", f"{drive.torque_limit:.12g}")
    for line in reversed(["by tactile_cube.export", *(f"not held: {one}" for one in left)]):
        robot.insert(0, ElementTree.Comment(f" {line.replace('--', '- -')} "))
    ElementTree.indent(robot)
    return ElementTree.tostring(robot, encoding="unicode") + "\n", left
