"""The missing torque as it is drawn, against a torque that is known."""

from dataclasses import replace

import numpy as np

from tactile_cube.identification.search.residual_shape import Missing
from tactile_cube.workbench.missing_torque import curve, signals

SPEED = "velocity of a [rad/s]"


def missing(noise: float) -> Missing:
    """Torque of 0.1 N m against the speed, in 40 segments of 100 samples."""
    rng = np.random.default_rng(0)
    speed = np.repeat(rng.uniform(-1.0, 1.0, 40), 100) + rng.normal(0.0, 0.1, 4000)
    torque = -0.1 * speed + noise * rng.normal(size=4000)
    position = rng.uniform(-1.0, 1.0, 4000)
    signals = {"position of a [rad]": position, SPEED: speed}
    return Missing("a", torque, signals, np.repeat(np.arange(40), 100), np.zeros(4000, dtype=np.int64))


def test_the_mean_follows_the_law_and_its_interval_covers_it() -> None:
    found = curve(missing(0.3), SPEED)
    known = ~np.isnan(found.low)
    law = -0.1 * found.x[known]
    assert np.mean((found.low[known] <= law) & (law <= found.high[known])) > 0.8
    assert np.nanmax(np.abs(found.mean + 0.1 * found.x)) < 0.08
    assert np.nanmax(found.high - found.low) < 0.3, "one sample scatters by 1.2"


def test_a_law_of_the_angle_has_a_curve_for_either_direction() -> None:
    found = curve(missing(0.0), "position of a [rad]")
    parted = np.flatnonzero(np.isnan(found.x))
    up, down = found.mean[: parted[0]], found.mean[parted[0] + 1 : parted[1]]
    assert up.max() < 0.0 < down.min()


def test_a_torque_is_shown_over_the_signal_that_it_is_a_law_of() -> None:
    assert signals(missing(0.03))[0] == SPEED
    law = missing(0.0)
    turned = replace(law, torque=np.sin(law.signals["position of a [rad]"]))
    assert signals(turned)[0] == "position of a [rad]"
