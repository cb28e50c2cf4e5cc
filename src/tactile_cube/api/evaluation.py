"""Evaluate a policy from a program, and see a run: best and worst episode side by side, its learning curves."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import torch
from hydra.utils import instantiate

from tactile_cube.api.job import Job, PathLike, Say, as_input_errors, called_job
from tactile_cube.errors import InputError
from tactile_cube.evaluation.episode_record import EpisodeRecord
from tactile_cube.evaluation.evaluation import Evaluation, EvaluationRun, VariantResult, write_results
from tactile_cube.evaluation.policies import environment, find_policy, worlds
from tactile_cube.evaluation.policy_path import BASELINES, policy_path
from tactile_cube.evaluation.summary import HEADER, Summary, row
from tactile_cube.evaluation.training_curve import Curve, read_curve
from tactile_cube.evaluation.verdict import EpisodeResult
from tactile_cube.visualization.episode_recording import description, write_pair
from tactile_cube.visualization.rerun_recording import VIEWERS, show_files


@dataclass(frozen=True)
class EvaluationResult:
    """Result of a protocol, for each of its conditions in `variants`, in the protocol's order."""

    run: EvaluationRun
    variants: list[VariantResult]
    evaluation: Evaluation

    @property
    def summary(self) -> Summary:
        """Angles and verdicts of the first condition."""
        return self.variants[0].summary

    @property
    def text(self) -> str:
        """Result of each condition, in words."""
        return "\n".join(one.text for one in self.variants)

    def episode(self, number: int, variant: int = 0) -> EpisodeRecord:
        """Run an episode again, bit for bit, and return all its signals."""
        chosen = self.variants[variant]
        return self.evaluation.record(chosen.variant, chosen.results[number])

    def write(self, folder: PathLike, film: bool = True) -> None:
        """Write results.json, the robustness map where conditions lie on axes, and films of the best episodes."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        write_results(folder / "results.json", self.run, self.variants)
        print(f"results: {folder / 'results.json'}")
        if any(variant.variant.axis for variant in self.variants):
            from tactile_cube.visualization.charts import write_robustness_map

            write_robustness_map(self.variants, self.evaluation.nominal_values, folder / "robustness.png")
            print(f"robustness map: {folder / 'robustness.png'}")
        if film:
            from tactile_cube.visualization.episode_recording import showcase

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

    `policy` is a policy file, a training run's folder, a policy that ships with the package, `hold`, `random` or
    `scripted`; None: the shipped one. `protocol` is an option of conf/protocol: which episodes, and in which worlds.

    From `hand` to `start` they are options of the groups of conf/ with these names; `engine`, `model` (its file) and
    `effects`, e.g. ["backlash@q2: play=0.05"], are of the world; None: as in training. `own_effects` names classes of
    your own that model or policy name, as dotted paths; `seed` is of the episodes.

    `values` sets other keys of conf/evaluate.yaml, e.g. {"protocol.episodes": 3, "task.filter_time": 0.25}; `say` takes
    a line for each episode.

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


@dataclass(frozen=True)
class ViewResult:
    """Rerun recordings of a run, and where they are shown.

    Attributes:
        files: Rerun recordings.
        episodes: "best" and "worst" -> what the episode was; {} where recordings were there already.
        opened: where they are shown, or how to open them, in words.
    """

    files: list[Path]
    episodes: Mapping[str, EpisodeResult]
    opened: str

    @property
    def text(self) -> str:
        """Output of the command."""
        lines = [f"{name}: {_described(result)}" for name, result in self.episodes.items()]
        return "\n".join([*lines, *(f"recording: {file}" for file in self.files), self.opened])


@as_input_errors
def view(
    run: PathLike,
    *,
    episodes: int | None = None,
    seconds: float | None = None,
    evaluate: Mapping[str, Any] | None = None,
    viewer: Literal["auto", "window", "none"] | None = None,
    seed: int | None = None,
    folder: PathLike | None = None,
    say: Say = print,
) -> ViewResult:
    """Write the best and the worst episode of a run as one Rerun recording, and open it where there is a display.

    Args:
        run: folder of a training run, a policy file, or a policy that ships with the package; of a folder of `evaluate`
            or `compare`, the recordings in it are opened.
        episodes: so many are run, and the best and the worst of them recorded.
        seconds: time limit of an episode; None: the task's own.
        evaluate: other settings of `evaluate`, e.g. {"task": "full"}.
        viewer: a window, none, or a window where there is a display.
        seed: of the episodes.
        folder: where the recording goes; None: outputs/view/...
        say: takes a line for each episode.

    Raises:
        InputError: there is no such run, or a value that cannot be used.

    Example:
        >>> seen = tactile_cube.view("table", episodes=4, viewer="none")
        >>> print(seen.files[0], seen.episodes["best"].final_angle)
    """
    return run_view(called_job("view", locals()), say)


def run_view(job: Job, say: Say) -> ViewResult:
    """Write or find the recordings that a job names, and show them."""
    config, run = job.config, Path(job.config.run)
    if config.viewer not in VIEWERS:
        raise InputError(f"viewer={config.viewer}: choose one of {', '.join(VIEWERS)}")
    if not isinstance(config.episodes, int) or config.episodes < 2:
        raise InputError(f"episodes={config.episodes}: give at least 2, of which the best and the worst are shown")
    trained = (run / "policy.safetensors").is_file()
    there = sorted(run.glob("*.rrd")) if run.is_dir() and not trained else []
    if there:
        return ViewResult(there, {}, show_files(there, config.viewer))
    file = job.folder / "view.rrd"
    episodes = _write_run(job, file, say)
    return ViewResult([file], episodes, show_files([file], config.viewer))


def _write_run(job: Job, file: Path, say: Say) -> dict[str, EpisodeResult]:
    config = job.config
    # found here, so that an error names the key that the user wrote
    curve = None if config.run in BASELINES else learning_curve(policy_path(config.run, "run").parent)
    settings = {"protocol.episodes": config.episodes, "seed": config.seed, **config.evaluate}
    settings |= {} if config.seconds is None else {"protocol.seconds": config.seconds}
    tried = evaluate(config.run, values=settings, say=say)
    ordered = sorted(tried.variants[0].results, key=lambda result: result.final_angle)
    chosen = {"best": ordered[-1], "worst": ordered[0]}
    recorded = {
        name: (tried.episode(one.episode), f"{name}: {_described(one)}", description(one))
        for name, one in chosen.items()
    }
    file.parent.mkdir(parents=True, exist_ok=True)
    write_pair(file, recorded, tried.evaluation.hand, curve, _words(config.run, tried))
    return chosen


def learning_curve(folder: Path) -> Curve | None:
    """Return the learning curve of a run's folder; None without metrics."""
    metrics = folder / "metrics.csv"
    if not metrics.is_file() or metrics.read_text(encoding="utf-8").count("\n") < 2:  # no row yet
        return None
    return read_curve(folder, folder.resolve().name)


def _described(result: EpisodeResult) -> str:
    return f"episode {result.episode}, {result.final_angle:.2f} rad, {result.verdict.value.replace('_', ' ')}"


def _words(run: str, tried: EvaluationResult) -> str:
    provenance = tried.run.source.provenance
    known = {key: provenance[key] for key in ("steps", "seed", "time_constant", "commit") if key in provenance}
    rows = [f"| {key} | {value} |" for key, value in known.items()]
    return "\n".join([f"## {run}", "", *(["| | |", "|---|---|", *rows, ""] if rows else []), tried.text])
