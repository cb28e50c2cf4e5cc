"""Evaluate a policy from a program."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import torch
from hydra.utils import instantiate

from tactile_cube.api.job import Job, PathLike, Say, as_input_errors, called_job
from tactile_cube.evaluation.environment import environment, worlds
from tactile_cube.evaluation.episode_record import EpisodeRecord
from tactile_cube.evaluation.evaluation import Evaluation, EvaluationRun, VariantResult, write_results
from tactile_cube.evaluation.policies import find_policy
from tactile_cube.evaluation.summary import HEADER, Summary, row


@dataclass(frozen=True)
class EvaluationResult:
    """What came of a protocol: of each condition in `variants`, the protocol's first one first."""

    run: EvaluationRun
    variants: list[VariantResult]
    evaluation: Evaluation

    @property
    def summary(self) -> Summary:
        """Angles and verdicts of the first condition."""
        return self.variants[0].summary

    @property
    def text(self) -> str:
        """What came of each condition, in words."""
        return "\n".join(one.text for one in self.variants)

    def episode(self, number: int, variant: int = 0) -> EpisodeRecord:
        """Every signal of an episode; it runs once more, equal to the bit."""
        chosen = self.variants[variant]
        return self.evaluation.record(chosen.variant, chosen.results[number])

    def write(self, folder: PathLike, film: bool = True) -> None:
        """Write results.json, the robustness map where conditions lie on axes, and films of the best episodes."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        write_results(folder / "results.json", self.run, self.variants)
        print(f"results: {folder / 'results.json'}")
        if any(variant.variant.axis for variant in self.variants):
            from tactile_cube.visualization.curves import write_robustness_map

            write_robustness_map(self.variants, self.evaluation.nominal_values, folder / "robustness.png")
            print(f"robustness map: {folder / 'robustness.png'}")
        if film:
            from tactile_cube.visualization.film import showcase

            showcase(self.evaluation, self.variants, folder)


@as_input_errors
def evaluate(
    policy: PathLike | None = None,
    *,
    protocol: str | None = None,
    hand: str | None = None,
    object: str | None = None,
    task: str | None = None,
    reward: str | None = None,
    randomization: str | None = None,
    start: str | None = None,
    engine: Literal["bullet", "mujoco"] | None = None,
    model: PathLike | None = None,
    effects: Sequence[str] | None = None,
    own_effects: Sequence[str] | None = None,
    seed: int | None = None,
    values: Mapping[str, Any] | None = None,
    say: Say = print,
) -> EvaluationResult:
    """Evaluate a policy by a protocol, with a verdict for every episode.

    Args:
        policy: a policy file, a training run's folder, a policy that ships with the package, `hold`, `random` or
            `scripted`; None: the shipped one.
        protocol: option of conf/protocol: which episodes, and in which worlds.
        hand: option of conf/hand; this and the next six: None: as in training.
        object: option of conf/object.
        task: option of conf/task.
        reward: option of conf/reward.
        randomization: option of conf/randomization.
        start: option of conf/start.
        engine: of the world.
        model: model.yaml of the world; None: as in training.
        effects: of the world, e.g. ["backlash@q2: play=0.05"]; []: none; None: those in training.
        own_effects: classes of your own that model or policy name, as dotted paths.
        seed: of the episodes.
        values: other keys of conf/evaluate.yaml, e.g. {"protocol.episodes": 3, "task.filter_time": 0.25}.
        say: takes a line for each episode.

    Raises:
        InputError: there is no such policy, or a value that cannot be used.

    Example:
        >>> result = tactile_cube.evaluate("table", protocol="smoke")
        >>> print(result.text, result.summary.mean_angle)
    """
    return run_evaluation(called_job("evaluate", locals()), say)


def run_evaluation(job: Job, say: Say) -> EvaluationResult:
    """Run the episodes of a job's protocol."""
    torch.set_num_threads(1)
    config = job.config
    source = find_policy(config.policy)
    protocol = instantiate(config.protocol)
    settings = environment(config, source, job.choices)
    evaluation = Evaluation(settings, source.policy, protocol, config.seed)
    task, engine = settings.task, settings.simulation.engine
    drawn = worlds(config, source, job.choices)
    say(
        f"policy {source.label}, protocol {protocol.name}, seed {config.seed}, task {task.name}: "
        f"T_s {task.filter_time:g} s, {100 * task.gravity_scale:.0f} % of the weight, engine {engine}\n"
        f"worlds: {', '.join(f'{group} {choice}' for group, choice in drawn.items())}\n{HEADER}"
    )
    began = time.process_time()
    variants = evaluation.run(lambda name, result: say(row(result, name)))
    hours = (time.process_time() - began) / 3600
    run = EvaluationRun(protocol, source, task, engine, config.seed, job.command, hours, drawn)
    return EvaluationResult(run, variants, evaluation)
