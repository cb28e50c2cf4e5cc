"""The schedule of a run and how it is collected, checked once."""

import os
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field, NonNegativeInt, PositiveFloat, PositiveInt, model_validator


class RunSettings(BaseModel):
    """What tells runs apart: the name is part of the folder's, the seed is that of everything random."""

    model_config = ConfigDict(frozen=True)

    name: str = Field(min_length=1)
    seed: NonNegativeInt


class CollectorSettings(BaseModel):
    """How many worlds are stepped where.

    Attributes:
        kind: "multi_sync" (worker processes beside the learner) or "single" (this process, in turns with the learner).
        worlds: worlds in all. Source: the paper's 12 workers.
        processes: worker processes; None takes one for each core beside the learner's, as far as it divides `worlds`.
        timeout: longest wait for the workers [s].
        start_timeout: the same until their first block, before which they may compile.
        start_method: how worker processes start; fork takes under a second, spawn about 3 s a worker.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["multi_sync", "single"] = "multi_sync"
    worlds: PositiveInt = 12
    processes: PositiveInt | None = None
    timeout: PositiveFloat = 120.0
    start_timeout: PositiveFloat = 600.0
    start_method: Literal["fork", "spawn", "forkserver"] = "fork"

    @model_validator(mode="after")
    def _divides(self) -> Self:
        if self.processes is not None and self.worlds % self.processes:
            raise ValueError(f"processes={self.processes} does not divide worlds={self.worlds}; choose a divisor")
        return self

    @property
    def workers(self) -> int:
        """Worker processes used: as asked, or from the machine."""
        if self.processes is not None:
            return self.processes
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        wanted = max(1, min(cores - 1, self.worlds))
        return max(n for n in range(1, wanted + 1) if self.worlds % n == 0)


class TrainingSettings(BaseModel):
    """The schedule of a run, in environment steps unless said otherwise.

    Attributes:
        steps: length of the run.
        steps_per_iteration: steps a world and iteration.
        updates_per_iteration: gradient steps an iteration.
        learning_starts: no update before.
        random_steps: uniform random actions before.
        replay_size: transitions kept.
        barrier_iterations: iterations between two resets of all worlds. A run can be saved and resumed bit for bit
            there and nowhere else, since the state of a simulator cannot be saved; and it is saved at each of them.
        policy_every: keep a separate policy file each so many steps; 0 keeps only latest and best.
        log_iterations: iterations from one row of metrics to the next.
        resume: "auto" goes on from the newest checkpoint of this run folder; "never" starts over.
        init_from: checkpoint (.pt) or policy (.safetensors) whose networks the run starts from.
        init_replay: take over the experience of `init_from`, a run's checkpoint then, as well: fine-tuning begins
            with a full replay instead of the few steps it has made itself.
        actor_frozen: updates at the beginning that leave the actor as it is: after `init_from` a policy file, whose
            critics are fresh, they would lead it astray before they know what it is worth. None: as many as they need
            there, and none after a checkpoint, which brings its critics.
        stop_if_no_regrasp_by: give up when the mean final angle is still below `regrasp_angle` after so many steps.
        regrasp_angle: angle [rad] no single twist reaches, so that beyond it the fingers must have regrasped.
        stop_when_angle_above: finish early at this mean final angle [rad].
        stop_when_kept_above: finish early at this share of cubes kept in the last training episodes; where both are
            given, both must hold.
        threads: torch threads of the learner; results differ in the last bits between thread counts.

    Source: website table of the paper for the schedule.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    steps: PositiveInt = 6_500_000
    steps_per_iteration: PositiveInt = 25
    updates_per_iteration: NonNegativeInt = 100
    learning_starts: NonNegativeInt = 2_000
    random_steps: NonNegativeInt = 10_000
    replay_size: PositiveInt = 150_000
    barrier_iterations: PositiveInt = 25
    policy_every: NonNegativeInt = 0
    log_iterations: PositiveInt = 5
    resume: Literal["auto", "never"] = "auto"
    init_from: str | None = None
    init_replay: bool = False
    actor_frozen: PositiveInt | None = None
    stop_if_no_regrasp_by: PositiveInt | None = None
    regrasp_angle: PositiveFloat = 2.0
    stop_when_angle_above: PositiveFloat | None = None
    stop_when_kept_above: PositiveFloat | None = None
    threads: PositiveInt = 1

    @property
    def goal(self) -> str:
        """What a run finishes early at, in words; "" where it does not."""
        angle, kept = self.stop_when_angle_above, self.stop_when_kept_above
        parts = [f"{angle:g} rad" if angle is not None else "", f"{100 * kept:g} % kept" if kept is not None else ""]
        return " and ".join(filter(None, parts))

    def mastered(self, angle: float, kept: float) -> bool:
        """Whether a mean final angle [rad] and a share of cubes kept are above all that a run finishes early at."""
        pairs = ((angle, self.stop_when_angle_above), (kept, self.stop_when_kept_above))
        return bool(self.goal) and all(least is None or value > least for value, least in pairs)
