"""Which law becomes which simpler one at a value of its parameters: the catalogue says all that is so of one stage."""

from collections.abc import Mapping

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tactile_cube.drivetrain.effects import Effect, Stage, catalogue, find_effect
from tactile_cube.drivetrain.signals import DAMPING, FRICTION, LEAD, LOOP_GAIN, LOOSE_TORQUE, ROWS, TIME, VELOCITY
from tactile_cube.errors import InputError

Law = type[Effect]
STEPS, STEP = 24, 0.01
ALIKE = 1e-3  # part of what a law changes
MOST = 4  # numbers of a form: a profile of more imitates anything on so few steps
POSITIVE = [LEAD, LOOP_GAIN, LOOSE_TORQUE, DAMPING, FRICTION, TIME]


def changed(law: Law, values: Mapping[str, float]) -> NDArray[np.float64]:
    """What a law makes of its row and of all others over some steps of a motion."""
    rng, p = np.random.default_rng(0), np.array([values.get(q.name, q.neutral) for q in law.parameters])
    state, rows = np.zeros(law.kept(STEP)), []
    for signals in 0.3 * rng.standard_normal((STEPS, ROWS, 2)):
        signals[POSITIVE] = np.abs(signals[POSITIVE])
        signals[VELOCITY] *= 0.1
        signals[TIME] *= 1000.0  # minutes
        before = signals[:, 0].copy()
        own = law.law(signals, 0, p, state, STEP) - before[law.stage.value]
        rows += [own, *(signals[:, 0] - before)]
    return np.array(rows)


def imitates(simple: Law, form: Mapping[str, float], wanted: NDArray[np.float64]) -> bool:
    """Whether a law with the numbers of a form free does the same."""
    own = [q for q in simple.parameters if q.name in form]
    names, low, high = [q.name for q in own], np.array([q.low for q in own]), np.array([q.high for q in own])
    begin = np.clip([form[name] for name in names], low + 1e-9, high - 1e-9)
    error = least_squares(
        lambda x: changed(simple, dict(zip(names, x, strict=True))) - wanted, begin, bounds=(low, high)
    )
    return bool(np.linalg.norm(error.fun) <= ALIKE * np.linalg.norm(wanted))


def forms(law: Law) -> list[dict[str, float]]:
    known = law.forms or ({q.name: q.typical for q in law.parameters},)
    return [form for form in known if len(form) <= MOST]


def edges(law: Law, form: Mapping[str, float]) -> dict[tuple[str, float], dict[str, float]]:
    """Each number of a form at where it changes nothing or is largest, the others at a usual size."""
    own = {q.name: q for q in law.parameters if q.name in form}
    usual = {name: q.typical or 0.1 * (q.high - q.low) for name, q in own.items()}
    return {(name, value): usual | {name: value} for name, q in own.items() for value in {q.neutral, q.high}}


def test_every_law_says_which_simpler_one_it_becomes_and_where() -> None:
    laws = [law for law in catalogue().values() if law.stage is not Stage.MECHANISM]
    for law in laws:
        others = [one for one in laws if one.stage is law.stage and one is not law]
        for form in forms(law):
            for (key, value), values in edges(law, form).items():
                wanted = changed(law, values)
                if not np.isfinite(wanted).all() or np.linalg.norm(wanted) < 1e-9:
                    continue
                for simple in others:
                    smaller = [one for one in forms(simple) if len(one) < len(form) and len(one) < len(values)]
                    if any(imitates(simple, one, wanted) for one in smaller):
                        stated = {k: v for values in law.contains.values() for k, v in values.items()}
                        assert key in stated, f"{law.name} becomes {simple.name} at {key}={value}"


def test_every_stated_value_is_one_of_a_number_that_a_search_fits() -> None:
    for law in catalogue().values():
        for name, values in law.contains.items():
            assert name in catalogue()
            own = {q.name: q for q in law.parameters}
            for key, value in values.items():
                assert any(key in form for form in (law.forms or (own,)))
                assert value in (own[key].neutral, float("inf"))


def test_a_law_of_ones_own_that_names_simpler_ones_without_values_is_refused() -> None:
    with pytest.raises(InputError, match=r"contains is \('coulomb_friction',\); give the values where"):
        type("Rubbing", (find_effect("coulomb_friction"),), {"contains": ("coulomb_friction",)})
