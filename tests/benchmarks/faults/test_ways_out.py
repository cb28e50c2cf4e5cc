"""The attacks on a robot's command: one of them, and that a loss is counted as one."""

from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.faults.ways_out import Outcome, strike, table

SOUND = Outcome("SIGTERM", "running", 0.9, 0.0, 130, closed=True, told=False)


@pytest.mark.timeout(300)
def test_an_attack_finds_fingers_that_press_and_leaves_them_without_torque(tmp_path: Path) -> None:
    outcome = strike("policy raises", "running", 0.3, tmp_path / "one")
    assert outcome.pressed > 0.5
    assert outcome == replace(SOUND, way="policy raises", pressed=outcome.pressed, status=1)


def test_what_presses_in_silence_hangs_or_stays_open_is_a_loss() -> None:
    assert not SOUND.lost
    lost = [replace(SOUND, left=0.02), replace(SOUND, status=None), replace(SOUND, closed=False)]
    assert all(one.lost for one in lost)
    assert not replace(SOUND, left=0.9, told=True).lost
    assert table([SOUND, *lost]).startswith("4 attacks, 3 with a loss")
