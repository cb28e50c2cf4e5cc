import math

import numpy as np
import pytest

from tactile_cube.drivetrain.laws import (
    add_tendons,
    estimate_contact,
    impedance_torque,
    limit_rate,
    limit_torque,
    link_torques,
    low_pass,
    solve_speeds,
)


@pytest.mark.parametrize("dt", [0.002, 0.05])
def test_low_pass_follows_the_exact_exponential_at_any_step(dt: float) -> None:
    filtered = 0.2
    for _ in range(round(0.5 / dt)):
        filtered = low_pass(filtered, 1.0, 0.5, dt)
    assert filtered == pytest.approx(1.0 - 0.8 * math.exp(-1.0), rel=1e-12)


def test_without_time_constant_the_goal_passes() -> None:
    assert low_pass(0.2, 1.0, 0.0, 0.002) == 1.0


@pytest.mark.parametrize(("target", "expected"), [(1.0, 0.302), (-1.0, 0.298), (0.301, 0.301)])
def test_rate_is_limited_in_both_directions(target: float, expected: float) -> None:
    assert limit_rate(0.3, target, 1.0, 0.002) == pytest.approx(expected)


@pytest.mark.parametrize("target", [5.0, -5.0, 0.31])
def test_limited_target_asks_for_no_more_than_the_torque_limit(target: float) -> None:
    kp, kd, q_m, v, limit = 3.69, 0.25, 0.3, -0.5, 0.4
    torque = kp * (limit_torque(target, q_m, v, kp, kd, limit) - q_m) - kd * v
    wanted = kp * (target - q_m) - kd * v
    assert torque == pytest.approx(max(-limit, min(limit, wanted)))


def test_without_stiffness_there_is_nothing_to_invert() -> None:
    assert limit_torque(5.0, 0.0, 0.0, 0.0, 0.25, 0.4) == 5.0


KP, KD, STIFFNESS = 3.69, 0.25, 25.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_torque_and_motor_position_satisfy_both_equations_at_once(sign: float) -> None:
    q, v, command, extra = 0.3, 0.8, 0.45, 0.01
    torque = impedance_torque(command, q, v, KP, KD, sign / STIFFNESS, extra)
    q_m = q + sign * torque / STIFFNESS + extra
    assert torque == pytest.approx(KP * (command - q_m) - KD * v, rel=1e-12)


@pytest.mark.parametrize(("sign", "gain"), [(1.0, 0.871), (-1.0, 1.173)])
def test_elasticity_scales_the_gains_as_the_paper_s_table_implies(sign: float, gain: float) -> None:
    torque = impedance_torque(0.1, 0.0, 0.0, KP, KD, sign / STIFFNESS, 0.0)
    assert torque / (KP * 0.1) == pytest.approx(gain, abs=1e-3)


FOLLOW, LEADER = np.array([0, 1, 1]), np.array([0, 1])
RATIO, OFFSET = np.array([1.0, 1.0, 0.8]), np.array([0.0, 0.0, 0.1])
J = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.8]])


def equations(seed: int = 0):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3, 3))
    return root @ root.T, rng.normal(size=3), rng


def test_an_impact_is_believed_up_to_a_limit() -> None:
    M, h, _ = equations()
    found = np.zeros(2)
    estimate_contact(FOLLOW, RATIO, M, h, np.zeros(3), np.array([1e4, -1e4, 0.0]), 5.0, found)
    assert np.max(np.abs(found)) == 5.0


def test_bullet_gets_the_wanted_accelerations_with_the_contact_that_it_adds() -> None:
    M, h, rng = equations()
    wanted, contact, torque = rng.normal(size=2), rng.normal(size=2), np.zeros(3)
    link_torques(FOLLOW, LEADER, RATIO, M, h, wanted, contact, torque)
    push = np.array([contact[0], contact[1], 0.0])
    np.testing.assert_allclose(np.linalg.solve(M, torque + push - h), J @ wanted)


def test_a_stretched_tendon_pulls_both_joints_together_without_a_net_power() -> None:
    torque = np.zeros(3)
    q, v = np.array([0.0, 0.5, 0.45]), np.array([0.0, 1.0, 0.6])
    add_tendons(FOLLOW, LEADER, RATIO, OFFSET, q, v, 15.0, 0.02, torque)
    pull = 15.0 * (0.8 * 0.5 + 0.1 - 0.45) + 0.02 * (0.8 - 0.6)
    np.testing.assert_allclose(torque, [0.0, -0.8 * pull, pull])
    assert abs(torque @ (J @ np.array([0.3, 0.7]))) < 1e-15


def solve(M, b, limit, grip, v):
    n = len(b)
    out = np.array(v, dtype=float)
    solve_speeds(M, b, np.asarray(limit), np.asarray(grip), out, np.zeros(n), np.zeros((n, n)), np.zeros(n))
    return out


def random_case(rng, n, creeping):
    root = rng.normal(size=(n, n))
    M = root @ root.T + 0.1 * np.eye(n)
    limit = rng.uniform(0, 2, n) * (rng.random(n) < 0.8)
    grip = rng.uniform(0.1, 3, n) * (rng.random(n) < 0.5) * creeping
    return M, 2 * rng.normal(size=n), limit, grip, rng.normal(size=n) * (rng.random(n) < 0.7)


@pytest.mark.parametrize("creeping", [False, True])
@pytest.mark.parametrize("n", [1, 3, 6])
def test_friction_opposes_what_moves_and_holds_what_stands(n: int, creeping: bool) -> None:
    rng = np.random.default_rng(n)
    stood = moved = 0
    for _ in range(300):
        M, b, limit, grip, before = random_case(rng, n, creeping)
        v = solve(M, b, limit, grip, before)
        impulse = b - M @ v  # what friction took
        full = np.where(grip > 0, np.abs(v) * grip >= limit, v != 0.0)
        np.testing.assert_allclose(impulse[full], (limit * np.sign(v))[full], atol=1e-9)
        assert np.all(np.abs(impulse[~full]) <= limit[~full] + 1e-9)
        np.testing.assert_allclose(impulse[~full & (grip > 0)], (grip * v)[~full & (grip > 0)], atol=1e-9)
        stood, moved = stood + np.sum(~full), moved + np.sum(full)
    assert stood > 20
    assert moved > 20


def test_the_result_does_not_depend_on_the_first_guess() -> None:
    rng = np.random.default_rng(7)
    for _ in range(100):
        M, b, limit, grip, before = random_case(rng, 3, creeping=False)
        np.testing.assert_allclose(
            solve(M, b, limit, grip, before), solve(M, b, limit, grip, -before), rtol=1e-9, atol=1e-12
        )
