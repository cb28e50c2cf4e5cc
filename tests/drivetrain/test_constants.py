import numpy as np
import pytest

from tactile_cube.drivetrain import DrivetrainConstants, check_damping_stability, damping_number
from tactile_cube.errors import InputError
from tests.drivetrain.rigs import finger, wheel


def test_signs_differ_in_the_side_on_which_the_motor_is() -> None:
    assert DrivetrainConstants().compliance == pytest.approx(0.04)
    assert DrivetrainConstants(sign="printed").compliance == pytest.approx(-0.04)
    assert DrivetrainConstants(stiffness=np.inf).compliance == 0.0


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"kp": -1.0}, "kp is -1"),
        ({"kd": (0.2, float("nan"), 0.2)}, "kd"),
        ({"stiffness": 0.0}, "positive"),
        ({"torque_limit": 0.0}, "torque_limit"),
        ({"reflected_inertia": "heavy"}, "reflected_inertia is 'heavy'"),
        ({"sign": "other"}, "'other'"),
        ({"sign": "printed", "kp": 30.0}, "unstable with the printed sign"),
    ],
)
def test_impossible_constants_are_refused(options, complaint) -> None:
    with pytest.raises(InputError, match=complaint):
        DrivetrainConstants(**options)


def test_a_single_inertia_has_the_textbook_number() -> None:
    constants = DrivetrainConstants(kd=0.25, reflected_inertia=1e-3)
    assert damping_number(wheel(4e-3), constants, 0.002, np.zeros(1)) == pytest.approx(0.25 * 0.002 / 5e-3)


def test_the_printed_sign_counts_with_its_larger_damping() -> None:
    printed = DrivetrainConstants(sign="printed", reflected_inertia=1e-3)
    physical = DrivetrainConstants(reflected_inertia=1e-3)
    ratio = damping_number(wheel(), printed, 0.002, np.zeros(1)) / damping_number(wheel(), physical, 0.002, np.zeros(1))
    assert ratio == pytest.approx(1.173, abs=1e-3)


def test_the_worst_pose_decides() -> None:
    constants = DrivetrainConstants()
    poses = [(0.0, 0.0, 0.0), (0.0, 0.0, 1.5)]
    numbers = [damping_number(finger(), constants, 0.002, np.array(pose)) for pose in poses]
    assert check_damping_stability(finger(), constants, 0.002, poses) == max(numbers)
    assert numbers[0] != numbers[1]


def test_an_unstable_loop_is_refused_with_the_numbers() -> None:
    with pytest.raises(InputError, match=r"= 5\.\d+ must stay below 2 \(kd 0.25 .* dt 0.002 s"):
        check_damping_stability(wheel(9.5e-5), DrivetrainConstants(reflected_inertia=0.0), 0.002)
