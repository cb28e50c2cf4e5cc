"""Every published number, where a command line configures it.

P: Sievers, Pitz, Bäuml, "Learning Purely Tactile In-Hand Manipulation with a Torque-Controlled Hand", ICRA 2022.
W: the authors' website for it (dlr-alr.github.io/dlr-tactile-manipulation, ICRA22 page); W23: its page on ICRA23.
"""

from functools import cache
from typing import Any

import numpy as np
import pytest
from hydra.utils import instantiate

from tactile_cube import composition
from tactile_cube.hand import DLR_HAND2
from tactile_cube.hand.dlr_hand2 import LINKS
from tactile_cube.randomization import Constant, LogUniform, Uniform

Row = tuple[str, Any, str]
PAPER, FINETUNE, FOLLOW_UP = "train +experiment=paper", "train +experiment=finetune", "train randomization=followup"


def within(half_width: float) -> Uniform:
    return Uniform(-half_width, half_width)


PUBLISHED: dict[str, list[Row]] = {
    PAPER: [
        # task
        ("env.task.table", False, "P"),
        ("env.task.gravity_scale", 1.0, "P: full weight"),
        ("env.task.filter_time", 0.5, "P, W: T_s [s]"),
        ("env.task.episode_steps", 100, "W: 10 s at 10 Hz"),
        ("env.task.gravity_onset", 4, "P, W: weightless for less than 0.5 s"),
        ("env.task.symmetry", 4, "P: critics see sin and cos of 4 theta"),
        ("env.stack", 5, "P: N_stack"),
        ("env.exploration.extra", 0.0, "P: nothing but the policy's own randomness"),
        ("env.start.yaw_range", 0.0, "P: starts aligned with the hand"),
        # reward
        ("env.reward.weight.spin", 16, "W: lambda_spin"),
        ("env.reward.weight.height", 100, "W: lambda_z"),
        ("env.reward.weight.plane", 300, "W: lambda_plane"),
        ("env.reward.weight.tilt", 50, "W: lambda_rot"),
        ("env.reward.weight.proximal", 25, "W: lambda_proxy"),
        ("env.reward.weight.off_centre", 0, "P: no such term"),
        ("env.reward.fastest", 1.0, "P, W [rad/s]"),
        # simulator and hand
        ("env.simulation.dt", 2e-3, "P: 500 Hz"),
        ("env.simulation.policy_dt", 0.1, "P: 10 Hz"),
        ("env.constants.gravity", 9.81, "W [m/s^2]"),
        ("env.constants.kp", 3.69, "W: K_P [N m/rad]"),
        ("env.constants.kd", 0.25, "W, table: K_D [N m s/rad]; its picture says 0.28"),
        ("env.constants.stiffness", 25.0, "W: K_e [N m/rad]"),
        ("env.constants.static_friction", 0.02, "W, table [N m]; its picture says 0.02, 0.02, 0.08"),
        ("env.constants.elasticity_sign", 1, "P's recipe for K_e; its eq. (2) is printed with -1"),
        ("env.constants.tip_friction", 0.9, "W"),
        ("env.constants.link_friction", 0.09, "W"),
        ("env.constants.tip_spinning_friction", 0.1, "W, table [m]"),
        ("env.constants.cube_mass", 0.05, "W [kg]"),
        ("env.constants.cube_size", 0.08, "W [m]"),
        # randomisation
        ("env.randomization.shifts.cube_mass", within(0.005), "W [kg]"),
        ("env.randomization.cube_position", [within(0.001), within(0.001), within(0.005)], "W [m]"),
        ("env.randomization.cube_rotation", [within(0.01), within(0.01), within(0.1)], "W [rad]"),
        ("env.randomization.sensor_noise", 0.002, "W [rad]"),
        ("env.randomization.sticky_probability", 0.1, "W"),
        # learning
        ("curriculum.filter_time", 0.12, "W [s]"),
        ("curriculum.gravity_scale", 0.05, "W"),
        ("curriculum.low", 2e6, "W [steps]"),
        ("curriculum.high", 6e6, "W [steps]"),
        ("agent._target_", "tactile_cube.agent.sac.Sac", "P"),
        ("agent.hidden", [512, 512], "P"),
        ("agent.gamma", 0.9, "W"),
        ("agent.target_entropy", -6, "W"),
        ("agent.alpha_init", 0.2, "W"),
        ("agent.weight_decay", 2.5e-4, "W"),
        ("agent.batch_size", 256, "W"),
        ("agent.n_step", 1, "P"),
        ("agent.demonstration_weight", 0, "P: from scratch"),
        ("collector.worlds", 12, "W"),
        ("training.steps_per_iteration", 25, "W"),
        ("training.updates_per_iteration", 100, "W"),
        ("training.learning_starts", 2000, "W"),
        ("training.random_steps", 10_000, "W"),
        ("training.replay_size", 150_000, "W"),
        ("training.steps", 6_500_000, "P, Table I: runs end there"),
    ],
    FINETUNE: [
        ("env.task.episode_steps", 200, "W: 20 s"),
        ("env.reward.fastest", 0.7, "W [rad/s]"),
        ("env.randomization.shifts.tip_friction", within(0.1), "W"),
        ("env.randomization.sensor_noise", 0.02, "W [rad]"),
        ("agent.gamma", 0.92, "W"),
        ("agent.target_entropy", -8, "W"),
        ("training.replay_size", 1_500_000, "W"),
    ],
    FOLLOW_UP: [
        ("env.randomization.values.kp", Constant(5.0), "W23 [N m/rad]"),
        ("env.randomization.values.kd", Constant(0.36), "W23 [N m s/rad]"),
        ("env.randomization.values.torque_limit", Constant(1.0), "W23 [N m]"),
        ("env.randomization.values.tip_spinning_friction", LogUniform(2e-4, 2e-2), "W23 [m]"),
        ("env.randomization.shifts.cube_mass", within(0.02), "W23 [kg]"),
        ("env.randomization.shifts.cube_size", within(0.005), "W23 [m]"),
        ("env.randomization.values.force_mean", Constant(0.04), "W23 [N]"),
        ("env.randomization.values.force_std", Constant(0.008), "W23 [N]"),
        ("env.randomization.values.torque_mean", Constant(0.002), "W23 [N m]"),
        ("env.randomization.values.torque_std", Constant(0.0004), "W23 [N m]"),
        ("env.randomization.values.force_interval", Constant(0.5), "W23 [s]"),
    ],
    "train task=float": [
        ("env.task.table", False, "P, Table I"),
        ("env.task.gravity_scale", 0.05, "P, Table I: weight reduced by 95 %"),
    ],
    "train task=table": [("env.task.table", True, "P, Table I"), ("env.task.gravity_scale", 1.0, "P, Table I")],
    "evaluate protocol=paper": [("protocol.episodes", 10, "P"), ("protocol.seconds", 40, "P")],
    "evaluate protocol=endurance": [("protocol.seconds", 960, "P: nearly 16 min")],
}


