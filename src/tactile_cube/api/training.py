"""Train a policy from a program: in one run, or in stages of which each begins with the networks of the one before."""

import csv
import hashlib
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal, NamedTuple

from hydra.utils import instantiate
from omegaconf import OmegaConf

from tactile_cube.agent.policy_file import averaged, kept_policies, save_policy
from tactile_cube.api.environment import grasps_of
from tactile_cube.api.evaluation import run_evaluation
from tactile_cube.api.job import Job, PathLike, as_input_errors, as_word, called_job, worded_job
from tactile_cube.composition import composed
from tactile_cube.drivetrain.model_file import read_model
from tactile_cube.errors import InputError
from tactile_cube.evaluation.policy_path import networks_path
from tactile_cube.evaluation.training_curve import read_curve
from tactile_cube.hand.urdf_hand import urdf_file
from tactile_cube.randomization import GraspStarts
from tactile_cube.simulation import SimulationOptions
from tactile_cube.training.build import as_environment, build_run
from tactile_cube.training.ledger import LEDGER, Costs, read_costs, write_costs
from tactile_cube.training.run import INTERRUPTED, MASTERED, POLICY, Finished, Run, train_on
from tactile_cube.training.settings import CollectorSettings, RunSettings, TrainingSettings
from tactile_cube.whole_file import write_whole

PUBLISHED: dict[str, dict[str, Any]] = {
    "hand": {"_target_": "tactile_cube.hand.published_hand"},
    "object": {"shape": "box", "size": 0.08, "mass": 0.05},
}
"""Hand and object of the paper, by the groups of conf/."""
KEY = re.compile(r"[+~]*([\w./@]+)")  # key that an override sets
NOT_A_STAGES = re.compile(r"(experiment|stages|judgement|name)\b")  # keys of the whole training, not of a stage
ENGINES = ("bullet", "mujoco")
GRASPS = 1000  # as many as those that come with the package
COUNTED = ("steps", "updates", "episodes", "wall_hours", "simulating_hours", "learning_hours")
"""Columns of metrics.csv that continue from stage to stage."""


@dataclass(frozen=True)
class TrainingResult:
    """How a training ended.

    Attributes:
        folder: with policies, checkpoint, metrics.csv and the costs.
        reason: why it ended, in words.
        steps: environment steps so far.
        final_angle: mean over the last training episodes [rad].
    """

    folder: Path
    reason: str
    steps: int
    final_angle: float

    @property
    def policy(self) -> Path:
        """The latest policy."""
        return self.folder / POLICY

    def curve(self) -> dict[str, list[float]]:
        """Return the columns of metrics.csv, one number for each line of the log."""
        return read_curve(self.folder, self.folder.name).columns


@as_input_errors
def train(
    *,
    experiment: str | None = None,
    hand: str | None = None,
    object: str | None = None,
    task: str | None = None,
    reward: str | None = None,
    randomization: str | None = None,
    start: str | None = None,
    exploration: str | None = None,
    curriculum: str | None = None,
    env: str | None = None,
    agent: str | None = None,
    replay: str | None = None,
    collector: str | None = None,
    training: str | None = None,
    logger: str | None = None,
    without: str | None = None,
    engine: Literal["bullet", "mujoco", "mixed"] | None = None,
    model: PathLike | None = None,
    own_effects: Sequence[str] | None = None,
    seed: int | None = None,
    values: Mapping[str, Any] | None = None,
    folder: PathLike | None = None,
) -> TrainingResult:
    """Train a policy, or go on training it: the same call resumes.

    `experiment` is an option of conf/experiment, which changes several choices at once; None: `curriculum`. From `hand`
    to `logger` they are options of the groups of conf/ with these names, None: as the experiment says, and so is
    `without`, with experiment="ablations". `engine` is that of the worlds, `model` the model.yaml of the hand;
    `own_effects` names classes of your own that the model has, as dotted paths; `seed` is of everything random.

    `values` sets other keys of the configuration, dotted -> value, e.g. {"task.filter_time": 0.25}; `folder` is the run
    folder; None: outputs/train/<name>-seed<seed>.

    Raises:
        InputError: a value that cannot be used, or the folder is in use.
        CollectionError: worker processes failed again and again; the same call goes on from the last checkpoint.

    Example:
        >>> result = tactile_cube.train(experiment="table", values={"training.steps": 60000})
        >>> print(result.final_angle, result.policy)
    """
    return run_training(called_job("train", locals()))


