"""Distributions as values; the constants and the start of one episode drawn from them."""

from tactile_cube.randomization.grasp_starts import Grasps as Grasps
from tactile_cube.randomization.grasp_starts import GraspStarts as GraspStarts
from tactile_cube.randomization.grasp_starts import GraspTable as GraspTable
from tactile_cube.randomization.grasp_starts import StartPoses as StartPoses
from tactile_cube.randomization.grasp_starts import StartStates as StartStates
from tactile_cube.randomization.randomization import Choice as Choice
from tactile_cube.randomization.randomization import Constant as Constant
from tactile_cube.randomization.randomization import Distribution as Distribution
from tactile_cube.randomization.randomization import EffectRange as EffectRange
from tactile_cube.randomization.randomization import Learnability as Learnability
from tactile_cube.randomization.randomization import LogUniform as LogUniform
from tactile_cube.randomization.randomization import Randomization as Randomization
from tactile_cube.randomization.randomization import Uniform as Uniform
from tactile_cube.randomization.randomization import UniformPerJoint as UniformPerJoint
from tactile_cube.randomization.randomization import drawn_places as drawn_places
from tactile_cube.randomization.randomization import identified as identified
from tactile_cube.randomization.randomization import sample as sample
