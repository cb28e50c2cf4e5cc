import torch
from torchrl.envs import TransformedEnv
from torchrl.envs.transforms import Compose

from tactile_cube.env import Reward, RotationEnv, Task
from tactile_cube.env.worlds import WorldsEnv
from tactile_cube.randomization import Randomization, StartStates
from tactile_cube.simulation import constants_of
from tactile_cube.training.build import rotation_environment
from tactile_cube.transforms import EnvConfig, Exploration
from tactile_cube.transforms.make_env import transforms
from tests.conftest import ScriptedWorld
from tests.own_hands import own_hand


def test_sizes_of_observation_and_action_follow_from_the_hand() -> None:
    hand = own_hand("left", "right")  # 2 fingers x 4 joints
    constants = constants_of(hand)
    config = EnvConfig(Task("table"), constants=constants, exploration=Exploration(episodes=1.0), hand=hand)
    poses = StartStates(poses=3, yaw_range=0.2).of(hand, constants)
    task = RotationEnv(ScriptedWorld(), config.task, Reward(), Randomization(), poses, constants, hand)  # type: ignore[arg-type]
    env = TransformedEnv(WorldsEnv([task]), Compose(*transforms(config, explore=True)))
    data = env.rollout(8)
    assert data["observation"].shape[-1] == 5 * 2 * 8
    assert data["privileged"].shape[-1] == 13 + 8
    assert data["next", "action_taken"].shape[-1] == 8
    sizes = rotation_environment(config).sizes
    assert (sizes.observation, sizes.privileged, sizes.action) == (80, 21, 8)
    assert torch.isfinite(data["next", "reward"]).all()
