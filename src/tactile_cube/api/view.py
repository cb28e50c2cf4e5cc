"""See a run from a program: best and worst episode side by side, and its learning curves."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from tactile_cube.api import evaluation
from tactile_cube.api.evaluation import EvaluationResult
from tactile_cube.api.job import Job, PathLike, Say, as_input_errors, called_job
from tactile_cube.errors import InputError
from tactile_cube.evaluation.policy_path import BASELINES, policy_path
from tactile_cube.evaluation.training_curve import Curve, read_curve
from tactile_cube.evaluation.verdict import EpisodeResult
from tactile_cube.visualization.episode_recording import description, write_pair
from tactile_cube.visualization.rerun_recording import VIEWERS, show_files


@dataclass(frozen=True)
class ViewResult:
    """What there is to see, and where.

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
        """The answer of the command."""
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
    """See what a job names."""
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
    tried = evaluation.evaluate(config.run, values=settings, say=say)
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
    """The learning curve of a run's folder; None without metrics."""
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
