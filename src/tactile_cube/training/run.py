"""A run: its folder, its sessions, faults of its workers, when it saves and when and how it ends."""

import contextlib
import gc
import json
import signal
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Self

from filelock import BaseFileLock
from torchrl.record.loggers.common import Logger

from tactile_cube.agent.networks import Actor
from tactile_cube.agent.policy_file import PolicyInfo, current_commit, save_policy
from tactile_cube.training.checkpoint import Checkpoints
from tactile_cube.training.collection import CollectionError
from tactile_cube.training.ledger import Ledger
from tactile_cube.training.loggers import MetricsTable, ProgressLine, log_film
from tactile_cube.training.loop import Learner
from tactile_cube.training.trial import SCORE
from tactile_cube.whole_file import write_whole

FILE, POLICY, BEST_POLICY, FILM = "finished.json", "policy.safetensors", "policy_best.safetensors", "trial.gif"
INTERRUPTED = "interrupted"
MASTERED = "mastered:"  # first words of the reason if a run ended because it reached its goal
ATTEMPTS = 3  # times in a row that workers may fail without a barrier reached in between


@dataclass(frozen=True)
class Finished:
    """The end of a run: reason in words, environment steps, mean final angle [rad], resolved configuration."""

    reason: str
    steps: int
    final_angle: float
    config: dict[str, Any]

    def write(self, folder: Path) -> None:
        """Write it into the run folder."""
        write_whole(folder / FILE, (json.dumps(asdict(self)) + "\n").encode())

    @classmethod
    def of(cls, folder: Path, config: dict[str, Any]) -> Self | None:
        """Return how the run in a folder ended under exactly these settings; None if it did not or starts over."""
        try:
            found = cls(**json.loads((folder / FILE).read_text()))
        except (OSError, ValueError, TypeError):
            return None
        # compared as JSON, in which tuples are lists
        same = found.config == json.loads(json.dumps(config)) and (folder / POLICY).is_file()
        return found if same and config["training"]["resume"] != "never" else None


