"""Ctrl-C ends a run within seconds, and the same command goes on as if nothing had happened."""

import os
import re
import signal
import time
from pathlib import Path

import pytest
import torch

from tactile_cube.training import interruption
from tests.training.test_loop import finish
from tests.training.tiny_run import tiny_run


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> torch.Tensor:
    return finish(tiny_run(tmp_path_factory.mktemp("reference")))


def interrupted(folder: Path, at: int, signals: list[int], seconds: float = 0.0) -> tuple[str, int]:
    """Train with signals in iteration `at`, whose block takes `seconds` longer; reason and iterations done."""
    run = tiny_run(folder)
    iterate = run.learner.iterate

    def interrupted_iterate() -> None:
        if run.learner.iteration == at:
            for number in signals:
                os.kill(os.getpid(), number)
        if run.learner.iteration >= at:
            time.sleep(seconds)
        iterate()

    run.learner.iterate = interrupted_iterate  # type: ignore[method-assign]
    reason = run.train()
    run.conclude(reason)
    run.close()
    return reason, run.learner.iteration


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_goes_on_to_a_barrier_that_is_near(
    tmp_path: Path, reference: torch.Tensor, number: int, capsys: pytest.CaptureFixture[str]
) -> None:
    assert interrupted(tmp_path, 2, [number]) == ("interrupted", 4)
    said = capsys.readouterr().out
    assert re.search(r"Ctrl-C: going on to the next barrier, where the run is saved, in \d s; again to stop now", said)
    assert "saved at 80 steps: the same command goes on from there\n" in said
    assert torch.equal(finish(tiny_run(tmp_path)), reference)


def test_ctrl_c_stops_at_once_when_the_barrier_is_far(
    tmp_path: Path, reference: torch.Tensor, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(interruption, "PATIENCE", 1e-6)
    assert interrupted(tmp_path, 6, [signal.SIGINT]) == ("interrupted", 6)
    assert "saved at 80 steps: the same command goes on from there; the 40 steps since then are done again" in (
        capsys.readouterr().out
    )
    resumed = tiny_run(tmp_path)
    assert resumed.learner.iteration == 4
    assert torch.equal(finish(resumed), reference)


def test_a_barrier_later_than_promised_is_not_waited_for(
    tmp_path: Path, reference: torch.Tensor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(interruption, "PATIENCE", 1.0)
    assert interrupted(tmp_path, 5, [signal.SIGINT], seconds=5.0) == ("interrupted", 5)
    assert torch.equal(finish(tiny_run(tmp_path)), reference)


@pytest.mark.parametrize("at", [0, 2, 6])
def test_second_ctrl_c_stops_at_once_and_loses_what_came_after_the_last_barrier(
    tmp_path: Path, reference: torch.Tensor, at: int
) -> None:
    assert interrupted(tmp_path, at, [signal.SIGINT, signal.SIGINT]) == ("interrupted", at)
    resumed = tiny_run(tmp_path)
    assert resumed.learner.iteration == at // 4 * 4
    assert torch.equal(finish(resumed), reference)


def test_the_first_checkpoint_is_there_before_the_first_iteration(tmp_path: Path) -> None:
    run = tiny_run(tmp_path)
    seen = []
    iterate = run.learner.iterate

    def watched() -> None:
        seen.append((tmp_path / "checkpoint.pt").is_file())
        iterate()

    run.learner.iterate = watched  # type: ignore[method-assign]
    finish(run)
    assert all(seen)
