"""What lies in a run folder besides checkpoints, and the line that says how training goes."""

import io
import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from tactile_cube.errors import InputError
from tactile_cube.training import loggers
from tactile_cube.training.build import lock_folder
from tactile_cube.training.ledger import LEDGER, Costs, Ledger
from tactile_cube.training.loggers import ProgressLine
from tactile_cube.training.run import FILE, Finished

CONFIG = {"seed": 1, "training": {"steps": 100, "resume": "auto"}, "hidden": [16, 16]}


def test_a_second_run_in_the_same_folder_is_refused_until_the_first_ends(tmp_path: Path) -> None:
    first = lock_folder(tmp_path)
    with pytest.raises(InputError, match=f"{tmp_path}: another process trains"):
        lock_folder(tmp_path)
    first.release()
    lock_folder(tmp_path).release()


def finished(folder: Path) -> None:
    (folder / "policy.safetensors").touch()
    Finished("all 100 steps done", 100, 1.5, CONFIG).write(folder)


def test_a_finished_run_is_found_by_the_same_settings(tmp_path: Path) -> None:
    assert Finished.of(tmp_path, CONFIG) is None
    finished(tmp_path)
    found = Finished.of(tmp_path, CONFIG | {"hidden": (16, 16)})
    assert found is not None
    assert (found.reason, found.steps, found.final_angle) == ("all 100 steps done", 100, 1.5)


def test_more_steps_starting_over_a_damaged_file_or_a_lost_policy_do_not_find_it(tmp_path: Path) -> None:
    finished(tmp_path)
    assert Finished.of(tmp_path, CONFIG | {"training": {"steps": 200, "resume": "auto"}}) is None
    never = CONFIG | {"training": {"steps": 100, "resume": "never"}}
    Finished("all 100 steps done", 100, 1.5, never).write(tmp_path)
    assert Finished.of(tmp_path, never) is None
    (tmp_path / FILE).write_text("{")
    assert Finished.of(tmp_path, CONFIG) is None
    finished(tmp_path)
    (tmp_path / "policy.safetensors").unlink()
    assert Finished.of(tmp_path, CONFIG) is None


def test_costs_add_up_over_sessions(tmp_path: Path) -> None:
    for expected in (100.0, 200.0):
        Ledger(tmp_path / LEDGER, simulating=lambda: 100.0, in_process=False).write(steps=7)
        assert json.loads((tmp_path / LEDGER).read_text())["seconds"]["simulating"] == pytest.approx(expected)


@pytest.mark.parametrize(("in_process", "learning"), [(False, 2.0), (True, 1.5)])
def test_what_is_simulated_in_the_learners_process_is_counted_once(tmp_path, in_process, learning, monkeypatch) -> None:
    (tmp_path / LEDGER).write_text("{")  # a damaged one counts for nothing
    clocks = SimpleNamespace(perf_counter=iter([100.0, 107.5]).__next__, process_time=iter([30.0, 32.0]).__next__)
    monkeypatch.setattr("tactile_cube.training.ledger.time", clocks)
    costs = Ledger(tmp_path / LEDGER, simulating=lambda: 0.5, in_process=in_process).costs()
    assert costs == Costs(simulating=0.5, learning=learning, wall=7.5)


def test_line_says_steps_rates_angle_curriculum_and_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([100.0, 101.0, 110.0, 115.0, 120.0, 1000.0, 1005.0])
    monkeypatch.setattr(loggers.time, "perf_counter", lambda: next(clock))
    stream = io.StringIO()
    reference = ((2000, 0.5, 1.0), (7000, 2.0, 4.0))
    line = ProgressLine(total=10_000, steps=1000, updates=50, reference=reference, stream=stream)
    summary = {"final_angle": 1.234, "episode_length": 88.0, "ended_time_limit": 0.9}
    line.stage, line.later = "stage 1 of 2", 3000
    line.show(1010, 51, summary, {"T_s": 0.25})
    assert stream.getvalue() == ""  # too soon
    line.show(4000, 1050, summary, {"T_s": 0.25})
    assert stream.getvalue() == (
        "stage 1 of 2 |      4.0 k of 10 k steps |  300 steps/s  100 updates/s | final angle  1.23 rad (recorded "
        "runs 1.10 to 2.20),  88 steps | 90 % kept | T_s 0.25 | usually 0 min 20 s left\n"
    )
    line.show(4000, 1050, summary, {"T_s": 0.25})  # a busy machine: no step for five seconds
    assert stream.getvalue().endswith("usually 0 min 30 s left\n")
    line.later = 0
    line.show(12_000, 3000, summary, {"T_s": 0.25})  # the last barrier lies beyond the end
    assert stream.getvalue().endswith("at most 0 min 00 s left\n")
    assert stream.getvalue().count("recorded runs") == 2
    line.show(12_000, 3000, summary, {"T_s": 0.25})
    line.show(12_000, 3000, summary, {"T_s": 0.25})
    assert stream.getvalue().endswith("time left unknown\n")
