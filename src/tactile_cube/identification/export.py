"""An identified model for other simulators: the drive of each joint, as MJCF, URDF and parameters of BAM."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from html import escape
from math import ceil, inf, isfinite
from typing import Any, Literal
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.drivetrain.effects.catalogue import catalogue
from tactile_cube.drivetrain.effects.effect import Array, Stage
from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile
from tactile_cube.errors import InputError
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.hand.urdf_tree import robot_of
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import nominal_model
from tactile_cube.measurement.replay.simulator import Simulator


def _said(silent: float, unit: str) -> Any:
    """Return a field of the drive: its default, which has no effect, and its unit."""
    return field(default=silent, metadata={"unit": unit})


@dataclass(frozen=True)
class JointDrive:
    """The drive of one joint: torque = gain of the loop and limits, then bias, less friction."""

    name: str
    kp: float = _said(0.0, "N m/rad")
    kd: float = _said(0.0, "N m s/rad")  # of the controller
    torque_limit: float = _said(inf, "N m")
    armature: float = _said(0.0, "kg m^2")  # rotor seen from the joint
    friction: float = _said(0.0, "N m")  # dry, while the joint moves
    damping: float = _said(0.0, "N m s/rad")  # viscous friction
    bias: float = _said(0.0, "N m")  # torque that nobody commands
    delay: float = _said(0.0, "s")  # of commands
    rate: float = _said(inf, "rad/s")  # fastest change of the command that the drive follows
    stall: float = _said(inf, "N m")  # largest torque at rest of a motor whose supply is limited
    no_load: float = _said(inf, "rad/s")  # speed at which that motor has no torque left
    excess: float = _said(0.0, "N m more friction at rest (stribeck_friction)")  # falls by exp(-|v/velocity|^exponent)
    stiffness: float = _said(inf, "N m/rad")  # of the gear between motor and link
    velocity: float = 0.0  # [rad/s]
    exponent: float = 2.0
    gain: float = 1.0  # of the torque, which kp, kd and torque_limit have in them
    beyond: Mapping[str, str] = field(default_factory=dict)  # what none of these hold: name -> its numbers

    def at_link(self) -> JointDrive:
        """Return the drive with the gains that a link feels through the gear, which a rigid drive would have."""
        softer = 1.0 + self.kp / self.stiffness
        return replace(self, kp=self.kp / softer, kd=self.kd / softer)

    def not_in(self, held: Collection[str]) -> list[str]:
        """Return what a format does not hold that holds these attributes and effects, a line each."""
        own = {one.name: one for one in fields(self) if "unit" in one.metadata and one.name not in held}
        values = {name: getattr(self, name) for name in own}
        said = {name: f"{values[name]:.6g} {own[name].metadata['unit']}" for name in own}
        said = {name: text for name, text in said.items() if values[name] != own[name].default}
        return [f"{self.name}: {name} {text}" for name, text in {**said, **self.beyond}.items() if name not in held]


CONSTANTS = {
    "kp": "kp",
    "kd": "kd",
    "torque_limit": "torque_limit",
    "reflected_inertia": "armature",
    "static_friction": "friction",
    "stiffness": "stiffness",
}
"""Constants of a model, and the attributes that hold them."""
OTHERS = {"friction_creep": 0.0, "reading_delay": 0.0}  # other constants of a model, and the values that say nothing

ADDED = {
    "reflected_inertia": ("excess", "armature"),
    "coulomb_friction": ("friction", "friction"),
    "asymmetric_friction": ("friction", "friction"),
    "viscous_friction": ("damping", "damping"),
    "torque_bias": ("bias", "bias"),
    "command_delay": ("delay", "delay"),
}
"""Effects whose parameter is added to an attribute."""
LOWERED = {"rate_limit": ("speed", "rate"), "torque_saturation": ("limit", "torque_limit")}
"""Effects whose parameter is an attribute's bound."""
TAKEN = {"back_emf": ("stall", "no_load"), "stribeck_friction": ("excess", "velocity", "exponent")}
"""Effects whose parameters are attributes."""
OF_LOOP = ("kp", "kd", "torque_limit", "gain")  # what grows with the torque's gain


def drives_of(model: ModelFile) -> list[JointDrive]:
    """Return the drives of all joints; effects of fingertips and object are of no joint."""
    order = list(catalogue())
    effects = sorted(model.drive_effects, key=lambda one: order.index(one.name) if one.name in order else len(order))
    return [_drive(model, joint, [one for one in effects if one.joint in (None, joint)]) for joint in model.joints]


def _drive(model: ModelFile, joint: str, effects: list[EffectEstimate]) -> JointDrive:
    stated = {key: row[joint] for key, row in model.values.items() if joint in row}
    own: dict[str, Any] = {name: stated[key].value for key, name in CONSTANTS.items() if key in stated}
    beyond = {key: text for key, none in OTHERS.items() if key in stated and (text := _told(stated[key], none))}
    if joint in model.offsets and model.offsets[joint].value:
        beyond["joint_offset"] = f"{model.offsets[joint].value:.6g} rad"
    drive = JointDrive(joint, **own)
    for effect in effects:
        known, given = catalogue().get(effect.name), effect.parameters
        left = {key: Estimate.model_validate(v) for key, v in known.defaults(given).items()} | given if known else given
        held = _held(drive, effect.name, {key: one.value for key, one in left.items()})
        drive = replace(drive, **held[1])
        left = {key: one for key, one in left.items() if key not in held[0]}
        neutral = {p.name: p.neutral for p in known.parameters} if known else {}
        texts = [f"{key} {text}" for key, one in left.items() if (text := _told(one, neutral.get(key)))]
        beyond |= {effect.name: ", ".join(texts)} if texts else {}
    return replace(drive, beyond=beyond)


