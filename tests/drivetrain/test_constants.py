import numpy as np
import pytest

from tactile_cube.drivetrain import DrivetrainConstants
from tactile_cube.errors import InputError


def test_signs_differ_in_the_side_on_which_the_motor_is() -> None:
    assert DrivetrainConstants().compliance == pytest.approx(0.04)
    assert DrivetrainConstants(sign="printed").compliance == pytest.approx(-0.04)


def test_a_rigid_drive_has_no_compliance() -> None:
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
