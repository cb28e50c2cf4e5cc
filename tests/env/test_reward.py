from typing import Any

import numpy as np
import pytest

from tactile_cube.env import CubePose, Reward
from tactile_cube.env import reward as terms
from tactile_cube.errors import InputError

STILL = CubePose(0, 0, 0, 0, 0, 0, 0)
NO_TIPS = np.zeros(0)


def step(before: CubePose = STILL, after: CubePose = STILL, direction: int = 1, **parts: Any) -> terms.Step:
    """A step in which nothing happens but what is said."""
    rest = {"first": STILL, "limit": 0.1, "lost": False, "proximal_angles": [], "forces": np.zeros((2, 4))}
    azimuths = {"azimuths_before": NO_TIPS, "azimuths": NO_TIPS}
    return terms.Step(before=before, after=after, direction=direction, **(rest | azimuths | parts))  # type: ignore[arg-type]


def advanced(turned: float, direction: int, before: Any, after: Any) -> float:
    turn = STILL._replace(theta=turned * direction)
    return terms.advance(step(after=turn, direction=direction, azimuths_before=before, azimuths=after))


def test_spin_counts_in_the_rewarded_direction_and_is_clipped_there_only() -> None:
    turned = STILL._replace(theta=0.05)
    assert terms.spin(step(STILL, turned, 1)) == pytest.approx(0.05)
    assert terms.spin(step(STILL, turned, -1)) == pytest.approx(-0.05)
    assert terms.spin(step(STILL, STILL._replace(theta=0.3), 1)) == pytest.approx(0.1)
    assert terms.spin(step(STILL, STILL._replace(theta=0.3), -1)) == pytest.approx(-0.3)


def test_motion_terms_measure_the_change_of_a_step() -> None:
    before = CubePose(0.1, 0.1, 0.1, 0, 0.15, 0.1, 0)
    after = CubePose(0.103, 0.096, 0.098, 0, 0.1, 0.08, 0)
    assert terms.plane(step(before, after)) == pytest.approx(0.005)
    assert terms.height(step(before, after)) == pytest.approx(0.002)
    assert terms.tilt(step(before, after)) == pytest.approx(0.07)
    assert terms.plane(step(after, after)) == terms.height(step(after, after)) == terms.tilt(step(after, after)) == 0.0


def test_proximal_term_sums_the_fourth_power_of_each_fingers_first_joint() -> None:
    assert terms.proximal(step(proximal_angles=[0.1, -0.2, 0.3, 0.0])) == pytest.approx(0.1**4 + 0.2**4 + 0.3**4)


def test_off_centre_is_the_squared_horizontal_distance_from_the_start() -> None:
    moved = step(first=STILL._replace(x=0.1, y=0.1), after=STILL._replace(x=0.13, y=0.06, z=0.5))
    assert terms.off_centre(moved) == pytest.approx(0.0025)


def test_advance_counts_fingers_that_go_back_and_not_those_that_turn_with_the_object() -> None:
    tips = np.array([-1.5, 0.0, 1.5, 3.1])
    assert advanced(0.1, -1, tips, tips - 0.1) == pytest.approx(0.0)
    assert advanced(0.0, 1, tips, tips + np.array([0.3, 0.0, 0.0, 0.0])) == pytest.approx(-0.3)
    assert advanced(0.05, 1, tips, tips) == pytest.approx(0.2)
    assert advanced(0.0, -1, NO_TIPS, NO_TIPS) == 0.0


def test_climb_is_the_squared_height_above_the_start_and_a_lower_object_costs_nothing() -> None:
    assert terms.climb(step(first=STILL._replace(z=0.01), after=STILL._replace(z=0.03, x=0.5))) == pytest.approx(4e-4)
    assert terms.climb(step(after=STILL._replace(z=-0.03))) == 0.0


@pytest.mark.parametrize(
    ("links", "tips", "expected"),
    [
        ([0, 0, 0, 0], [1, 1, 1, 0], (1.0, 0.0, 0.0)),
        ([0, 1, 0, 0], [1, 1, 1, 0], (1.0, 1.0, 0.25)),
        ([0.01, 0, 0, 0], [1, 1, 0.01, 0], (0.0, 0.0, 0.01 / 2.02)),
        ([0, 0, 0, 0], [0, 0, 0, 0], (0.0, 0.0, 0.0)),
    ],
)
def test_three_tips_support_and_other_links_have_a_share(links, tips, expected) -> None:
    held = step(forces=np.array([links, tips], dtype=float))
    assert (terms.tips(held), terms.links(held), terms.link_force(held)) == pytest.approx(expected)


@pytest.mark.parametrize(("row", "paid"), [(1, 0.0), (0, 0.05)])
def test_a_turn_counts_as_the_links_own_only_while_one_touches(row: int, paid: float) -> None:
    forces = np.zeros((2, 4))
    forces[row, 2] = 1.0
    assert terms.link_spin(step(after=STILL._replace(theta=0.05), forces=forces)) == pytest.approx(paid)


def test_a_term_is_a_function_and_a_weight_of_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(terms, "TERMS", dict(terms.TERMS))

    @terms.term(-1)
    def sinking(step: terms.Step) -> float:
        return max(step.before.z - step.after.z, 0.0)

    reward = Reward(sinking=3.0, tips=0.0)
    assert reward.terms == (*terms.PUBLISHED, "tips", "sinking")
    assert reward.weights().tolist() == [*Reward().weights().tolist(), 0.0, -3.0]
    assert reward.measure(step(after=STILL._replace(z=-0.5))).tolist()[-1] == 0.5


def test_a_term_that_there_is_none_of_is_refused() -> None:
    with pytest.raises(InputError, match=r"reward\.speed: no such term; there are spin, height"):
        Reward(speed=1.0)


def test_published_weights_and_their_signs() -> None:
    assert Reward().weights().tolist() == [16, -100, -300, -50, -25, 0, -10, 0]
    assert Reward().fastest == 1.0, "[rad/s]"


def test_penalty_scale_changes_the_motion_weights_only() -> None:
    ratio = Reward(off_centre=1.0, advance=1.0).weights(0.2) / Reward(off_centre=1.0, advance=1.0).weights()
    scaled = {name for name, r in zip(Reward().terms, ratio, strict=True) if r != 1.0}
    assert scaled == {"height", "plane", "tilt"}
    assert ratio[1:4] == pytest.approx([0.2] * 3)


def test_negative_weight_is_refused_because_signs_are_built_in() -> None:
    with pytest.raises(InputError, match=r"reward\.plane is -300"):
        Reward(plane=-300)
