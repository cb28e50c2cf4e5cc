"""TorchRL transforms between worlds and policy, and the one place that knows their order."""

from tactile_cube.transforms.curriculum import Curriculum, Ramps
from tactile_cube.transforms.disturbances import JointOffset, SensorNoise, StickyAction
from tactile_cube.transforms.finger_exploration import Exploration, FingerExploration
from tactile_cube.transforms.make_env import EnvConfig, make_env, rotation_env

__all__ = [
    "Curriculum", "EnvConfig", "Exploration", "FingerExploration", "JointOffset", "Ramps", "SensorNoise",
    "StickyAction", "make_env", "rotation_env",
]  # fmt: skip
