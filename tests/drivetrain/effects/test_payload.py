from dataclasses import replace

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.drivetrain.effects.scales import FINGER


def test_a_search_begins_with_little_mass_and_with_that_of_a_tool() -> None:
    starts = find_effect("payload").starts_at(replace(FINGER, mass=2.0, lever=0.5))
    assert starts[-1] == {"mass": 1.0, "distance": 0.5}
    assert starts[0]["mass"] == -starts[1]["mass"] > 0.0


def test_where_a_joint_slides_it_does_not_matter_how_far_out_the_tool_is() -> None:
    starts = find_effect("payload").starts_at(replace(FINGER, mass=2.0, lever=0.5, slides=True))
    assert all(set(one) == {"mass"} for one in starts)
