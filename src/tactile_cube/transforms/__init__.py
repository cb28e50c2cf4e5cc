"""TorchRL transforms between worlds and policy, and the one place that knows their order."""

from tactile_cube.transforms.finger_exploration import Exploration, FingerExploration
from tactile_cube.transforms.joint_offset import JointOffset
from tactile_cube.transforms.make_env import EnvConfig, make_env, rotation_env
from tactile_cube.transforms.privileged_state import PrivilegedState
from tactile_cube.transforms.sensor_noise import SensorNoise
from tactile_cube.transforms.sticky_action import StickyAction

__all__ = [
    "EnvConfig",
    "Exploration",
    "FingerExploration",
    "JointOffset",
    "PrivilegedState",
    "SensorNoise",
    "StickyAction",
    "make_env",
    "rotation_env",
]
