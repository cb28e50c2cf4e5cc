"""The rotation task at 10 Hz: start, observation, reward, termination."""

from tactile_cube.env.cube_pose import CubePose, cube_pose
from tactile_cube.env.reward import BORNE_TERMS, REWARD_TERMS, Reward
from tactile_cube.env.rotation import RotationEnv, TimeStep
from tactile_cube.env.task import OUTCOMES, Conditions, Curriculum, Task

__all__ = [
    "BORNE_TERMS",
    "OUTCOMES",
    "REWARD_TERMS",
    "Conditions",
    "CubePose",
    "Curriculum",
    "Reward",
    "RotationEnv",
    "Task",
    "TimeStep",
    "cube_pose",
]
