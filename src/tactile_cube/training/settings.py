"""The schedule of a run and how it is collected, checked once."""

import os
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field, NonNegativeInt, PositiveFloat, PositiveInt, model_validator

Reference = tuple[tuple[int, float, float], ...]
"""Of recorded runs: environment steps, lowest and highest mean final angle [rad] after them; the last is their end."""


class RunSettings(BaseModel):
    """Name of a run, a part of its folder's name, and the seed of everything random."""

    model_config = ConfigDict(frozen=True)

    name: str = Field(min_length=1)
    seed: NonNegativeInt


class CollectorSettings(BaseModel):
    """How many worlds are stepped where; conf/collector/multi_sync.yaml says what each setting means.

    `kind` is "multi_sync" (worker processes beside the learner) or "single" (this process, in turns with the learner);
    without `processes` there is a worker for each core beside the learner's, as far as they divide `worlds`.
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
        """Worker processes used."""
        if self.processes is not None:
            return self.processes
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        wanted = max(1, min(cores - 1, self.worlds))
        return max(n for n in range(1, wanted + 1) if self.worlds % n == 0)


class TrainingSettings(BaseModel):
    """The schedule of a run, in environment steps; conf/training/paper.yaml says what each setting means.

    A run can be saved and resumed bit for bit at barriers and nowhere else, since the state of a simulator cannot be
    saved; and it is saved at each of them. Source: website table of the paper.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    steps: PositiveInt = 6_500_000
    steps_per_iteration: PositiveInt = 25
    updates_per_iteration: NonNegativeInt = 100
    learning_starts: NonNegativeInt = 2_000
    random_steps: NonNegativeInt = 10_000
    replay_size: PositiveInt = 150_000
    barrier_iterations: PositiveInt = 25
    reference: Reference = ()
    policy_every: NonNegativeInt = 0
    trial_every: NonNegativeInt = 25_000
    trial_episodes: PositiveInt = 4
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
    def usual_steps(self) -> int:
        """Environment steps after which recorded runs were done; all where there are none."""
        return min(self.reference[-1][0] if self.reference else self.steps, self.steps)

    @property
    def goal(self) -> str:
        """Goal at which a run finishes early, in words; "" without one."""
        angle, kept = self.stop_when_angle_above, self.stop_when_kept_above
        parts = [f"{angle:g} rad" if angle is not None else "", f"{100 * kept:g} % kept" if kept is not None else ""]
        return " and ".join(filter(None, parts))

    def mastered(self, angle: float, kept: float) -> bool:
        """Return whether a mean final angle [rad] and a share of cubes kept exceed all limits for an early finish."""
        pairs = ((angle, self.stop_when_angle_above), (kept, self.stop_when_kept_above))
        return bool(self.goal) and all(least is None or value > least for value, least in pairs)
