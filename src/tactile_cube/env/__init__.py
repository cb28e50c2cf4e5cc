"""The rotation task at 10 Hz: start, observation, reward, termination."""

from tactile_cube.env.reward import Reward
from tactile_cube.env.rotation import RotationEnv, TimeStep
from tactile_cube.env.task import OUTCOMES, Conditions, CubePose, Task, cube_pose

__all__ = ["OUTCOMES", "Conditions", "CubePose", "Reward", "RotationEnv", "Task", "TimeStep", "cube_pose"]
