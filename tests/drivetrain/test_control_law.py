import math

import pytest

from tactile_cube.drivetrain.laws import impedance_torque, limit_rate, limit_torque, low_pass


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
