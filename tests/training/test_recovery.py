"""Workers that fail are replaced, and the run ends with the bits of an undisturbed one."""

import gc
import multiprocessing
import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import torch
from torchrl.envs import TransformedEnv

from tactile_cube.training.collection import Background, CollectionError, MultiSyncCollection
from tactile_cube.training.run import Run, train_on
from tests.training.tiny_env import TinyEnv, tiny_environment, tiny_world
from tests.training.tiny_run import finish, tiny_run, weights

COLLECTOR = {"kind": "multi_sync", "processes": 2, "timeout": 3.0, "start_timeout": 10.0}


class FaultyEnv(TinyEnv):
    """Raises, or gives NaN, as long as a file asks for it; asks no more when it has."""

    def __init__(self, worlds: int, seed: int, asks: Path, again: bool = False):
        super().__init__(worlds, seed)
        self._asks, self._again = asks, again

    def _step(self, tensordict):  # type: ignore[no-untyped-def]
        result = super()._step(tensordict)
        if not self._asks.exists():
            return result
        wish = self._asks.read_text()
        if not self._again:
            self._asks.unlink(missing_ok=True)
        if wish == "nan":
            result["observation"][0, 0] = torch.nan
            return result
        raise ValueError("tiny world broke")


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> torch.Tensor:
    return finish(tiny_run(tmp_path_factory.mktemp("reference"), collector=COLLECTOR))


def disturbed(folder: Path, at: int, disturb: Any, environment: Any = None) -> Run:
    """A run that is disturbed once, before iteration `at`; learns on through it."""
    done = []

    def build() -> Run:
        run = tiny_run(folder, collector=COLLECTOR, environment=environment)
        iterate = run.learner.iterate

        def disturbed_iterate() -> None:
            if run.learner.iteration == at and not done:
                done.append(at)
                disturb(run)
            iterate()

        run.learner.iterate = disturbed_iterate  # type: ignore[method-assign]
        return run

    run, reason = train_on(build)
    assert done
    assert reason == "all 160 steps done"
    return run


def send(number: int, run: Run) -> None:
    os.kill(run.learner.collection._processes[1].pid, number)  # type: ignore[attr-defined]


@pytest.mark.parametrize(("number", "at"), [(signal.SIGKILL, 1), (signal.SIGSTOP, 6)])
def test_a_killed_or_stopped_worker_is_replaced(tmp_path, reference, number, at, capsys) -> None:
    run = disturbed(tmp_path, at, partial(send, number))
    assert torch.equal(weights(run), reference)
    assert "going back to the last barrier with new workers" in capsys.readouterr().out
    assert (tmp_path / "metrics.csv").read_text().count("\n") == 1 + 160 // 20
    assert not multiprocessing.active_children()


def test_a_run_that_starts_over_does_so_once(tmp_path: Path, reference: torch.Tensor) -> None:
    finish(tiny_run(tmp_path, seed=1, collector=COLLECTOR))
    first = tiny_run(tmp_path, resume="never", collector=COLLECTOR)
    iterate = first.learner.iterate

    def killed() -> None:
        if first.learner.iteration == 6:
            send(signal.SIGKILL, first)
        iterate()

    first.learner.iterate = killed  # type: ignore[method-assign]
    run, _ = train_on(lambda: first, lambda: tiny_run(tmp_path, collector=COLLECTOR))
    assert torch.equal(weights(run), reference)


def test_ctrl_c_while_workers_start_leaves_none_of_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Waiting:
        def result(self, timeout: float) -> None:
            raise KeyboardInterrupt

    monkeypatch.setattr(Background, "submit", lambda self, call: Waiting())
    killed = list[bool]()
    monkeypatch.setattr(MultiSyncCollection, "_kill", lambda self: killed.append(True))
    with pytest.raises(KeyboardInterrupt):
        tiny_run(tmp_path, collector=COLLECTOR)
    assert killed


