"""Starts that are read from what a fit leaves."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import ANGLE, JOINT_TORQUE, find_effect
from tactile_cube.drivetrain.effects.effect import FINGER
from tactile_cube.drivetrain.signals import ROWS
from tactile_cube.identification.search.residual_shape import Missing
from tactile_cube.identification.search.residual_starts import PROFILE, peaks, start_of

EFFECT = find_effect("position_torque")
FORM = next(form for form in EFFECT.forms_at(FINGER) if PROFILE in form)


def detent(position: np.ndarray) -> np.ndarray:
    """Peak 0.05 N m, as narrow as a twelfth of the range."""
    x = (position - 0.3) / 0.15
    return -0.05 * x * np.exp(0.5 - 0.5 * x**2)


def test_a_profile_starts_at_the_torque_that_is_missing() -> None:
    rng = np.random.default_rng(3)
    position = rng.uniform(-0.8, 1.0, 20_000)
    torque = detent(position) + 0.02 * rng.normal(size=len(position))
    none = np.zeros(len(position), dtype=np.int64)
    missing = Missing("q1", torque, {"position of q1 [rad]": position}, none, none)
    start = start_of(EFFECT, FORM, missing, replace(FINGER, low=-0.8, high=1.0))
    values = np.array([({"first": -0.8, "last": 1.0} | start).get(p.name, p.neutral) for p in EFFECT.parameters])
    x = np.zeros((ROWS, 1))
    for angle in np.linspace(-0.7, 0.9, 30):
        x[ANGLE, 0], x[JOINT_TORQUE, 0] = angle, 0.0
        assert EFFECT.law(x, 0, values, np.zeros(0), 0.002) == pytest.approx(detent(angle), abs=0.006)


def moved(torque: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]) -> Missing:
    """What a torque of position, velocity and acceleration leaves of a swing, with noise and a slope."""
    time = np.linspace(0.0, 40.0, 6000)
    position, velocity, acceleration = 0.9 * np.sin(time) + 0.2, 0.9 * np.cos(time), -0.9 * np.sin(time)
    missing = torque(position, velocity, acceleration)
    noise = 0.5 * missing.std() * np.random.default_rng(1).normal(size=len(time))
    signals = {"position of a [rad]": position, "velocity of a [rad/s]": velocity}
    signals["acceleration of a [rad/s^2]"] = acceleration
    none = np.zeros(len(time), dtype=np.int64)
    return Missing("a", missing + noise + 2.0 * missing.std() * position, signals, none, none)


@pytest.mark.parametrize("harmonic", [6.0, 24.7, 91.0])
def test_the_strongest_peak_is_the_harmonic_that_was_put_in(harmonic: float) -> None:
    missing = moved(lambda q, v, a: 0.02 * np.sin(harmonic * q) - 0.01 * np.cos(harmonic * q))
    found, sine, cosine = peaks(missing)[0]
    assert found == pytest.approx(harmonic, abs=0.6)
    assert np.hypot(sine, cosine) == pytest.approx(np.hypot(0.02, 0.01), rel=0.35)


@pytest.mark.parametrize("harmonic", [6.0, 24.7])
@pytest.mark.parametrize("response", [(0.3, 0.0), (0.0, 0.01), (0.1, 0.01)])
def test_an_error_of_the_sensor_is_found_by_what_damping_and_inertia_make_of_it(harmonic, response) -> None:
    """The error is 2 sin(n q) - cos(n q) [mrad]."""

    def torque(q, v, a):
        sine, cosine, n = np.sin(harmonic * q), np.cos(harmonic * q), harmonic
        slope = 2e-3 * cosine + 1e-3 * sine
        bend = n * a * slope - (n * v) ** 2 * (2e-3 * sine - 1e-3 * cosine)
        return response[0] * n * v * slope + response[1] * bend

    found, sine, cosine = peaks(moved(torque), response)[0]
    assert found == pytest.approx(harmonic, abs=0.6)
    assert np.hypot(sine, cosine) == pytest.approx(np.hypot(2e-3, 1e-3), rel=0.35)


@pytest.mark.parametrize("harmonic", [1.5, 2.4, 3.7])
def test_a_wave_longer_than_the_range_of_motion_has_a_start_nearby(harmonic: float) -> None:
    """The range is 1.8 rad, of which a wave of 3.5 / rad takes all."""
    missing = moved(lambda q, v, a: 0.02 * np.sin(harmonic * q) - 0.01 * np.cos(harmonic * q))
    ratios = [max(found / harmonic, harmonic / found) for found, _, _ in peaks(missing)]
    assert min(ratios) < 1.5