@cache
def composed(command: str) -> Any:
    """The configuration of a command line, its environment as the object it describes."""
    name, *overrides = command.split()
    config = composition.composed(name, overrides, with_hydra=True)
    return config, instantiate(config.env) if "env" in config else None


def configured(command: str, path: str) -> Any:
    """What a command line gives a setting; keys of mappings and attributes are both joined by dots."""
    config, env = composed(command)
    value = env if path.startswith("env.") else config
    for name in path.removeprefix("env.").split("."):
        value = value[name] if hasattr(value, "keys") else getattr(value, name)
    return value


def equal(found: Any, wanted: Any) -> bool:
    """Whether a setting has a value; a vector over the joints, if all of them have."""
    if isinstance(wanted, list):
        return list(found) == wanted
    return bool(np.all(np.asarray(found) == wanted))


ROWS = [(command, *row) for command, settings in PUBLISHED.items() for row in settings]


@pytest.mark.parametrize(("command", "path", "value", "source"), ROWS)
def test_a_setting_has_its_published_value(command: str, path: str, value: Any, source: str) -> None:
    found = configured(command, path)
    assert equal(found, value), f"python -m tactile_cube.{command}: {path} is {found}; published: {value} ({source})"


@pytest.mark.parametrize(
    ("name", "degrees"),
    [
        ("lower", (-30, -20, -10)),  # W: theta_min, hardware
        ("upper", (30, 86, 105)),  # W: theta_max
        ("action_lower", (-30, -10, -5)),  # W: theta_lower, simulation
        ("action_upper", (30, 30, 30)),  # W: theta_upper
    ],
)
def test_joint_limits_are_the_published_ones(name: str, degrees: tuple[float, ...]) -> None:
    np.testing.assert_allclose(np.degrees(getattr(DLR_HAND2, name)), np.tile(degrees, 4))


def test_links_have_the_published_lengths() -> None:
    assert [length for length, _, _ in LINKS.values()] == [0.0, 0.075, 0.040, 0.045]  # W [m]


def test_table_1_is_swept_in_six_settings_of_four_runs() -> None:
    sweep = configured("train +experiment=table1", "hydra.sweeper.params")
    assert dict(sweep) == {"task": "table,float,full", "task.filter_time": "0.5,0.1", "seed": "0,1,2,3"}
