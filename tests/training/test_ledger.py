"""What a run costs."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from tactile_cube.training.ledger import LEDGER, Costs, Ledger


def test_costs_add_up_over_sessions(tmp_path: Path) -> None:
    for expected in (100.0, 200.0):
        ledger = Ledger(tmp_path / LEDGER, processes=2, simulating=lambda: 100.0, in_process=False)
        ledger.write(steps=7)
        assert json.loads((tmp_path / LEDGER).read_text())["seconds"]["simulating"] == pytest.approx(expected)


@pytest.mark.parametrize(("in_process", "learning", "waiting"), [(False, 2.0, 20.0), (True, 1.5, 20.5)])
def test_what_neither_workers_nor_learner_used_of_the_cores_is_waiting(
    tmp_path: Path, in_process: bool, learning: float, waiting: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    clocks = SimpleNamespace(perf_counter=iter([100.0, 107.5]).__next__, process_time=iter([30.0, 32.0]).__next__)
    monkeypatch.setattr("tactile_cube.training.ledger.time", clocks)
    costs = Ledger(tmp_path / LEDGER, processes=3, simulating=lambda: 0.5, in_process=in_process).costs()
    assert costs == Costs(simulating=0.5, learning=learning, waiting=waiting, wall=7.5)


def test_damaged_ledger_counts_as_empty(tmp_path: Path) -> None:
    (tmp_path / LEDGER).write_text("{")
    assert Ledger(tmp_path / LEDGER, 1, lambda: 0.0, False).before.wall == 0.0