class AveragedPolicy(NamedTuple):
    """A policy whose weights are the mean of several, and after how many steps each of these was kept."""

    policy: Path
    steps: tuple[int, ...]


@as_input_errors
def average(run: PathLike, *, last: int | None = None, output: PathLike | None = None) -> AveragedPolicy:
    """Average the weights of the last policies that a training run has kept.

    Args:
        run: folder of the run.
        last: how many.
        output: file to write; None: policy_averaged.safetensors in the run's folder.

    Raises:
        InputError: the run kept fewer.
    """
    return run_averaging(called_job("average", locals()))


def run_averaging(job: Job) -> AveragedPolicy:
    """Average the policies that a job names, and write the result."""
    run = Path(job.config.run)
    actor, info = averaged(kept_policies(run, job.config.last))
    output = Path(job.config.output or run / "policy_averaged.safetensors")
    save_policy(output, actor, info)
    return AveragedPolicy(output, tuple(info.averaged))


def run_training(job: Job, stage: str = "", later: int = 0) -> TrainingResult:
    """Run a training job, in one run or in stages, and return its result.

    Of a stage of several, `stage` is what lines of progress begin with, and the stages after it usually take `later`
    environment steps.
    """
    plain = plain_settings(job)
    before = Finished.of(job.folder, plain)
    if before is not None:
        print(f"{job.folder}: finished before ({before.reason}); training.resume=never starts over")
        return TrainingResult(job.folder, before.reason, before.steps, before.final_angle)
    return _in_stages(job, plain) if job.config.stages else _in_one(job, plain, stage, later)


def _in_one(job: Job, plain: dict[str, Any], stage: str, later: int) -> TrainingResult:
    start = partial(_training_run, job, plain, stage, later)
    run, reason = train_on(start, partial(start, resume="auto"))  # later starts resume
    return TrainingResult(job.folder, reason, run.learner.steps, float(run.learner.episodes.mean_angle))


def _training_run(job: Job, plain: dict[str, Any], stage: str, later: int, **changes: str) -> Run:
    config: Any = job.config
    run = build_run(
        folder=job.folder,
        seed=RunSettings(name=config.name, seed=config.seed).seed,
        environment=as_environment(instantiate(config.env)),
        make_agent=instantiate(config.agent, _partial_=True),
        collector=CollectorSettings(**plain["collector"]),
        training=TrainingSettings(
            **plain["training"] | {"init_from": networks_path(config.training.init_from)} | changes
        ),
        config=plain,
        logger=plain["logger"],
        make_replay=instantiate(config.replay),
    )
    run.line.stage, run.line.later = stage, later
    return run


def _in_stages(job: Job, plain: dict[str, Any]) -> TrainingResult:
    """Train each stage until its goal or its last step, then judge; the same call goes on where it was."""
    stages, results = stages_of(job), list[TrainingResult]()
    settings = [TrainingSettings(**dict(stage.config.training)) for stage in stages]
    for number, stage in enumerate(stages):
        goal, later = settings[number].goal, sum(one.usual_steps for one in settings[number + 1 :])
        title = f"stage {number + 1} of {len(stages)}, {stage.folder.name}{f', until {goal}' if goal else ''}"
        print(f"{_overview(stages, results)}\n{title}", flush=True)
        results.append(run_training(stage, title, later))
        _sum_up(job.folder, results)
        if results[-1].reason == INTERRUPTED:
            return replace(results[-1], folder=job.folder)
    print(_overview(stages, results))
    reason, total = judged(job, results[-1].folder), sum(result.steps for result in results)
    Finished(reason, total, results[-1].final_angle, plain).write(job.folder)
    return TrainingResult(job.folder, reason, total, results[-1].final_angle)


def stages_of(job: Job) -> list[Job]:
    """Return the stages that a job's configuration lists; the user's own overrides apply to each of them.

    Raises:
        InputError: a stage that cannot be composed.
    """
    own = [word for word in job.words if not NOT_A_STAGES.match(_key(word))]
    chosen = {_key(word) for word in own}
    jobs: list[Job] = []
    for name, words in job.config.stages.items():
        fitting = [word for word in words if _key(word).partition(".")[0] not in chosen]  # the user's groups win
        asked = {_key(word): word for word in (*fitting, *own, f"name={name}")}
        stage = worded_job("train", [*asked.values()], job.folder / name)
        if jobs:
            stage.config.training.init_from = str(jobs[-1].folder / "checkpoint.pt")
        if "file" in stage.config.start and stage.config.start.file is None:
            stage.config.start.file = _own_grasps(stage, job.folder / "grasps.npz")
        jobs.append(stage)
    return jobs


