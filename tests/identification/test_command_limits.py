from pathlib import Path

import numpy as np
import pytest

from tactile_cube.identification.safe_commands import Envelope, Limits, limits_of, share_used, within_limits
from tactile_cube.measurement.recordings.reading import read_recording
from tests.measurement.small_rig import URDF, write

STATED = 'lower="-0.5" upper="0.5" effort="1" velocity="10"'


@pytest.mark.parametrize(
    ("limit", "torque", "sources"),
    [
        (STATED, 0.8, ("URDF", "URDF", "controller")),
        (STATED, 3.0, ("URDF", "URDF", "URDF")),
        ('lower="-0.5" upper="0.5" effort="0" velocity="0"', float("inf"), ("URDF", "trials", "trials")),
        ('lower="0" upper="0" effort="1" velocity="0"', float("inf"), ("trials", "trials", "URDF")),
        ('lower="-1e9" upper="1e9" effort="1e9" velocity="1e9"', 1.0, ("trials", "trials", "controller")),
    ],
)
def test_limits_are_those_that_are_stated_else_what_the_trials_reached(
    tmp_path: Path, limit: str, torque: float, sources: tuple[str, ...]
) -> None:
    recording = read_recording(
        write(tmp_path, lambda data: data["controller"].update(torque_limit=torque), urdf=URDF.replace(STATED, limit))
    )
    limits = limits_of(recording)
    assert tuple(limits.sources[key][0] for key in ("position", "speed", "torque")) == sources
    reached = np.concatenate([trial.position for trial in recording.trials])[:, 0]
    low, high = (-0.5, 0.5) if sources[0] == "URDF" else (reached.min(), reached.max())
    assert (limits.largest.low[0], limits.largest.high[0]) == (low, high)
    fastest = 0.3 * 2 * np.pi * 0.8
    assert limits.largest.speed[0] == (10.0 if sources[1] == "URDF" else pytest.approx(fastest, rel=0.05))
    asked = max(np.abs(3.0 * (trial.command - trial.position)[:, 0]).max() for trial in recording.trials)
    assert limits.largest.torque[0] == pytest.approx({"controller": torque, "URDF": 1.0, "trials": asked}[sources[2]])


def envelope(low: float, high: float, speed: float, torque: float) -> Envelope:
    return Envelope(*(np.array([value]) for value in (low, high, speed, torque)))


def limits(by: str) -> Limits:
    return Limits(envelope(-1.0, 3.0, 5.0, 2.0), {key: (by,) for key in ("position", "speed", "torque")})


@pytest.mark.parametrize(
    ("reached", "used"),
    [
        (envelope(-0.8, 2.8, 4.5, 1.8), 1.0),
        (envelope(-0.81, 1.0, 0.0, 0.0), 1.81 / 1.8),
        (envelope(1.0, 2.81, 0.0, 0.0), 1.81 / 1.8),
        (envelope(1.0, 1.0, 4.6, 0.0), 4.6 / 4.5),
        (envelope(1.0, 1.0, 0.0, 1.9), 1.9 / 1.8),
        (envelope(1.0, 1.0, np.nan, 0.0), np.inf),
        (envelope(-np.inf, 1.0, 0.0, 0.0), np.inf),
    ],
)
def test_a_margin_is_kept_of_each_stated_limit_and_no_motion_that_ran_away_is_within(
    reached: Envelope, used: float
) -> None:
    assert share_used(reached, limits("URDF").allowed(0.1)) == pytest.approx(used)
    assert within_limits(reached, limits("URDF"), 0.1) == (used <= 1.0)


def test_where_nobody_states_a_limit_a_command_may_do_what_the_trials_did() -> None:
    whole = envelope(-1.0, 3.0, 5.0, 2.0)
    assert within_limits(whole, limits("trials"), 0.1)
    assert not within_limits(whole, limits("URDF"), 0.1)
