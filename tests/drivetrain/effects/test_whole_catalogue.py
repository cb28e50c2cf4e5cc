"""Claims about every effect of the catalogue, its law called as plain Python."""

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import Effect, Stage, catalogue
from tactile_cube.drivetrain.effects.effect import Place
from tactile_cube.drivetrain.signals import ROWS
from tactile_cube.identification.search.candidates import forms

NAMES = (
    "coulomb_friction",
    "viscous_friction",
    "stribeck_friction",
    "load_dependent_friction",
    "asymmetric_friction",
    "presliding_friction",
    "friction_drift",
    "backlash",
    "elasticity",
    "stiffening_elasticity",
    "transmission_error",
    "cogging",
    "command_delay",
    "actuator_lag",
    "velocity_filter_lag",
    "reflected_inertia",
    "payload",
    "torque_gain",
    "torque_curve",
    "torque_bias",
    "torque_crosstalk",
    "position_offset",
    "coupling_error",
    "joint_coupling",
    "torque_saturation",
    "command_dead_zone",
    "rate_limit",
    "position_torque",
    "nonlinear_drag",
    "joint_stop",
)
DT = 0.002
LAWS = [effect for effect in catalogue().values() if effect.stage is not Stage.MECHANISM]
MECHANISMS = [effect for effect in catalogue().values() if effect.stage is Stage.MECHANISM]


def signals(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    x = rng.uniform(0.2, 0.6, (ROWS, 3)) * rng.choice([-1.0, 1.0], (ROWS, 3))
    x[5] = 3.0 + DT * seed  # time
    x[13], x[14] = np.sign(x[1]), np.abs(x[14])  # direction, friction limit
    x[10] = 0.04 * x[9]  # a drive deflects with its torque
    return x


def run(effect: type[Effect], values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Rows that a law returns over a few steps, and what they were before."""
    p = np.array([values.get(q.name, q.neutral) for q in effect.parameters])
    s = np.zeros(effect.state_size(DT))
    before, after = [], []
    for seed in range(6):
        x = signals(seed)
        before.append(x[effect.stage.value, 1])
        if effect.defines("ahead_law"):
            effect.ahead_law(x.copy(), 1, p, s, DT)
        x[effect.stage.value, 1] = effect.law(x, 1, p, s, DT)
        if effect.defines("torque_law"):
            x[12, 1] += effect.torque_law(x, 1, p, s, DT) - x[9, 1]
        after.append(x[[effect.stage.value, 12], 1].sum())
        before[-1] += signals(seed)[12, 1] if effect.stage.value != 12 else before[-1]
        if effect.stage.value == 12:
            after[-1] = 2 * x[12, 1]
    return np.array(before), np.array(after)


def test_the_catalogue_has_every_promised_name() -> None:
    assert sorted(NAMES) == sorted(catalogue())


@pytest.mark.parametrize("effect", LAWS, ids=lambda effect: effect.name)
def test_neutral_values_change_nothing_bit_for_bit(effect: type[Effect]) -> None:
    before, after = run(effect, {})
    assert np.array_equal(before, after)


@pytest.mark.parametrize("effect", LAWS, ids=lambda effect: effect.name)
def test_every_form_changes_something(effect: type[Effect]) -> None:
    for form in forms(effect):
        values = {key: value for key, value in form.items()}
        if effect.name == "joint_stop":
            values |= {"upper": 0.1} if "upper" in form else {"lower": -0.1}
        if effect.name == "command_dead_zone":
            values = dict.fromkeys(form, 0.3)
        before, after = run(effect, values)
        assert np.abs(after - before).max() > 0.0, form


@pytest.mark.parametrize("effect", MECHANISMS, ids=lambda effect: effect.name)
def test_mechanisms_change_constants_and_nothing_at_neutral(effect: type[Effect]) -> None:
    place = Place(joint=2, chain=0, link=2, followers=(3,))

    def constants() -> dict[str, np.ndarray]:
        return {
            "mass": np.full((1, 4), 0.05),
            "com": np.tile([0.0, 0.0, -0.02], (1, 4, 1)),
            "inertia": np.tile(1e-5 * np.eye(3), (1, 4, 1, 1)),
            "ratio": np.ones((1, 4)),
            "offset": np.zeros((1, 4)),
            "reflected_inertia": np.full(3, 0.003),
            "compliance": np.full(3, 0.04),
        }

    plain, neutral, typical = constants(), constants(), constants()
    effect.configure(neutral.__getitem__, place, np.array([p.neutral for p in effect.parameters]))
    effect.configure(typical.__getitem__, place, np.array([p.typical for p in effect.parameters]))
    assert all(np.array_equal(plain[key], neutral[key]) for key in plain)
    assert any(not np.array_equal(plain[key], typical[key]) for key in plain)


def test_a_payload_keeps_the_parallel_axis_theorem() -> None:
    """A point mass on a massless link at distance d has inertia m d^2 about the joint."""
    payload = catalogue()["payload"]
    view = {
        "mass": np.full((1, 1), 1e-9),
        "com": np.array([[[0.0, 0.0, -0.02]]]),
        "inertia": np.zeros((1, 1, 3, 3)),
    }
    payload.configure(view.__getitem__, Place(joint=0, chain=0, link=0), np.array([0.1, 0.05]))
    about_joint = view["inertia"][0, 0, 0, 0] + view["mass"][0, 0] * view["com"][0, 0, 2] ** 2
    assert about_joint == pytest.approx(0.1 * 0.05**2, rel=1e-6)
    assert view["com"][0, 0, 2] == pytest.approx(-0.05, rel=1e-6)
