"""Evaluate a policy by a protocol: every variant with the same seeds, one verdict an episode, the results as JSON."""

import dataclasses
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from torchrl.envs import TransformedEnv

from tactile_cube.agent.policy_file import current_commit
from tactile_cube.env import RotationEnv, Task
from tactile_cube.evaluation.episode_record import EpisodeRecord
from tactile_cube.evaluation.policies import Policy, PolicySource, ReplayPolicy
from tactile_cube.evaluation.protocol import NumbPolicy, Protocol, Variant
from tactile_cube.evaluation.rollout import run_episode
from tactile_cube.evaluation.summary import Summary, drawn, lost_where, sentence, summarise
from tactile_cube.evaluation.verdict import EpisodeResult, judge_episode
from tactile_cube.simulation import Start
from tactile_cube.simulation.health import unresolved_among
from tactile_cube.transforms import EnvConfig, make_env
from tactile_cube.whole_file import write_whole

Report = Callable[[str, EpisodeResult], None]
"""Callback that gets the variant's name and the result of each episode as it ends."""


@dataclass(frozen=True)
class VariantResult:
    """Result of one variant."""

    variant: Variant
    results: list[EpisodeResult]
    summary: Summary
    unresolved: str = ""
    """Which of its worlds the solver does not resolve; "" where it resolves all."""

    def as_dict(self) -> dict[str, object]:
        """Return plain data for JSON."""
        varied = drawn(self.results)
        return {
            "variant": asdict(self.variant),
            "summary": asdict(self.summary),
            "episodes": [one.as_dict() | {"world": {key: one.world[key] for key in varied}} for one in self.results],
            "lost_where": [asdict(one) for one in lost_where(self.results)],
            "unresolved": self.unresolved,
        }

    @property
    def text(self) -> str:
        """The summary in words, which episodes did not succeed, where the object is lost, what is not resolved."""
        failed = [str(result.episode) for result in self.results if not result.success]
        lines = [sentence(self.variant.name, self.summary)]
        lines += [f"  not successful: {', '.join(failed)}"] if failed else []
        lines += [f"  {where.text}" for where in lost_where(self.results)]
        lines += [f"  {self.unresolved}"] if self.unresolved else []
        return "\n".join(lines)


SPINNING_FRICTION = "spinning friction [mm]"  # the axis whose nominal value is the environment's


class Evaluation:
    """One policy in one environment under one protocol.

    Args:
        config: the environment; the protocol's time limit and variants are put on top.
        policy: what decides.
        protocol: how it is tried.
        seed: the episodes' seeds are made of it and their number, so equal seeds see equal episodes.
    """

    def __init__(self, config: EnvConfig, policy: Policy, protocol: Protocol, seed: int) -> None:
        if protocol.seconds is not None:
            steps = round(protocol.seconds / config.simulation.policy_dt)
            config = dataclasses.replace(config, task=dataclasses.replace(config.task, episode_steps=steps))
        self.protocol, self.hand = protocol, config.hand
        self._config, self._policy, self._seed = config, policy, seed

    @property
    def nominal_values(self) -> dict[str, float]:
        """Where the nominal condition lies on the axes of the variants: spinning friction as policies were trained."""
        own = {SPINNING_FRICTION: 1e3 * self._config.constants.tip_spinning_friction}
        return {axis: own.get(axis, value) for axis, value in self.protocol.nominal_values.items()}

    def run(self, report: Report) -> list[VariantResult]:
        """Run all episodes."""
        conditions = self.protocol.conditions(self.hand)
        for variant in conditions:
            variant.apply(self._config)  # refuses before hours of episodes what the last one would refuse
        results = [self._run_variant(variant, report) for variant in conditions]
        if self.protocol.replay:
            results += self._run_displaced(results[0].results, report)
        return results

    def record(self, variant: Variant, result: EpisodeResult) -> EpisodeRecord:
        """Run one episode of `run` again, bit for bit, and keep its trace at the physics rate."""
        config = variant.apply(self._config)
        traced = dataclasses.replace(config.simulation, trace=self.protocol.trace)
        env = make_env(dataclasses.replace(config, simulation=traced), 1, self._seed, evaluation=True)
        try:
            return run_episode(env, self._feeling(variant), result.seed, variant.pull)
        finally:
            env.close()

    def _feeling(self, variant: Variant) -> Policy:
        """Return the policy, without the senses that a variant takes away."""
        return NumbPolicy(self._policy, variant.numb, self.hand) if variant.numb else self._policy

    def _run_variant(self, variant: Variant, report: Report) -> VariantResult:
        env, policy = make_env(variant.apply(self._config), 1, self._seed, evaluation=True), self._feeling(variant)
        seeds = [episode_seed(self._seed, number) for number in range(self.protocol.episodes)]
        episodes = ((seed, run_episode(env, policy, seed, variant.pull)) for seed in seeds)
        return self._judged(variant, env, episodes, report)

    def _run_displaced(self, results: list[EpisodeResult], report: Report) -> Iterator[VariantResult]:
        """Run the targets open loop, and the policy, from displaced starts of the best episode's world."""
        best = max(results, key=lambda result: result.final_angle)
        replay = ReplayPolicy(self.record(self.protocol.variants[0], best).target)
        # The recorded targets hold the repeated actions already.
        undisturbed = dataclasses.replace(self._config.randomization, sticky_probability=0.0)
        for spread in self.protocol.replay:
            starts = [DisplacedStart(episode_seed(self._seed, k), spread) for k in range(self.protocol.episodes)]
            aside = f"start {1e3 * spread:g} mm aside"
            for name, policy, randomization in (
                (f"replay of the best episode, {aside}", replay, undisturbed),
                (f"the policy in that world, {aside}", self._policy, self._config.randomization),
            ):
                config = self.protocol.variants[0].apply(dataclasses.replace(self._config, randomization=randomization))
                env = make_env(config, 1, self._seed, evaluation=True)
                episodes = ((best.seed, run_episode(env, policy, best.seed, start)) for start in starts)
                yield self._judged(Variant(name=name), env, episodes, report)

    def _judged(
        self, variant: Variant, env: TransformedEnv, episodes: Iterable[tuple[int, EpisodeRecord]], report: Report
    ) -> VariantResult:
        """Run and judge episodes, each with its seed, and close their environment."""
        results = []
        for number, (seed, record) in enumerate(episodes):
            results.append(judge_episode(record, number, seed))
            report(variant.name, results[-1])
        env.close()
        options = variant.apply(self._config).simulation
        frictions = [float(result.world["tip_spinning_friction"]) for result in results]
        return VariantResult(variant, results, summarise(results), unresolved_among(frictions, options))


