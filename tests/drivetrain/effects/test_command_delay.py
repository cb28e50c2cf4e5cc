import numpy as np
import pytest

from tactile_cube.drivetrain.effects import COMMAND
from tactile_cube.drivetrain.effects.command_delay import LONGEST, CommandDelay
from tactile_cube.drivetrain.signals import ROWS

DT = 0.002


def delayed(commands: np.ndarray, delay: float) -> np.ndarray:
    x, state, out = np.zeros((ROWS, 1)), np.zeros(CommandDelay.state_size(DT)), []
    for command in commands:
        x[COMMAND, 0] = command
        out.append(CommandDelay.law(x, 0, np.array([delay]), state, DT))
    return np.array(out)


@pytest.mark.parametrize("delay", [0.0, 0.004, 0.0101, LONGEST])
def test_a_ramp_arrives_late_by_exactly_the_delay(delay: float) -> None:
    t = np.arange(200) * DT
    np.testing.assert_allclose(delayed(t, delay)[60:], t[60:] - delay, atol=1e-12)


def test_without_delay_commands_pass_bit_for_bit() -> None:
    commands = np.random.default_rng(0).normal(size=100)
    assert np.array_equal(delayed(commands, 0.0), commands)


def test_before_the_start_the_first_command_is_believed_to_have_stood() -> None:
    commands = np.linspace(0.5, 1.0, 20)
    assert np.all(delayed(commands, 0.02)[:10] == 0.5)
