"""Distributions as values; the constants and the start of one episode drawn from them."""

from tactile_cube.randomization.distributions import Constant, Distribution, LogUniform, Normal, Uniform, sample
from tactile_cube.randomization.randomization import Randomization
from tactile_cube.randomization.start_states import StartPoses, StartStates

__all__ = [
    "Constant",
    "Distribution",
    "LogUniform",
    "Normal",
    "Randomization",
    "StartPoses",
    "StartStates",
    "Uniform",
    "sample",
]
