"""Where a search begins follows from the sizes of the joint."""

from dataclasses import replace

import pytest

from tactile_cube.drivetrain.effects.mechanism import Payload
from tactile_cube.drivetrain.effects.scales import FINGER, Scales, unit_at
from tactile_cube.drivetrain.effects.transmission import Elasticity, StiffeningElasticity

CARRIAGE = Scales(
    torque=9.4, often=1.35, seldom=112.0, low=-0.116, high=0.1, speed=0.473, command_speed=0.517,
    inertia=7.3, mass=6.63, lever=0.217, time=1.0, slides=True, neighbours=0,
)  # fmt: skip
KP = 40400.0  # [N/m] of that carriage: one tenth of a millimetre of error for 4 N


@pytest.mark.parametrize(("scales", "kp"), [(FINGER, 3.7), (CARRIAGE, KP)], ids=["finger", "carriage"])
def test_a_start_is_a_part_of_the_controllers_own_compliance(scales: Scales, kp: float) -> None:
    ratios = [kp * start["compliance"] for start in Elasticity.starts_at(scales)]
    assert any(0.05 < ratio < 0.5 for ratio in ratios), ratios
    springs = dict.fromkeys(start["compliance"] for start in StiffeningElasticity.starts_at(scales))
    assert list(springs) == pytest.approx([2.0 * start["compliance"] for start in Elasticity.starts_at(scales)])


def test_units_read_as_somebody_with_a_sliding_joint_writes_them() -> None:
    assert unit_at("rad/(N m)", slides=True) == "m/N"
    assert unit_at("N m s/rad", slides=True) == "N s/m"
    assert unit_at("rad/(N m)", slides=False) == "rad/(N m)"


def test_a_search_begins_with_little_mass_and_with_that_of_a_counterweight_and_a_tool() -> None:
    starts = Payload.starts_at(replace(FINGER, mass=2.0, lever=0.5))
    assert starts[-2:] == [{"mass": 1.0, "distance": -0.5}, {"mass": 1.0, "distance": 0.5}]
    assert starts[0]["mass"] == -starts[1]["mass"] > 0.0


def test_where_a_joint_slides_it_does_not_matter_how_far_out_the_tool_is() -> None:
    starts = Payload.starts_at(replace(FINGER, mass=2.0, lever=0.5, slides=True))
    assert all(set(one) == {"mass"} for one in starts)
