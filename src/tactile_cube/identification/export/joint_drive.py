"""What other simulators know of a joint's drive, and what a model says beyond that."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any

from tactile_cube.drivetrain.effects.catalogue import catalogue
from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile


@dataclass(frozen=True)
class JointDrive:
    """The drive of one joint: torque = gain of the loop and limits, then bias, less friction.

    Attributes:
        kp: [N m/rad].
        kd: of the controller [N m s/rad].
        torque_limit: [N m].
        armature: rotor seen from the joint [kg m^2].
        friction: dry, while the joint moves [N m].
        damping: viscous friction [N m s/rad].
        bias: torque that nobody commands [N m].
        delay: of commands [s].
        rate: fastest change of the command that the drive follows [rad/s].
        stall: largest torque at rest of a motor whose supply is limited [N m].
        no_load: speed at which such a motor has no torque left [rad/s].
        excess: dry friction at rest beyond `friction` [N m], which falls by exp(-|v / velocity|^exponent).
        velocity: [rad/s].
        exponent: [1].
        stiffness: of the gear between motor and link [N m/rad].
        gain: of the torque, which kp, kd and torque_limit have in them [1].
        beyond: what none of these hold: name -> its numbers.
    """

    name: str
    kp: float = 0.0
    kd: float = 0.0
    torque_limit: float = inf
    armature: float = 0.0
    friction: float = 0.0
    damping: float = 0.0
    bias: float = 0.0
    delay: float = 0.0
    rate: float = inf
    stall: float = inf
    no_load: float = inf
    excess: float = 0.0
    velocity: float = 0.0
    exponent: float = 2.0
    stiffness: float = inf
    gain: float = 1.0
    beyond: Mapping[str, str] = field(default_factory=dict)

    def at_link(self) -> JointDrive:
        """Return the drive with the gains that a link feels through the gear, which a rigid drive would have."""
        softer = 1.0 + self.kp / self.stiffness
        return replace(self, kp=self.kp / softer, kd=self.kd / softer)

    def not_in(self, held: Collection[str]) -> list[str]:
        """Return what a format does not hold that holds these attributes and effects, a line each."""
        own = [
            f"{self.name}: {name} {getattr(self, name):.6g} {unit}"
            for name, (unsaid, unit) in SILENT.items()
            if name not in held and getattr(self, name) != unsaid
        ]
        return [*own, *(f"{self.name}: {name} {text}" for name, text in self.beyond.items() if name not in held)]


SILENT = {
    "kp": (0.0, "N m/rad"),
    "kd": (0.0, "N m s/rad"),
    "torque_limit": (inf, "N m"),
    "armature": (0.0, "kg m^2"),
    "friction": (0.0, "N m"),
    "damping": (0.0, "N m s/rad"),
    "bias": (0.0, "N m"),
    "delay": (0.0, "s"),
    "rate": (inf, "rad/s"),
    "stall": (inf, "N m"),
    "no_load": (inf, "rad/s"),
    "excess": (0.0, "N m more friction at rest (stribeck_friction)"),
    "stiffness": (inf, "N m/rad"),
}
"""Attributes that may be left out, the values that say nothing, and units."""
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

Values = Mapping[str, float]
Law = Callable[[JointDrive, Values], JointDrive]
HELD: dict[str, tuple[tuple[str, ...], Law]] = {
    "reflected_inertia": (("excess",), lambda d, p: replace(d, armature=d.armature + p["excess"])),
    "coulomb_friction": (("friction",), lambda d, p: replace(d, friction=d.friction + p["friction"])),
    "asymmetric_friction": (("friction",), lambda d, p: replace(d, friction=d.friction + p["friction"])),
    "viscous_friction": (("damping",), lambda d, p: replace(d, damping=d.damping + p["damping"])),
    "torque_gain": (("error",), lambda d, p: _stronger(d, 1.0 + p["error"])),
    "torque_bias": (("bias",), lambda d, p: replace(d, bias=d.bias + p["bias"])),
    "command_delay": (("delay",), lambda d, p: replace(d, delay=d.delay + p["delay"])),
    "rate_limit": (("speed",), lambda d, p: replace(d, rate=min(d.rate, p["speed"]))),
    "torque_saturation": (("limit",), lambda d, p: replace(d, torque_limit=min(d.torque_limit, p["limit"]))),
    "back_emf": (("stall", "no_load"), lambda d, p: replace(d, stall=p["stall"], no_load=p["no_load"])),
    "stribeck_friction": (("excess", "velocity", "exponent"), lambda d, p: _sticking(d, p)),
}
"""Effects that attributes hold: by which parameters, and how."""


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
        names, law = HELD.get(effect.name, ((), lambda drive, _: drive))
        drive = law(drive, {key: left[key].value for key in names})
        left = {key: one for key, one in left.items() if key not in names}
        neutral = {p.name: p.neutral for p in known.parameters} if known else {}
        texts = [f"{key} {text}" for key, one in left.items() if (text := _told(one, neutral.get(key)))]
        beyond |= {effect.name: ", ".join(texts)} if texts else {}
    return replace(drive, beyond=beyond)


def _told(estimate: Estimate, neutral: float | None) -> str:
    """The number, or nothing where it, or what it may be, is the neutral one."""
    if neutral is not None and estimate.low <= neutral <= estimate.high:
        return ""
    return f"{estimate.value:.6g} {estimate.unit}".rstrip()


def _sticking(drive: JointDrive, law: Values) -> JointDrive:
    return replace(drive, excess=law["excess"], velocity=law["velocity"], exponent=law["exponent"])


def _stronger(drive: JointDrive, times: float) -> JointDrive:
    grown = {key: times * getattr(drive, key) for key in ("kp", "kd", "torque_limit", "gain")}
    return replace(drive, **grown)
