"""Worlds of the blind rounds: the usual ones stay, machines of any size are sane, forms differ and have limits."""

from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
import yaml

from benchmarks.blind import forms, generator, hidden, logs, pairs, sizes, worlds
from benchmarks.blind import plant as at
from benchmarks.blind.dynamics import mass_and_bias
from benchmarks.blind.excitation import multisine, ramps
from benchmarks.blind.physics import simulate
from benchmarks.blind.plant import neutral
from benchmarks.blind.rig import RIGS, Link, Rig

USUAL: dict[str, Any] = {
    "parameters": {"order": 23.0, "amplitude": 0.04236506103443329},
    "drawn": [6.23133, 0.00013367121980461215, 2000.0],
    "means": (0.9988162025316455, 0.13718383014202118, 0.1369413137435913, 0.02870587259531021),
}
"""What a seed drew when there were no other worlds."""


def test_dynamics_of_sliding_and_turning_joints_equal_those_of_mujoco() -> None:
    mujoco = pytest.importorskip("mujoco")
    rng = np.random.default_rng(4)
    links = []
    for i, slides in enumerate((True, False, True, False, True)):
        axis = rng.normal(size=3)
        axis, origin, com = (tuple(v) for v in (axis / np.linalg.norm(axis), rng.normal(size=3), rng.normal(size=3)))
        links.append(Link(f"j{i}", axis, origin, com, 1.0 + i, (1.0, 1.5, 2.0), -9.0, 9.0, slides=slides))
    rig = Rig("mixed", links, (1.0, 2.0, -9.0))
    header = '<mujoco><compiler fusestatic="false"/></mujoco><link name="base"/>'
    model = mujoco.MjModel.from_xml_string(rig.urdf().replace('<link name="base"/>', header))
    model.opt.gravity[:] = rig.gravity
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = rng.normal(size=(2, 5))
    mujoco.mj_forward(model, data)
    mass, bias = mass_and_bias(*rig.arrays(), np.array(rig.gravity), data.qpos.copy(), data.qvel.copy())
    np.testing.assert_allclose(-np.linalg.solve(mass, bias), data.qacc_smooth, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(bias, data.qfrc_bias, rtol=1e-6, atol=1e-9)


def test_an_upright_axis_falls_as_mechanics_says_and_sags_by_its_weight() -> None:
    links = [Link("z", (0, 0, 1), (0, 0, 0), (0, 0, 0), 20.0, (1.0, 1.0, 1.0), -9.0, 9.0, slides=True)]
    rig, one = Rig("axis", links, (0.0, 0.0, -9.81)), lambda x: np.array([x])
    loose = neutral(1)._replace(reflected_inertia=one(5.0), static_friction=one(30.0))
    command = np.zeros((500, 1))
    fallen = simulate(rig, loose, command, 1000.0, np.zeros(1), step=1e-4)[2][-1, 0]
    assert fallen == pytest.approx(-0.5 * (20.0 * 9.81 - 30.0) / 25.0 * 0.5**2, rel=1e-3)
    servo = neutral(1)._replace(kp=one(1e5), kd=one(2e3), stiffness=one(4e5))
    reading, force, carriage = simulate(rig, servo, command, 1000.0, np.zeros(1), step=1e-4)
    weight = 20.0 * 9.81
    assert force[-1, 0] == pytest.approx(weight, rel=1e-4)
    assert reading[-1, 0] == pytest.approx(-weight / 1e5, rel=1e-4)
    assert carriage[-1, 0] == pytest.approx(-weight / 1e5 - weight / 4e5, rel=1e-4)


def test_the_usual_worlds_are_those_of_earlier_rounds() -> None:
    world, bench, truth = generator.draw(10_011, 2.0, ["cogging"], "pendulum")
    assert truth["effects"][0]["parameters"] == pytest.approx(USUAL["parameters"], rel=1e-12)
    assert [world.plant.kp[0], bench.noise, bench.seconds * bench.rate] == pytest.approx(USUAL["drawn"], rel=1e-12)
    table = generator.perform(10_011, world, bench)[0]["trials/ramps_0.parquet"][2]
    means = table.select(pl.selectors.float().abs().mean()).row(0)
    assert means == pytest.approx(USUAL["means"], rel=1e-6)


@pytest.mark.parametrize(("seed", "kind"), [(11, "turning"), (12, "sliding")])
def test_machines_of_any_size_are_drawn_again_alike_and_follow_their_commands(seed: int, kind: str) -> None:
    (world, bench, truth), again = (generator.draw(seed, None, [], kind, worlds="sizes") for _ in range(2))
    assert again[2] == truth
    assert world.rig.urdf() == again[0].rig.urdf()
    assert ("prismatic" in world.rig.urdf()) == (kind == "sliding")
    position, _, command = generator.probe(world, seed)
    assert (np.abs(position - command).mean(axis=0) < 0.2 * (world.high - world.low)).all()
    per = 1.0 / (bench.rate * world.step)
    assert per == pytest.approx(round(per))


def test_torques_of_machines_range_from_a_hundredth_of_a_newton_metre_to_a_thousand() -> None:
    rng = np.random.default_rng(0)
    arms = [sizes.arm(rng, 1, False, True).links[0] for _ in range(300)]
    weights = np.array([9.81 * x.mass * abs(x.com[2]) for x in arms])
    assert 0.004 < weights.min() < 0.05
    assert 100.0 < weights.max() < 1000.0


def test_a_hidden_effect_is_as_large_as_its_machine() -> None:
    for seed in (21, 22):
        world = sizes.draw_machine(np.random.default_rng(seed), [], None, None)[0]
        changed, truth = generator.hide(world, "stribeck_friction", np.random.default_rng(0), 0.5, 0, 1e-4)
        joint = world.rig.actuated.index(truth["joints"][0])
        speeds = np.abs(np.diff(generator.probe(world, 0)[2], axis=0))[:, joint]
        assert truth["parameters"]["velocity"] < 400.0 / world.time_unit * speeds.max()
        torque = np.abs(generator.probe(world, 0)[1][:, joint])
        assert 0.05 * torque.max() < changed.plant.stribeck[joint] < torque.max()


def test_a_pair_acts_on_two_joints_and_every_command_meets_every_friction() -> None:
    rng = np.random.default_rng(0)
    drawn = {tuple(generator.names_for(seed, rng, "pairs")[1]) for seed in range(30)}
    assert drawn == set(product(pairs.COMMAND, pairs.FRICTION))
    effects = generator.draw(3, worlds="pairs")[2]["effects"]
    assert [one["name"] for one in effects] == ["actuator_lag", "friction_drift"]
    assert effects[0]["joints"] != effects[1]["joints"]


def test_a_tilted_mount_moves_an_arm_of_one_joint_as_a_wrong_zero_does() -> None:
    world = generator.draw(2, worlds="twins")[0]
    assert len(world.rig.actuated) == 1
    plain, turned = worlds.copy(world), worlds.copy(world)
    x, _, z = world.rig.gravity
    plain.rig.felt, angle = None, 0.05
    turned.rig.felt = (np.cos(angle) * x + np.sin(angle) * z, 0.0, np.cos(angle) * z - np.sin(angle) * x)
    plain.rig.gravity = (x, 0.0, z)
    plain.plant.offset[0] += angle
    tilted, shifted = (generator.probe(one, 0)[0] for one in (turned, plain))
    assert np.abs(tilted - shifted).max() < 1e-3 * np.abs(tilted).max()


def _replay(**values: float) -> np.ndarray:
    """What a hanging servo reads with these constants of its plant, over four seconds of two kinds of motion."""
    rig = RIGS["pendulum"](np.random.default_rng(0))
    rig.gravity = (0.0, 0.0, -9.81)
    known = {"kp": 6.0, "kd": 0.3, "torque_limit": 2.5, "stiffness": 50.0, "static_friction": 0.05}
    known |= {"reflected_inertia": 0.004, **values}
    plant = neutral(1)._replace(**{name: np.array([float(value)]) for name, value in known.items()})
    rng = np.random.default_rng(1)
    command = np.concatenate([make(rng, *np.array([[-1.2], [1.2]]), 1000, 500.0) for make in (ramps, multisine)])
    return simulate(rig, plant, command, 500.0, command[0])[0]


@pytest.mark.parametrize(
    ("form", "limit"),
    [
        ({"smooth_backlash": 0.02, "smooth_torque": 1e-5}, {"backlash": 0.02}),
        ({"damped_backlash": 0.02, "gap_damping": 3e-3}, {"backlash": 0.02}),
        ({"presliding": 0.005, "micro_damping": 1e-4}, {"presliding": 0.005}),
        ({"presliding": 5e-4, "bristles": at.MAXWELL}, {}),
        ({"presliding": 5e-4, "bristles": at.BOUC_WEN, "bouc_wen_shape": 0.6}, {}),
        ({"stribeck": 0.06, "stribeck_exponent": 1.999}, {"stribeck": 0.06}),
        ({"delay": 0.02, "jitter": 1e-5}, {"delay": 0.02}),
        ({"soft_limit": 1e3}, {}),
        ({"torque_bend": 1e-4}, {}),
        ({"viscous": 0.1, "viscous_difference": 1e-4}, {"viscous": 0.1}),
        ({"load_friction": 0.1, "backdriven_friction": 1e-4}, {"load_friction": 0.1}),
        ({"velocity_lag_2": 2.5e-4}, {}),
        ({"knee": 1e-3, "knee_stiffness": 50.0}, {}),
        ({"drift_rate": -0.05}, {"drift": -0.05e3, "drift_time": 1e3}),
        ({"integral": 1e-3}, {}),
        ({"integral": 20.0, "integral_limit": 1e-5}, {}),
        ({"feedforward": 1e-4}, {}),
        ({"compensation": 1e-4}, {}),
        ({"stall": 1e3, "no_load": 1e3}, {}),
        ({"stall": 0.5, "no_load": 1e6}, {"saturation": 0.5}),
        ({"early": 2e-4}, {}),
    ],
    ids=lambda values: "-".join(values) or "neutral",
)  # fmt: skip
def test_a_form_tends_to_the_form_that_is_known(form: dict[str, float], limit: dict[str, float]) -> None:
    assert np.sqrt(((_replay(**form) - _replay(**limit)) ** 2).mean()) < 4e-4


@pytest.mark.parametrize("name", [*forms.FAMILIES, *logs.MAKERS])
def test_a_form_differs_visibly_from_a_world_without(name: str) -> None:
    plain = worlds.draw_world(np.random.default_rng(5), "pendulum", 1.0)
    expected, torque, _ = generator.probe(plain, 0)
    changed, again = worlds.copy(plain), worlds.copy(plain)
    truths = []
    for world in (changed, again):
        rng, peak = np.random.default_rng(6), np.abs(torque).max(axis=0)
        scene = hidden.Scene(world.rig, world.plant, world.low, world.high, peak, peak, rng, 0.5)
        truths.append((forms.FAMILIES | logs.MAKERS)[name][0](scene, 0))
    assert truths[0] == truths[1]
    moved = generator.probe(changed, 0)[0]
    assert np.isfinite(moved).all()
    assert np.sqrt(((moved - expected) ** 2).mean()) > generator.VISIBLE * 4e-4


def test_forms_are_hidden_in_turn_and_nothing_in_every_sixth() -> None:
    drawn = [generator.names_for(seed, np.random.default_rng(0), "forms")[1] for seed in range(600, 640)]
    assert sum(not names for names in drawn) == 7
    assert {name for names in drawn for name in names} == set(forms.FAMILIES)


def _hanging(**values: float) -> tuple[np.ndarray, np.ndarray]:
    """What a pendulum reads that is told to stand at 0.4 rad for three seconds, and what it weighs there [N m]."""
    rig = RIGS["pendulum"](np.random.default_rng(0))
    rig.gravity = (0.0, 0.0, -9.81)
    known = {"kp": 6.0, "kd": 0.3, "torque_limit": 2.5, "stiffness": np.inf, "reflected_inertia": 0.004, **values}
    plant = neutral(1)._replace(**{name: np.array([float(value)]) for name, value in known.items()})
    reading = simulate(rig, plant, np.full((1500, 1), 0.4), 500.0, np.array([0.4]))[0][:, 0]
    return reading, 9.81 * rig.links[0].mass * -rig.links[0].com[2] * np.sin(reading)


def test_the_parts_of_a_controller_do_to_a_weight_what_they_are_for() -> None:
    sagging, weight = _hanging()
    assert 0.4 - sagging[-1] == pytest.approx(weight[-1] / 6.0, rel=1e-6)
    compensated, weight = _hanging(compensation=0.8)
    assert 0.4 - compensated[-1] == pytest.approx(0.2 * weight[-1] / 6.0, rel=1e-6)
    assert _hanging(integral=12.0)[0][-1] == pytest.approx(0.4, abs=1e-4)
    clamped, weight = _hanging(integral=12.0, integral_limit=0.05)
    assert 0.4 - clamped[-1] == pytest.approx((weight[-1] - 0.05) / 6.0, rel=1e-6)


def test_a_command_of_constant_speed_is_followed_without_lag_where_its_speed_is_fed_forward() -> None:
    rig = RIGS["pendulum"](np.random.default_rng(0))
    rig.gravity = (0.0, -9.81, 0.0)
    known = {"kp": 6.0, "kd": 0.3, "torque_limit": 2.5, "stiffness": np.inf, "reflected_inertia": 0.004}
    command = 0.5 * np.arange(1000)[:, None] / 500.0
    for gain, lag in ((0.0, 0.3 * 0.5 / 6.0), (0.3, 0.0)):
        plant = neutral(1)._replace(**{k: np.array([v]) for k, v in {**known, "feedforward": gain}.items()})
        reading = simulate(rig, plant, command, 500.0, np.zeros(1))[0]
        assert command[-1, 0] + 0.5 / 500.0 - reading[-1, 0] == pytest.approx(lag, abs=1.5e-3)  # held for a row


def test_a_motor_at_its_supply_runs_up_to_its_no_load_speed() -> None:
    rig = RIGS["pendulum"](np.random.default_rng(0))
    rig.gravity = (0.0, -9.81, 0.0)
    known = {"kp": 6.0, "kd": 0.0, "torque_limit": 9.0, "stiffness": np.inf, "reflected_inertia": 0.004}
    plant = neutral(1)._replace(**{k: np.array([v]) for k, v in {**known, "stall": 0.2, "no_load": 3.0}.items()})
    joint = simulate(rig, plant, np.full((300, 1), 50.0), 500.0, np.zeros(1))[2][:, 0]
    inertia = 0.004 + 1e-4 + rig.links[0].mass * rig.links[0].com[2] ** 2
    time = np.arange(1, 301) / 500.0
    rate = 0.2 / 3.0 / inertia
    np.testing.assert_allclose(joint, 3.0 * (time - (1.0 - np.exp(-rate * time)) / rate), atol=2e-3)


def test_a_log_is_as_skewed_late_and_wrong_as_its_bench_says() -> None:
    world, bench, truth = generator.draw(1, 2.0, [], "pendulum", worlds="logs")
    assert 0.0 < abs(bench.skew) < 0.5
    assert truth["bench"]["skew"] == bench.skew
    exact = replace(bench, noise=0.0, resolution=1e-9, skew=0.0)
    logged = {"plain": exact, "early": replace(exact, skew=0.4), "late": replace(exact, late=5)}
    logged["off"] = replace(exact, outliers=0.02)
    tables = {
        name: generator.perform(1, world, one)[0]["trials/multisine_0.parquet"][2].to_numpy().astype(float)
        for name, one in logged.items()
    }
    plain, early, late, off = (tables[name] for name in ("plain", "early", "late", "off"))
    speed = np.gradient(plain[:, 2])
    assert np.abs(plain[5:-5, 2] - 0.4 * speed[5:-5] - early[5:-5, 2]).max() < 0.05 * np.abs(speed).max()
    np.testing.assert_array_equal(late[5:, 1], plain[:-5, 1])
    np.testing.assert_array_equal(late[:, 2], plain[:, 2])
    wrong = np.abs(off[:, 2] - plain[:, 2]) > 0.04
    assert 0.005 < wrong.mean() < 0.05


def test_controllers_and_logs_are_hidden_in_turn_three_effects_at_one_joint() -> None:
    drawn = [generator.names_for(seed, np.random.default_rng(0), "logs") for seed in range(600, 630)]
    assert {label for label, _ in drawn} == set(logs.TURNS)
    _, _, truth = generator.draw(9, 2.0, kind="two_link", worlds="logs")
    assert [one["name"] for one in truth["effects"]] == list(logs.TURNS["hobby_servo"])
    assert len({tuple(one["joints"]) for one in truth["effects"]}) == 1


def test_the_owner_of_a_tilted_machine_states_the_gravity_that_he_believes_in(tmp_path: Path) -> None:
    truth = generator.write(7, tmp_path, 1.0, kind="pendulum", worlds="logs")
    assert truth["effects"][0]["twins"] == ["position_offset"]
    stated = yaml.safe_load((tmp_path / "recording" / "recording.yaml").read_text())["gravity"]
    felt = np.array(truth["effects"][0]["parameters"]["gravity"])
    angle = np.arccos(felt @ stated / np.linalg.norm(felt) / np.linalg.norm(stated))
    assert angle == pytest.approx(truth["effects"][0]["parameters"]["angle"], rel=1e-3)


def test_the_other_engine_refuses_worlds_that_it_does_not_know(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="--engine mujoco moves the usual worlds only, got --worlds sizes"):
        generator.write(1, tmp_path, engine="mujoco", worlds="sizes")
