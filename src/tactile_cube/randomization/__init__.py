"""Distributions as values; the constants and the start of one episode drawn from them."""

from tactile_cube.randomization.grasp_starts import Grasps, GraspStarts, GraspTable, StartPoses, StartStates
from tactile_cube.randomization.identified import identified
from tactile_cube.randomization.randomization import (
    Choice,
    Constant,
    Distribution,
    EffectRange,
    Learnability,
    LogUniform,
    Randomization,
    Uniform,
    UniformPerJoint,
    drawn_places,
    sample,
)

__all__ = [
    "Choice",
    "Constant",
    "Distribution",
    "EffectRange",
    "GraspStarts",
    "GraspTable",
    "Grasps",
    "Learnability",
    "LogUniform",
    "Randomization",
    "StartPoses",
    "StartStates",
    "Uniform",
    "UniformPerJoint",
    "drawn_places",
    "identified",
    "sample",
]