def test_a_run_whose_workers_are_ended_with_it_ends_and_goes_on_later(tmp_path: Path, reference: torch.Tensor) -> None:
    def build() -> Run:
        run = tiny_run(tmp_path, collector=COLLECTOR)
        iterate = run.learner.iterate

        def ended() -> None:
            if run.learner.iteration == 6:
                os.kill(os.getpid(), signal.SIGTERM)
                send(signal.SIGTERM, run)
            iterate()

        run.learner.iterate = ended  # type: ignore[method-assign]
        return run

    run, reason = train_on(build)
    assert (reason, run.saved_at) == ("interrupted", 80)
    assert torch.equal(finish(tiny_run(tmp_path, collector=COLLECTOR)), reference)


@pytest.mark.parametrize("wish", ["nan", "raise"])
def test_a_world_that_fails_once_is_replaced(tmp_path: Path, reference: torch.Tensor, wish: str) -> None:
    asks = tmp_path / "asks"
    environment = tiny_environment()
    environment = type(environment)(
        partial(tiny_world, kind=FaultyEnv, asks=asks), environment.sizes, environment.terms, environment.reward_weights
    )
    run = disturbed(tmp_path / "run", 6, lambda _: asks.write_text(wish), environment)
    assert torch.equal(weights(run), reference)


def test_a_fault_that_comes_again_ends_the_run_with_its_reason(tmp_path, capsys) -> None:
    environment = tiny_environment(fail_at=2)
    with pytest.raises(CollectionError, match=r"worker.*3 times in a row without a barrier in between"):
        train_on(lambda: tiny_run(tmp_path, collector=COLLECTOR, environment=environment))
    assert capsys.readouterr().out.count("going back to the last barrier") == 2
    assert not multiprocessing.active_children()


def test_a_worker_stopped_while_it_starts_is_given_up_and_leaves_nothing_behind(tmp_path: Path) -> None:
    def stopped(worlds: int, seed: int) -> TransformedEnv:
        if not (tmp_path / "once").exists():
            (tmp_path / "once").touch()
            os.kill(os.getpid(), signal.SIGSTOP)
        return tiny_world(worlds, seed)

    environment = tiny_environment()
    environment = type(environment)(stopped, environment.sizes, environment.terms, environment.reward_weights)
    collector = COLLECTOR | {"start_timeout": 5.0, "processes": 1}
    with pytest.raises(CollectionError, match=r"no simulation worker answered within collector\.start_timeout=5 s"):
        tiny_run(tmp_path / "run", collector=collector, environment=environment)
    assert not multiprocessing.active_children()


def trained_through(phase: str, folder: Path) -> None:
    """Train to the end, in a program of its own, although the last worker is killed in a phase of the run."""
    gc.disable()  # what is left over then waits for the end of the program, as it may in any
    once, main = folder / "once", os.getpid()

    def killed_at_its_start(worlds: int, seed: int) -> TransformedEnv:
        if phase == "start" and seed == 0 and os.getpid() != main and not once.exists():
            once.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return tiny_world(worlds, seed)

    def build() -> Run:
        run = tiny_run(folder / "run", collector=COLLECTOR | {"start_timeout": 5.0}, environment=environment)
        collect = run.learner.collection
        if phase == "exit":
            collect.close = lambda close=collect.close: (send(signal.SIGKILL, run), close())  # type: ignore[method-assign, misc]
        return run

    tiny = tiny_environment()
    environment = type(tiny)(killed_at_its_start, tiny.sizes, tiny.terms, tiny.reward_weights)
    assert train_on(build)[1] == "all 160 steps done"
    assert once.exists() == (phase == "start")


@pytest.mark.parametrize("phase", ["start", "exit"])
def test_a_program_ends_though_a_worker_was_killed_as_it_began_or_ended(tmp_path: Path, phase: str) -> None:
    program = f"import sys, pathlib, {__name__} as here; here.trained_through(sys.argv[1], pathlib.Path(sys.argv[2]))"
    ended = subprocess.run([sys.executable, "-c", program, phase, str(tmp_path)], check=False, timeout=120.0)
    assert ended.returncode == 0
