import pytest

from tactile_cube.drivetrain.impedance import impedance_torque

KP, KD, STIFFNESS = 3.69, 0.25, 25.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_torque_and_motor_position_satisfy_both_equations_at_once(sign: float) -> None:
    q, v, command, extra = 0.3, 0.8, 0.45, 0.01
    torque = impedance_torque(command, q, v, KP, KD, sign / STIFFNESS, extra, 10.0)
    q_m = q + sign * torque / STIFFNESS + extra
    assert torque == pytest.approx(KP * (command - q_m) - KD * v, rel=1e-12)


@pytest.mark.parametrize(("sign", "gain"), [(1.0, 0.871), (-1.0, 1.173)])
def test_elasticity_scales_the_gains_as_the_paper_s_table_implies(sign: float, gain: float) -> None:
    torque = impedance_torque(0.1, 0.0, 0.0, KP, KD, sign / STIFFNESS, 0.0, 10.0)
    assert torque / (KP * 0.1) == pytest.approx(gain, abs=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_torque_stays_within_its_limit(side: float) -> None:
    assert impedance_torque(side, 0.0, 0.0, KP, KD, 0.04, 0.0, 0.5) == side * 0.5
