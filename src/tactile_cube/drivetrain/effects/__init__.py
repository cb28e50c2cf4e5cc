"""The catalogue of physical effects: one class each, used in training, in fitting and in the search."""

from tactile_cube.drivetrain.effects.catalogue import catalogue, find_effect, matching_joints, resolve
from tactile_cube.drivetrain.effects.effect import Effect, Parameter, Place, Stage
from tactile_cube.drivetrain.effects.effect_text import parse_effect
from tactile_cube.drivetrain.signals import (
    ACCELERATION,
    ANGLE,
    COMMAND,
    CONTACT,
    CONTROLLER_TORQUE,
    DEFLECTION,
    DIRECTION,
    FRICTION,
    JOINT_TORQUE,
    LEAD,
    LOAD,
    MEASURED_VELOCITY,
    MOTOR_POSITION,
    POSITION,
    TIME,
    TORQUE,
    VELOCITY,
)

__all__ = [
    "ACCELERATION",
    "ANGLE",
    "COMMAND",
    "CONTACT",
    "CONTROLLER_TORQUE",
    "DEFLECTION",
    "DIRECTION",
    "FRICTION",
    "JOINT_TORQUE",
    "LEAD",
    "LOAD",
    "MEASURED_VELOCITY",
    "MOTOR_POSITION",
    "POSITION",
    "TIME",
    "TORQUE",
    "VELOCITY",
    "Effect",
    "Parameter",
    "Place",
    "Stage",
    "catalogue",
    "find_effect",
    "matching_joints",
    "parse_effect",
    "resolve",
]