def _told(estimate: Estimate, neutral: float | None) -> str:
    """Return the value with its unit, or nothing if its interval contains the neutral value."""
    if neutral is not None and estimate.low <= neutral <= estimate.high:
        return ""
    return f"{estimate.value:.6g} {estimate.unit}".rstrip()


def _held(drive: JointDrive, effect: str, p: Mapping[str, float]) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Return the parameters of an effect that attributes of the drive hold, and the new values of the attributes."""
    if effect in ADDED:
        key, name = ADDED[effect]
        return (key,), {name: getattr(drive, name) + p[key]}
    if effect in LOWERED:
        key, name = LOWERED[effect]
        return (key,), {name: min(getattr(drive, name), p[key])}
    if effect == "torque_gain":
        return ("error",), {name: (1.0 + p["error"]) * getattr(drive, name) for name in OF_LOOP}
    keys = TAKEN.get(effect, ())
    return keys, {key: p[key] for key in keys}


def as_bam(model: ModelFile, joint: str | None, actuator: str | None, volts: float | None) -> tuple[str, list[str]]:
    """Return a joint's parameter file of BAM (better actuator models), and what it does not hold, a line each.

    Source: Rhoban/bam, model.py (friction models M1 to M6, command_delay) and actuator.py (kt, R, armature).

    Args:
        model: as identified.
        joint: of the model; None: its only one.
        actuator: BAM's name of the servo, such as sts3215.
        volts: that its controller sets for an error of 1 rad: vin * kp * error_gain of BAM's actuator [V/rad].

    Raises:
        InputError: no such joint, no name of a servo.
    """
    names = list(model.joints)
    if joint is None and len(names) > 1:
        raise InputError(
            f"format=bam: a file is of one joint; give bam.joint={names[0]}, or one of {', '.join(names[1:])}"
        )
    if joint not in (None, *names):
        raise InputError(f"bam.joint={joint}: no joint of the model; it has {', '.join(names)}")
    drive = drives_of(model)[0 if joint is None else names.index(joint)]
    if not actuator:
        raise InputError("format=bam: give bam.actuator=NAME, the servo's name in BAM, such as sts3215 or xl330")
    if volts is not None and not (isinstance(volts, int | float) and 0.0 < volts < inf):
        raise InputError(f"bam.volts={volts}: expected a number of volts above 0, vin * kp * error_gain in BAM")
    law = "m2" if drive.excess else "m1"
    data: dict[str, object] = {"model": law, "actuator": actuator, "armature": drive.armature}
    data |= {"friction_base": drive.friction, "friction_viscous": drive.damping, "command_delay": drive.delay}
    if drive.excess:
        data |= {"friction_stribeck": drive.excess, "dtheta_stribeck": drive.velocity, "alpha": drive.exponent}
    held: tuple[str, ...] = ("armature", "friction", "damping", "delay", "excess")
    if isfinite(drive.rate) and actuator.startswith("sts"):  # others follow any command
        data["max_velocity"], held = drive.rate, (*held, "rate")
    if volts is not None and drive.kp > 0.0 and drive.kd > 0.0:
        constant = drive.kd / drive.kp * volts  # kp = kt volts / R, kd = kt^2 / R
        data |= {"kt": constant, "R": constant * volts / drive.kp}
        held = (*held, "kp", "kd")
    left = drive.not_in(held)
    if "kp" not in held:
        left.append("kt and R: give bam.volts, the volts an error of 1 rad makes (vin * kp * error_gain in BAM)")
    return json.dumps(data | {"not_held": left}, indent=2) + "\n", left


OF_MECHANISM = ("mass", "com", "inertia", "gravity", "ratio", "offset")
OF_JOINT = ("kp", "kd", "torque_limit", "armature", "friction", "damping", "delay")
OF_SERVO = {True: ("stall", "no_load", "rate"), False: ("bias",)}
"""Further attributes that the actuator of a position controller holds, as a servo or not."""
STEP = 1e-4  # longest time step [s]: MuJoCo's Euler acts half a step early, 0.15 mrad at 3 rad/s
DRY = 'solreffriction="0.002 1" solimpfriction="0.999 0.9999 0.001 0.5 2"'
"""Dry friction as hard as the time step allows: MuJoCo's own lets a held joint creep."""
Mode = Literal["position", "torque", "voltage"]
COMMANDS = {
    "position": "commands are joint angles [rad]",
    "torque": "commands are torques [N m]",
    "voltage": "commands are voltages, as the torque they make at standstill [N m]",
}
LIGHTEST = 1e-9  # mass [kg] and moment [kg m^2] that MuJoCo wants of a moving body at least


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
        for line in drive.not_in([*OF_JOINT, *mechanical, *(OF_SERVO[_is_servo(drive)] if mode == "position" else ())])
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
        *(f"  <!-- {line} -->" for line in _notes(left, drives, mode)),
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
    """Return whether the limits of the position controller need MuJoCo's `dcmotor`."""
    return isfinite(drive.stall) or isfinite(drive.rate)


def _notes(left: list[str], drives: list[JointDrive], mode: Mode) -> list[str]:
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
    """Return a motor's constant [V s/rad] and the resistance for which one volt gives the torque at rest [N m]."""
    return f'motorconst="{constant:.12g}" resistance="{constant / torque:.12g}"'


def _list(values: Array) -> str:
    return " ".join(f"{value:.12g}" for value in values)


def as_urdf(model: ModelFile, recording: Recording) -> tuple[str, list[str]]:
    """Return the recording's URDF with <dynamics> and efforts of the model, and what it does not hold, a line each."""
    drives = drives_of(model)
    left = [line for drive in drives for line in drive.not_in(("torque_limit", "friction", "damping"))]
    robot = robot_of(recording.rig.text)
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
