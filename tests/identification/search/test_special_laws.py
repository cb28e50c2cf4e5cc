from collections.abc import Callable

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import catalogue, find_effect
from tactile_cube.identification.search.candidates import Candidate, forms
from tactile_cube.identification.search.residual_starts import PROFILE, special_candidates
from tactile_cube.measurement.replay.model import Term

EFFECT = find_effect("position_torque")
FORM = next(form for form in forms(EFFECT) if PROFILE in form)
LOW, HIGH = -0.2, 1.2


def found_in(torque: Callable[[np.ndarray], np.ndarray]) -> list[Candidate]:
    """Candidates for a profile whose control torques follow `torque`."""
    controls = dict(zip(FORM, torque(np.linspace(LOW, HIGH, len(FORM))).tolist(), strict=True))
    term = Term(EFFECT, "q2", {"first": LOW, "last": HIGH} | controls, tuple(FORM))
    return special_candidates(Candidate(EFFECT, ("q2",), controls), term, list(catalogue().values()))


@pytest.mark.parametrize("harmonic", [6.0, 17.0, 24.0])
def test_a_ripple_is_recognised(harmonic: float) -> None:
    found = [c for c in found_in(lambda q: 0.03 * np.sin(harmonic * q + 0.4)) if c.effect.name == "cogging"]
    assert {next(iter(c.form)) for c in found} == {"sine", "joint_sine"}
    for ripple in found:
        assert ripple.joints == ("q2",)
        assert ripple.form["harmonic"] == pytest.approx(harmonic, abs=0.5)


@pytest.mark.parametrize(("side", "edge", "sign"), [("upper", 0.9, 1.0), ("lower", 0.15, -1.0)])
def test_a_stop_is_recognised(side: str, edge: float, sign: float) -> None:
    found = found_in(lambda q: 0.1 - sign * 12.0 * np.maximum(sign * (q - edge), 0.0))
    (stop,) = (c for c in found if c.effect.name == "joint_stop")
    assert stop.form[side] == pytest.approx(edge, abs=0.06)
    assert stop.form["stiffness"] == pytest.approx(12.0, rel=0.2)


def test_a_bias_is_recognised() -> None:
    found = found_in(lambda q: -0.015 + 0.002 * np.sin(9.0 * q))
    (bias,) = (c for c in found if c.effect.name == "torque_bias")
    assert bias.form["bias"] == pytest.approx(-0.015, abs=0.001)


def test_a_single_detent_is_neither() -> None:
    assert found_in(lambda q: -0.05 * (q - 0.5) / 0.1 * np.exp(0.5 - 0.5 * ((q - 0.5) / 0.1) ** 2)) == []
