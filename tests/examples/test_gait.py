"""The example that reads a gait out of an episode: one finger made to lift where it is known."""

import numpy as np
import pytest

from examples.gait import gait


def test_a_finger_that_lifts_once_a_quarter_turn_is_found_where_it_lifts() -> None:
    time = np.arange(0.0, 40.0, 0.1)
    theta = -0.1 * np.pi * time  # eight quarter turns in 40 s
    within = np.degrees(np.abs(theta)) % 90.0
    touches = np.ones((len(time), 4), dtype=bool)
    touches[(within >= 30.0) & (within < 48.0), 1] = False
    step, finger = np.nonzero(touches)
    ring, middle, *_ = gait({"time": time, "theta": theta, "contacts.step": step, "contacts.finger": finger})
    assert (ring.lifts, ring.in_the_air) == (0.0, 0.0)
    assert middle.lifts == pytest.approx(1.0, abs=0.02)
    assert middle.in_the_air == pytest.approx(0.2, abs=0.02)
    assert middle.angle == pytest.approx(30.0, abs=2.0)
    assert middle.regularity > 0.99
