"""What other simulators know of a joint's drive, and what a model says beyond that."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields, replace
from math import inf, isfinite
from typing import Any

from tactile_cube.drivetrain.effects.catalogue import catalogue
from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile
from tactile_cube.errors import InputError


def _said(silent: float, unit: str) -> Any:
    """A number that may be left out: the value that says nothing, and what it is in."""
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
    no_load: float = _said(inf, "rad/s")  # speed at which such a motor has no torque left
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
OTHERS = {"friction_creep": 0.0, "reading_delay": 0.0}
"""Other constants of a model, and the values that say nothing."""

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
OF_LOOP = ("kp", "kd", "torque_limit", "gain")
"""What grows with the torque's gain."""


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
    """The number, or nothing where it, or what it may be, is the neutral one."""
    if neutral is not None and estimate.low <= neutral <= estimate.high:
        return ""
    return f"{estimate.value:.6g} {estimate.unit}".rstrip()


def _held(drive: JointDrive, effect: str, p: Mapping[str, float]) -> tuple[tuple[str, ...], dict[str, Any]]:
    """The parameters of an effect that attributes hold, and these attributes then."""
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
