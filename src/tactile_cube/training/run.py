"""A run: its folder, its sessions, when it saves and when it stops."""

import contextlib
import shutil
import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from filelock import BaseFileLock

from tactile_cube.agent.policy_file import PolicyInfo, current_commit, save_policy
from tactile_cube.training.checkpoint import save_checkpoint
from tactile_cube.training.ledger import Ledger
from tactile_cube.training.loggers import Loggers
from tactile_cube.training.loop import Learner
from tactile_cube.training.progress import ProgressLine, clock

INTERRUPTED = "interrupted"
POLICY, BEST_POLICY = "policy.safetensors", "policy_best.safetensors"


@dataclass
class Run:
    """Drives a learner from barrier to barrier.

    Attributes:
        learner: what learns.
        folder: run folder.
        config: resolved configuration, kept in checkpoints and policy files.
        loggers: where metrics go.
        ledger: what it costs.
        lock: keeps other processes out of the folder.
        expected_seconds: on the clock until all steps are done, on two idle cores.
    """

    learner: Learner
    folder: Path
    config: dict[str, Any]
    loggers: Loggers
    ledger: Ledger
    lock: BaseFileLock
    expected_seconds: float

    def __post_init__(self) -> None:
        """A session begins."""
        self.line = ProgressLine(self.learner.settings.steps, self.learner.steps, self.learner.updates)
        self.best_angle = 0.0
        self.commit = current_commit()
        self._interrupted = False
        self._kept_at = self.learner.steps
        self._round_seconds = 0.0

    def train(self) -> str:
        """Learn until done, stopped or interrupted; gives the reason in words."""
        reason = self._reason_to_stop()
        with self._ctrl_c():
            while not reason:
                began = time.perf_counter()
                self.learner.run_to_barrier(self._after_iteration)
                self._round_seconds = time.perf_counter() - began
                reason = self._reason_to_stop()
                self._save(everything=bool(reason) or self._checkpoint_due())
        return reason

    def announce(self) -> None:
        """Say what runs where and for how long, where it begins, and which shortcuts are on."""
        learner, settings = self.learner, self.learner.settings
        start = f"goes on at {learner.steps} steps" if learner.steps else "starts"
        expected = clock(self.expected_seconds)
        self.line.say(f"{self.folder}: {start}, {settings.steps} steps in all, about {expected} on two idle cores")
        if not learner.steps and settings.init_from:
            waits = f"; critics begin anew, the actor waits for {settings.actor_frozen} updates"
            self.line.say(f"networks of {settings.init_from}{waits if settings.actor_frozen else ''}")
        for approximation in learner.agent.approximations():
            self.line.say(f"approximation: {approximation}")

    def conclude(self, reason: str) -> None:
        """Say how it ended and where the result lies."""
        costs = self.ledger.costs()
        cpu_hours = (costs.simulating + costs.learning) / 3600
        angle = self.learner.episodes.mean_angle
        self.line.say(
            f"{reason}: {self.learner.steps} steps, mean final angle {angle:.2f} rad, {cpu_hours:.2f} CPU-hours"
        )
        if self._interrupted:
            self.line.say("the same command goes on from here")
        self.line.say(f"see it turn: python -m tactile_cube.evaluate policy={self.folder / POLICY}")

    def close(self) -> None:
        """End the workers and write what is still in memory."""
        self.ledger.write(self.learner.steps)  # first: the workers take their CPU time with them
        self.learner.collection.close()
        self.loggers.close()
        self.lock.release()

    def _after_iteration(self) -> None:
        learner = self.learner
        summary = learner.episodes.summary()
        self.line.show(learner.steps, learner.updates, summary, learner.conditions)
        if learner.iteration % learner.settings.log_iterations == 0:
            losses = {key: float(value) for key, value in learner.metrics.items()}
            costs = self.ledger.costs()
            hours = {"simulating_hours": costs.simulating / 3600, "learning_hours": costs.learning / 3600}
            # losses last: the columns of metrics.csv are those of the first row, so they must be there from the start
            blank = dict.fromkeys(("critic_loss", "actor_loss", "alpha", "entropy", "value"), float("nan"))
            counts = {"updates": learner.updates, "wall_hours": costs.wall / 3600}
            self.loggers.log(learner.steps, summary | learner.conditions | counts | hours | blank | losses)

    def _reason_to_stop(self) -> str:
        settings, steps = self.learner.settings, self.learner.steps
        angle = self.learner.episodes.mean_angle
        if self._interrupted:
            return INTERRUPTED
        if steps >= settings.steps:
            return f"all {settings.steps} steps done"
        if settings.stop_when_angle_above is not None and angle > settings.stop_when_angle_above:
            return f"mean final angle {angle:.2f} rad is above training.stop_when_angle_above"
        deadline = settings.stop_if_no_regrasp_by
        if deadline is not None and steps >= deadline and self.best_angle < settings.regrasp_angle:
            return f"no regrasping (mean final angle never above {settings.regrasp_angle:g} rad) by {deadline} steps"
        return ""

    def _checkpoint_due(self) -> bool:
        settings = self.learner.settings
        barriers = self.learner.iteration // settings.barrier_iterations
        return barriers % settings.checkpoint_barriers == 0

    def _save(self, everything: bool) -> None:
        """Write the policy if it is the best so far; with `everything`, the latest policy and a checkpoint too."""
        angle = self.learner.episodes.mean_angle
        full_window = len(self.learner.episodes.angles) == self.learner.episodes.angles.maxlen
        if full_window and angle > self.best_angle:
            self.best_angle = angle
            self._save_policy(BEST_POLICY)
        if not everything:
            return
        self._save_policy(POLICY)
        self._keep_policy()
        state = {"learner": self.learner.state_dict(), "best_angle": self.best_angle, "config": self.config}
        save_checkpoint(self.folder, state)
        self.ledger.write(self.learner.steps)

    def _keep_policy(self) -> None:
        """Keep a policy of its own for each `policy_every` steps."""
        every = self.learner.settings.policy_every
        if every and self.learner.steps // every > self._kept_at // every:
            self._kept_at = self.learner.steps
            shutil.copy(self.folder / POLICY, self.folder / f"policy_{self._kept_at}.safetensors")

    def _save_policy(self, name: str) -> None:
        learner = self.learner
        actor = learner.agent.policy()
        info = PolicyInfo.describe(
            actor,
            time_constant=learner.conditions.get("T_s"),
            seed=learner.seed,
            steps=learner.steps,
            commit=self.commit,
            performance=learner.episodes.mean_angle,
            config=self.config,
        )
        save_policy(self.folder / name, actor, info)

    @contextlib.contextmanager
    def _ctrl_c(self) -> Iterator[None]:
        """The first Ctrl-C ends the run at the next barrier, the second at once."""

        def interrupt(number: int, frame: FrameType | None) -> None:
            if self._interrupted:
                raise KeyboardInterrupt
            self._interrupted = True
            wait = f" (at most {self._round_seconds:.0f} s)" if self._round_seconds else ""
            self.line.say(f"Ctrl-C: going on to the next point where the run can be saved{wait}; again to stop now")

        before = {number: signal.signal(number, interrupt) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
