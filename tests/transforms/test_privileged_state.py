from collections.abc import Callable

import torch
from torchrl.envs import TransformedEnv
from torchrl.envs.utils import check_env_specs

from tactile_cube.transforms import PrivilegedState
from tactile_cube.transforms.privileged_state import SCALE

MakeEnv = Callable[..., TransformedEnv]


def test_privileged_is_the_object_state_in_its_scale(transformed: MakeEnv) -> None:
    env = transformed(PrivilegedState())
    data = env.reset()
    raw = torch.tensor(env.base_env._moments[0].object_state).float()
    assert torch.allclose(data["privileged"][0], raw * torch.tensor(SCALE))
    assert "object_state" not in data
    assert len(SCALE) == 25


def test_specs_hold(transformed: MakeEnv) -> None:
    check_env_specs(transformed(PrivilegedState()))
