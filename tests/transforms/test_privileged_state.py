import pytest
import torch
from tensordict import TensorDict

from tactile_cube.transforms import PrivilegedState

USUAL = [0.01] * 3 + [1.0] * 2 + [0.1] * 2 + [0.05] * 3 + [1.0] * 15
"""Centimetres, sin and cos, tilt [rad], velocity [m/s], angular velocity [rad/s], q_f [rad]."""


@pytest.mark.parametrize("visible", [True, False])
def test_numbers_of_the_usual_size_become_ones_if_visible(visible: bool) -> None:
    data = PrivilegedState(visible=visible)._call(TensorDict({"object_state": torch.tensor([USUAL] * 2)}, [2]))
    torch.testing.assert_close(data["privileged"], torch.full((2, 25), float(visible)))
    assert "object_state" not in data
