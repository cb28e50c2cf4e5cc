import numpy as np
import pytest

from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2
from tactile_cube.randomization import Randomization, Uniform, identified
from tactile_cube.simulation import EpisodeConstants

JOINTS = DLR_HAND2.joint_names
WIDE = Randomization(factors={"kd": Uniform(0.8, 1.2), "kp": Uniform(0.9, 1.1)}, joint_offset=Uniform(-0.1, 0.1))


def of_finger(**parts) -> ModelFile:
    return ModelFile(joints=["q1", "q2", "q3"], **parts)


def estimate(value: float, half: float = 0.0) -> Estimate:
    return Estimate(value=value, low=value - half, high=value + half)


def test_a_model_of_one_finger_stands_for_all_four() -> None:
    model = of_finger(values={"kd": {"q2": estimate(0.3)}})
    constants, _, _ = identified(model, EpisodeConstants(), WIDE, JOINTS)
    expected = [0.3 if name.endswith("q2") else 0.25 for name in JOINTS]
    np.testing.assert_array_equal(constants.kd, expected)


def test_a_model_of_a_single_servo_stands_for_every_joint(capsys) -> None:
    friction = EffectEstimate(effect="load_dependent_friction@servo", parameters={"coefficient": estimate(0.3, 0.1)})
    model = ModelFile(
        joints=["servo"],
        values={"kp": {"servo": estimate(0.9)}},
        effects=[friction],
        offsets={"servo": estimate(0.02, 0.01)},
    )
    constants, randomization, effects = identified(model, EpisodeConstants(), WIDE, JOINTS)
    np.testing.assert_array_equal(constants.kp, np.full(12, 0.9))
    assert [(one.name, one.joint) for one in effects] == [("load_dependent_friction", joint) for joint in JOINTS]
    assert randomization.joint_offset == WIDE.joint_offset
    assert "taken for the drive of each of its 12 joints" in capsys.readouterr().err


def test_what_is_infinite_stays_the_hands_own() -> None:
    none = {"q2": Estimate(value=np.inf, low=np.inf, high=np.inf)}
    model = of_finger(values={"stiffness": none, "torque_limit": none, "kd": {"q2": estimate(0.3)}})
    constants, _, _ = identified(model, EpisodeConstants(), WIDE, JOINTS)
    np.testing.assert_array_equal(constants.stiffness, EpisodeConstants().stiffness)
    assert constants.torque_limit == EpisodeConstants().torque_limit
    assert list(model.of_a_hand().values) == ["kd"]


def test_an_interval_replaces_the_range_and_a_bare_value_keeps_it() -> None:
    values = {"kd": {name: estimate(0.3, 0.01) for name in ("q1", "q2", "q3")}, "kp": {"q1": estimate(4.0)}}
    constants, randomization, _ = identified(of_finger(values=values), EpisodeConstants(), WIDE, JOINTS)
    assert set(randomization.factors) == {"kp"}
    rng = np.random.default_rng(0)
    drawn = np.array([randomization.constants(constants, rng).kd for _ in range(200)])
    assert 0.29 <= drawn.min() < 0.291 < 0.309 < drawn.max() <= 0.31


def test_an_effect_draws_its_numbers_from_their_intervals() -> None:
    effect = EffectEstimate(effect="torque_bias@q2", parameters={"bias": estimate(-0.2, 0.05)})
    constants, randomization, effects = identified(of_finger(effects=[effect]), EpisodeConstants(), WIDE, JOINTS)
    assert [(one.name, one.values["bias"]) for one in effects] == [("torque_bias", -0.2)] * 4
    drawn = randomization.constants(constants, np.random.default_rng(0)).effects
    assert [one.joint for one in drawn] == [name for name in JOINTS if name.endswith("q2")]
    sizes = {one.values["bias"] for one in drawn}
    assert len(sizes) == 4
    assert all(-0.25 <= size <= -0.15 for size in sizes)


def test_the_span_of_the_offsets_becomes_their_range() -> None:
    offsets = {"q1": estimate(0.01, 0.02), "q2": estimate(0.0, 0.01), "q3": estimate(0.0, 0.03)}
    _, randomization, _ = identified(of_finger(offsets=offsets), EpisodeConstants(), WIDE, JOINTS)
    np.testing.assert_allclose(randomization.joint_offset.quantile(np.zeros(12)), [-0.01, -0.01, -0.03] * 4)


def test_an_offset_that_no_recording_shows_keeps_its_range() -> None:
    offsets = {"q1": estimate(0, 1e-13), "q2": estimate(0, 0.02)}  # q1 turns about the vertical, q3 was not recorded
    _, randomization, _ = identified(of_finger(offsets=offsets), EpisodeConstants(), WIDE, JOINTS)
    np.testing.assert_allclose(randomization.joint_offset.quantile(np.zeros(12)), [-0.095, -0.02, -0.095] * 4)


def test_different_torque_limits_are_refused() -> None:
    model = of_finger(values={"torque_limit": {"q1": estimate(1.0), "q2": estimate(0.5)}})
    with pytest.raises(InputError, match="torque limits"):
        identified(model, EpisodeConstants(), WIDE, JOINTS)


def test_friction_of_the_fingertips_replaces_nominal_value_and_range() -> None:
    friction = EffectEstimate(effect="lateral_friction", parameters={"coefficient": estimate(0.6, 0.05)})
    wide = Randomization(shifts={"tip_friction": Uniform(-0.1, 0.1), "cube_mass": Uniform(-0.005, 0.005)})
    constants, randomization, effects = identified(of_finger(effects=[friction]), EpisodeConstants(), wide, JOINTS)
    assert (constants.tip_friction, effects) == (0.6, [])
    rng = np.random.default_rng(0)
    drawn = [randomization.constants(constants, rng) for _ in range(100)]
    assert 0.55 <= min(one.tip_friction for one in drawn) < 0.56 < 0.64 < max(one.tip_friction for one in drawn) <= 0.65
    assert set(randomization.shifts) == {"cube_mass"}


def test_a_heavier_object_shifts_the_cube_and_its_interval_is_about_the_shift() -> None:
    mass = EffectEstimate(effect="object_mass", parameters={"excess": estimate(0.02, 0.001)})
    com = {axis: estimate(value, 0.001) for axis, value in zip("xyz", (0.01, 0.0, -0.01), strict=True)}
    model = of_finger(effects=[mass, EffectEstimate(effect="object_com", parameters=com)])
    constants, randomization, _ = identified(model, EpisodeConstants(), Randomization(), JOINTS)
    assert constants.cube_mass == pytest.approx(0.07)
    rng = np.random.default_rng(0)
    drawn = [randomization.constants(constants, rng) for _ in range(50)]
    assert all(0.069 <= one.cube_mass <= 0.071 for one in drawn)
    np.testing.assert_allclose(np.mean([one.cube_com for one in drawn], axis=0), [0.01, 0.0, -0.01], atol=5e-4)


def test_a_contact_effect_without_an_interval_keeps_the_range() -> None:
    friction = EffectEstimate(effect="lateral_friction", parameters={"coefficient": estimate(0.6)})
    wide = Randomization(shifts={"tip_friction": Uniform(-0.1, 0.1)})
    constants, randomization, _ = identified(of_finger(effects=[friction]), EpisodeConstants(), wide, JOINTS)
    assert constants.tip_friction == 0.6
    assert randomization.shifts == wide.shifts