def _overview(stages: Sequence[Job], results: Sequence[TrainingResult]) -> str:
    lines = [
        f"{one.folder.name}: {one.reason if one.reason.startswith(MASTERED) else f'not mastered: {one.reason}'}"
        for one in results
    ]
    ahead = [*(stage.folder.name for stage in stages[len(results) :]), "mean of the last policies, judgement"]
    return "; ".join([*lines, f"to come: {', '.join(ahead)}"])


def judged(job: Job, last: Path) -> str:
    """Write the mean of the last stage's policies, and evaluate it in fresh draws of its worlds, in both engines."""
    kept = min(composed("average", []).last, len(list(last.glob("policy_[0-9]*.safetensors"))))
    policy = job.folder / POLICY
    save_policy(policy, *averaged(kept_policies(last, kept) if kept else [last / POLICY]))
    said, named = [], {_key(word) for word in job.words} & {"hand", "object"}  # policy files lack them
    again = [word for word in job.words if _key(word).partition(".")[0] in named]
    for engine in ENGINES:
        words = [as_word("policy", policy), *job.config.judgement, *again, f"engine={engine}"]
        result = run_evaluation(worded_job("evaluate", words), print)
        result.write(job.folder / engine, film=False)
        said.append(f"{engine}: {result.text}")
    print("\n".join(said))
    return "trained and judged"


def _key(word: str) -> str:
    return found[1] if (found := KEY.match(word)) else word


def _own_grasps(job: Job, file: Path) -> str | None:
    """Return the grasps of a hand or object that the package has none of, found before the first episode; else None."""
    env = instantiate(job.config.env)
    try:
        GraspStarts().of(env.hand, env.constants)
    except InputError:
        if not file.is_file():
            print(f"searching {GRASPS} grasps of hand '{env.hand.name}': {file}", flush=True)
            file.parent.mkdir(parents=True, exist_ok=True)
            grasps_of(env, SimulationOptions(), GRASPS, 0, job.command).save(file)
        return str(file)
    return None


def _sum_up(folder: Path, results: Sequence[TrainingResult]) -> None:
    spent = sum((read_costs(result.folder / LEDGER) for result in results), Costs())
    write_costs(folder / LEDGER, sum(result.steps for result in results), spent)
    _write_joined_curve([result.folder / "metrics.csv" for result in results], folder / "metrics.csv")


def _write_joined_curve(files: Iterable[Path], output: Path) -> None:
    """Write the curves of runs, each begun with the one before, as one: what is counted goes on."""
    rows, reached = list[dict[str, str]](), dict.fromkeys(COUNTED, 0.0)
    for file in filter(Path.is_file, files):
        with file.open(newline="", encoding="utf-8") as stream:
            read = [row | {"stage": file.parent.name} for row in csv.DictReader(stream)]
        sums = [{key: f"{float(row[key]) + reached[key]:.9g}" for key in COUNTED if key in row} for row in read]
        rows += [row | more for row, more in zip(read, sums, strict=True)]
        reached |= {key: float(value) for key, value in sums[-1].items()} if sums else {}
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, list(rows[0]) if rows else list(COUNTED), extrasaction="ignore")
    writer.writeheader()
    writer.writerows(rows)
    write_whole(output, text.getvalue().encode())


def plain_settings(job: Job) -> dict[str, Any]:
    """Return the resolved configuration, with a model's contents instead of its file and the checksum of a URDF.

    Stages are left out where there are none, hand and object where they are the published ones: runs and policies from
    before these could be chosen stay the same.
    """
    plain: dict[str, Any] = OmegaConf.to_container(job.config, resolve=True)  # type: ignore[assignment]
    if not plain["stages"]:
        del plain["stages"], plain["judgement"]
    environment = plain["env"]
    if job.config.model is not None:
        environment["model"] = read_model(job.config.model).of_a_hand().model_dump()
    hand = environment.get("hand") or {}
    if "urdf" in hand:
        hand["sha256"] = hashlib.sha256(urdf_file(hand["urdf"]).read_bytes()).hexdigest()
    constants = environment.get("constants") or {}
    if "hand" not in environment or "object" not in constants:  # another environment than the package's
        return plain
    for group, published in PUBLISHED.items():
        if constants.get(group) == published:
            for tree in (plain, environment, constants):
                tree.pop(group, None)
    if not constants.keys() & PUBLISHED.keys():
        constants["_target_"] = "tactile_cube.simulation.EpisodeConstants"
    return plain