@dataclass
class Run:
    """Drives a learner from barrier to barrier.

    Attributes:
        config: resolved configuration, kept in checkpoints and policy files.
        table: takes rows of metrics, as `logger` does; None: there is none.
        lock: keeps other processes out of the folder.
        iteration_steps: environment steps of an iteration.
        approximations: which shortcuts are on, in words.
        trial: tries the policy in so many episodes every `training.trial_every` steps and films one; None: none.
        best_angle: largest mean final angle at a barrier so far [rad].
        tried: what the trial found last.
        best_score: the largest score so far; the best policy has it.
        saved_at: environment steps at the last checkpoint.
        total: environment steps in all: those asked for, in whole iterations.
    """

    learner: Learner
    folder: Path
    config: dict[str, Any]
    table: MetricsTable
    logger: Logger | None
    ledger: Ledger
    lock: BaseFileLock
    checkpoints: Checkpoints
    iteration_steps: int
    approximations: list[str]
    trial: Callable[[Actor, int, Path], dict[str, float]] | None = None
    best_angle: float = 0.0
    tried: dict[str, float] = field(default_factory=dict)
    best_score: float = 0.0

    def __post_init__(self) -> None:
        """Begin a session."""
        learner, settings = self.learner, self.learner.settings
        self.total = -(-settings.steps // self.iteration_steps) * self.iteration_steps
        self.line = ProgressLine(self.total, learner.steps, learner.updates, settings.reference)
        self.commit = current_commit()
        self.saved_at = learner.steps

    def train(self) -> str:
        """Learn until done, stopped or interrupted by Ctrl-C or SIGTERM; gives the reason in words."""
        reason = self._reason_to_stop()
        before = {
            number: signal.signal(number, signal.default_int_handler) for number in (signal.SIGINT, signal.SIGTERM)
        }
        try:
            if not reason and not self.learner.iteration:
                self._save()  # a fault before the first barrier resumes from here
            while not reason:
                self.learner.run_to_barrier(self._after_iteration)
                reason = self._reason_to_stop()
                self._try()
                self._save()
        except KeyboardInterrupt:
            reason = INTERRUPTED
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
        return reason

    def announce(self) -> None:
        """Say what runs where, where it begins, and which shortcuts are on."""
        learner, settings = self.learner, self.learner.settings
        start = f"goes on at {learner.steps} steps" if learner.steps else "starts"
        self.line.say(f"{self.folder}: {start}, {self.total} steps in all")
        self.line.say(
            f"saved every {self.iteration_steps * settings.barrier_iterations} steps; after Ctrl-C the same command "
            "goes on from the last time, and does the steps since then again"
        )
        if self.checkpoints.notice:
            self.line.say(self.checkpoints.notice)
        if not learner.steps and settings.init_from:
            waits = f"; critics begin anew, the actor waits for {settings.actor_frozen} updates"
            self.line.say(f"networks of {settings.init_from}{waits if settings.actor_frozen else ''}")
        for approximation in self.approximations:
            self.line.say(f"approximation: {approximation}")

    def conclude(self, reason: str) -> None:
        """Say how it ended and where the result lies, and keep it."""
        costs = self.ledger.costs()
        cpu_hours = (costs.simulating + costs.learning) / 3600
        steps, angle = self.learner.steps, self.learner.episodes.mean_angle
        self.line.say(f"{reason}: {steps} steps, mean final angle {angle:.2f} rad, {cpu_hours:.2f} CPU-hours")
        if reason != INTERRUPTED:
            Finished(reason, steps, angle, self.config).write(self.folder)
        else:
            again = f"; the {steps - self.saved_at} steps since then are done again" if steps > self.saved_at else ""
            without = " without training.resume=never" if self.config["training"].get("resume") == "never" else ""
            self.line.say(f"saved at {self.saved_at} steps: the same command{without} goes on from there{again}")
        own = ((self.config.get("env") or {}).get("start") or {}).get("file")  # no policy file may name it
        start = f" start=grasps start.file={own}" if own else ""
        self.line.say(f"see it turn: python -m tactile_cube.evaluate policy={self.folder / POLICY}{start}")

    def close(self) -> None:
        """End the workers and write what is still in memory."""
        with contextlib.ExitStack() as stack:  # in reverse, each even if the one before fails
            stack.callback(self.lock.release)
            stack.callback(self.table.close)
            if self.logger is not None:
                stack.callback(self.logger.close)
            stack.callback(self.learner.collection.close)
            self.ledger.write(self.saved_at)  # first: the CPU time of ended workers is lost

    def _after_iteration(self) -> None:
        learner = self.learner
        assert learner.conditions is not None, "iterate first"
        conditions, summary = learner.conditions.columns(), learner.episodes.summary()
        self.line.show(learner.steps, learner.updates, summary, conditions)
        if learner.iteration % learner.settings.log_iterations == 0:
            losses = {key: float(value) for key, value in learner.metrics.items()}
            trial = {f"trial_{name}": value for name, value in self.tried.items()}
            costs = self.ledger.costs()
            hours = {f"{name}_hours": getattr(costs, name) / 3600 for name in ("wall", "simulating", "learning")}
            row = summary | conditions | {"updates": learner.updates} | hours | losses | trial
            self.table.add(learner.steps, row)
            if self.logger is not None:
                self.logger.log_metrics(row, step=learner.steps)

    def _reason_to_stop(self) -> str:
        settings, steps = self.learner.settings, self.learner.steps
        if steps >= settings.steps:
            return f"all {self.total} steps done"
        if settings.mastered(self.learner.episodes.mean_angle, self.learner.episodes.kept):
            return f"{MASTERED} above {settings.goal}"
        deadline = settings.stop_if_no_regrasp_by
        if deadline is not None and steps >= deadline and self.best_angle < settings.regrasp_angle:
            return f"no regrasping (mean final angle never above {settings.regrasp_angle:g} rad) by {deadline} steps"
        return ""

    def _try(self) -> None:
        """Try the policy if it is time, and keep it if it is the best so far."""
        learner, every, film = self.learner, self.learner.settings.trial_every, self.folder / FILM
        if self.trial is None or not every or learner.steps // every == self.saved_at // every:
            return
        self.tried = self.trial(learner.agent.policy(), learner.settings.trial_episodes, film)
        if self.logger is not None and film.is_file():
            log_film(self.logger, film, learner.steps)
        parts = (f"{name} {value:.3g}" for name, value in self.tried.items() if not name.endswith(("links", "return")))
        self.line.say(f"{learner.steps} steps, without exploration: {', '.join(parts)}")
        if self.tried.get(SCORE, 0.0) > self.best_score:
            self.best_score = self.tried[SCORE]
            self._save_policy(BEST_POLICY)

    def _save(self) -> None:
        """Write the latest policy, the best so far, and a checkpoint."""
        learner, angles = self.learner, self.learner.episodes.angles
        if len(angles) == angles.maxlen and learner.episodes.mean_angle > self.best_angle:
            self.best_angle = learner.episodes.mean_angle
            if not self.best_score:  # without trials, the training's angle decides
                self._save_policy(BEST_POLICY)
        self._save_policy(POLICY)
        every = learner.settings.policy_every
        if every and learner.steps // every > self.saved_at // every:
            self._save_policy(f"policy_{learner.steps}.safetensors")
        best = {"best_angle": self.best_angle, "best_score": self.best_score, "tried": self.tried}
        self.checkpoints.save({"learner": learner.state_dict(), **best, "config": self.config})
        self.saved_at = learner.steps
        self.ledger.write(learner.steps)

    def _save_policy(self, name: str) -> None:
        learner, actor = self.learner, self.learner.agent.policy()
        info = PolicyInfo.describe(
            actor,
            time_constant=learner.conditions.filter_time if learner.conditions else None,  # none at the start
            seed=learner.seed,
            steps=learner.steps,
            commit=self.commit,
            performance=learner.episodes.mean_angle,
            config=self.config,
        )
        save_policy(self.folder / name, actor, info)


def train_on(build: Callable[[], Run], again: Callable[[], Run] | None = None) -> tuple[Run, str]:
    """Train to the end through faults of the workers; gives the closed run and the reason it ended.

    All since the barrier is done again from the same state, so that its numbers are those of a run without faults.
    `build` makes the run, fresh or from its last checkpoint; `again` makes it once more after a fault, by default
    likewise.

    Raises:
        CollectionError: workers failed `ATTEMPTS` times without a barrier reached in between.
    """
    failures, reached = 0, -1
    while True:
        run, outcome = _session(build)
        if run is not None and isinstance(outcome, str):
            run.conclude(outcome)
            return run, outcome
        saved_at = run.saved_at if run is not None else -1
        failures, reached = (1 if saved_at > reached else failures + 1), max(saved_at, reached)
        if failures == ATTEMPTS:
            raise CollectionError(f"{outcome}; {ATTEMPTS} times in a row without a barrier in between")
        print(f"fault: {outcome}; going back to the last barrier with new workers", flush=True)
        build = (again or build) if run is not None else build
        del run
        gc.collect()  # frees its replay before the next one is allocated


def _session(build: Callable[[], Run]) -> tuple[Run | None, str | CollectionError]:
    """Train until the end or a fault of the workers."""
    run = None
    try:
        run = build()
        run.announce()
        return run, run.train()
    except CollectionError as error:
        return run, CollectionError(str(error))  # its cause would keep what failed from being deleted
    finally:
        if run is not None:
            run.close()
