"""What a run costs."""

import json
import time
from pathlib import Path

import pytest

from tactile_cube.training.ledger import LEDGER, Ledger


def test_costs_add_up_over_sessions(tmp_path: Path) -> None:
    for expected in (100.0, 200.0):
        ledger = Ledger(tmp_path / LEDGER, processes=2, simulating=lambda: 100.0, in_process=False)
        ledger.write(steps=7)
        assert json.loads((tmp_path / LEDGER).read_text())["seconds"]["simulating"] == pytest.approx(expected)


def test_reserved_time_without_work_is_waiting(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / LEDGER, processes=3, simulating=lambda: 0.0, in_process=False)
    time.sleep(0.2)
    costs = ledger.costs()
    assert costs.learning < 0.1
    assert costs.waiting == pytest.approx(3 * costs.wall - costs.learning, rel=0.05)


def test_simulation_in_this_process_is_not_booked_as_learning(tmp_path: Path) -> None:
    began = time.process_time()
    ledger = Ledger(tmp_path / LEDGER, processes=1, simulating=lambda: time.process_time() - began, in_process=True)
    while time.process_time() - began < 0.1:
        pass
    assert ledger.costs().learning < 0.02


def test_damaged_ledger_counts_as_empty(tmp_path: Path) -> None:
    (tmp_path / LEDGER).write_text("{")
    assert Ledger(tmp_path / LEDGER, 1, lambda: 0.0, False).before.wall == 0.0
