"""A joint's model as the parameter file of BAM (better actuator models), which its simulators and MuJoCo glue read.

Source: Rhoban/bam, model.py (friction models M1 to M6, command_delay) and actuator.py (kt, R, armature).
"""

from __future__ import annotations

import json
from math import isfinite

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.errors import InputError
from tactile_cube.identification.export.joint_drive import JointDrive, drives_of

HELD = ("armature", "friction", "damping", "delay", "excess")


def as_bam(model: ModelFile, joint: str | None, actuator: str | None, volts: float | None) -> tuple[str, list[str]]:
    """Return the text, and what it does not hold, a line each.

    Args:
        model: as identified.
        joint: of the model; None: its only one.
        actuator: BAM's name of the servo, such as sts3215.
        volts: that its controller sets for an error of 1 rad: vin * kp * error_gain of BAM's actuator [V/rad].

    Raises:
        InputError: no such joint, no name of a servo.
    """
    drive = _chosen(drives_of(model), joint)
    if not actuator:
        raise InputError("format=bam: give bam.actuator=NAME, the servo's name in BAM, such as sts3215 or xl330")
    law = "m2" if drive.excess else "m1"
    data: dict[str, object] = {"model": law, "actuator": actuator, "armature": drive.armature}
    data |= {"friction_base": drive.friction, "friction_viscous": drive.damping, "command_delay": drive.delay}
    if drive.excess:
        data |= {"friction_stribeck": drive.excess, "dtheta_stribeck": drive.velocity, "alpha": drive.exponent}
    held: tuple[str, ...] = HELD
    if isfinite(drive.rate) and actuator.startswith("sts"):  # others follow any command
        data["max_velocity"], held = drive.rate, (*HELD, "rate")
    if volts is not None and drive.kp > 0.0 and drive.kd > 0.0:
        constant = drive.kd / drive.kp * volts  # kp = kt volts / R, kd = kt^2 / R
        data |= {"kt": constant, "R": constant * volts / drive.kp}
        held = (*held, "kp", "kd")
    left = drive.not_in(held)
    if "kp" not in held:
        left.append("kt and R: give bam.volts, the volts an error of 1 rad makes (vin * kp * error_gain in BAM)")
    return json.dumps(data | {"not_held": left}, indent=2) + "\n", left


def _chosen(drives: list[JointDrive], joint: str | None) -> JointDrive:
    names = [drive.name for drive in drives]
    if joint is None and len(names) > 1:
        raise InputError(
            f"format=bam: a file is of one joint; give bam.joint={names[0]}, or one of {', '.join(names[1:])}"
        )
    if joint not in (None, *names):
        raise InputError(f"bam.joint={joint}: no joint of the model; it has {', '.join(names)}")
    return drives[0 if joint is None else names.index(joint)]