def episode_seed(seed: int, episode: int) -> int:
    """Return the seed of an episode; ranges of different seeds do not overlap below 10 000 episodes."""
    return 10_000 * seed + episode


YAW_PER_SHIFT = 20.0
"""Turn of a displaced cube for its shift [rad/m]: its corners, some 50 mm from the middle, move as far by either."""


class DisplacedStart:
    """Displaces the cube before the first policy step, as a hand-over does; everything else of the episode stays.

    Args:
        seed: of the draw.
        spread: standard deviation of the displacement in x and in y [m]; `YAW_PER_SHIFT` times it is that of the turn
            about the vertical [rad].
    """

    def __init__(self, seed: int, spread: float) -> None:
        rng = np.random.default_rng(seed)
        self._shift = np.append(rng.normal(0.0, spread, 2), 0.0)
        self._turn = Rotation.from_euler("z", rng.normal(0.0, YAW_PER_SHIFT * spread))

    def __call__(self, env: RotationEnv, step: int) -> None:
        """Start the world anew with the displaced cube when `step` is 0."""
        if step > 0:
            return
        world = env.world
        turned = self._turn * Rotation.from_quat(world.cube_quaternion)
        world.reset(env.constants, Start(np.array(world.q), world.cube_position + self._shift, turned.as_quat()))


FORMAT = "tactile_cube results 1"


@dataclass(frozen=True)
class EvaluationRun:
    """What was run: `engine` where a condition names none of its own; `worlds`: which options draw them."""

    protocol: Protocol
    source: PolicySource
    task: Task
    engine: str
    seed: int
    command: str
    cpu_hours: float
    worlds: Mapping[str, str]


def write_results(path: Path, run: EvaluationRun, variants: list[VariantResult]) -> None:
    """Write the results file."""
    data = {
        "format": FORMAT,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "protocol": run.protocol.name,
        "seconds": run.protocol.seconds,
        "policy": {"label": run.source.label, **run.source.provenance},
        "task": asdict(run.task),
        "engine": run.engine,
        "worlds": dict(run.worlds),
        "seed": run.seed,
        "command": run.command,
        "cpu_hours": run.cpu_hours,
        "version": metadata.version("tactile-cube"),
        "commit": current_commit(),
        "variants": [variant.as_dict() for variant in variants],
    }
    text = json.dumps(data, indent=1, default=lambda one: one.tolist() if hasattr(one, "tolist") else str(one))
    write_whole(path, text.encode())
