"""Train a policy from a program."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactile_cube.api.job import Job, PathLike, as_input_errors, called_job

if TYPE_CHECKING:
    from tactile_cube.training.run import Run


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
        return self.folder / "policy.safetensors"

    @property
    def best_policy(self) -> Path | None:
        """The policy of the best training episodes; None while too few have ended."""
        path = self.folder / "policy_best.safetensors"
        return path if path.is_file() else None

    def curve(self) -> dict[str, list[float]]:
        """Columns of metrics.csv, one number for each line of the log."""
        from tactile_cube.evaluation.training_curve import read_curve

        return read_curve(self.folder, self.folder.name).columns


PUBLISHED: dict[str, dict[str, Any]] = {
    "hand": {"_target_": "tactile_cube.hand.published_hand"},
    "object": {"shape": "box", "size": 0.08, "mass": 0.05},
}
"""Hand and object of the paper, by the groups of conf/."""


@as_input_errors
def train(*settings: str, model: PathLike | None = None, folder: PathLike | None = None) -> TrainingResult:
    """Train a policy, or go on training it: the same call resumes.

    Args:
        settings: choices and values as on the command line, e.g. "+experiment=table", "seed=1".
        model: model.yaml that describes the hand; None: as the settings say.
        folder: run folder; None: outputs/train/<name>-seed<seed>.

    Raises:
        InputError: a value that cannot be used, or the folder is in use.
        CollectionError: worker processes failed again and again; the same call goes on from the last checkpoint.

    Example:
        >>> result = tactile_cube.train("+experiment=table", "training.steps=60000")
        >>> print(result.final_angle, result.policy)
    """
    job = called_job("train", settings, folder, model=None if model is None else str(model))
    return run_training(job)


def run_training(job: Job, stage: str = "", later: int = 0) -> TrainingResult:
    """Build the run of a job, train through faults of the workers, and say how it went.

    Args:
        job: what to train, perhaps in stages.
        stage: what lines of progress begin with where the run is a stage of several.
        later: environment steps of the stages after it, at most.
    """
    from functools import partial

    from tactile_cube.training.finished import Finished
    from tactile_cube.training.recovery import train_on

    if job.config.stages:
        from tactile_cube.api.stages import run_stages  # needs this module

        return run_stages(job)
    before = Finished.of(job.folder, plain_settings(job))
    if before is not None:
        print(f"{job.folder}: finished before ({before.reason}); training.resume=never starts over")
        return TrainingResult(job.folder, before.reason, before.steps, before.final_angle)
    run, reason = train_on(partial(training_run, job, stage, later))
    return TrainingResult(job.folder, reason, run.learner.steps, float(run.learner.episodes.mean_angle))


def training_run(job: Job, stage: str = "", later: int = 0) -> Run:
    """The run that a job describes: new, or where its checkpoint says; see `run_training`."""
    from hydra.utils import instantiate
    from omegaconf import OmegaConf

    from tactile_cube.agent.policy_file import read_policy
    from tactile_cube.evaluation.policy_path import networks_path, policy_path
    from tactile_cube.training.build import build_run
    from tactile_cube.training.environment import as_environment
    from tactile_cube.training.settings import CollectorSettings, RunSettings, TrainingSettings

    config: Any = job.config
    plain = plain_settings(job)
    if teacher := config.exploration.get("teacher"):
        file = policy_path(teacher, "exploration.teacher")
        read_policy(file)  # a damaged one is the user's error here, a worker's later
        config = OmegaConf.merge(config, {"exploration": {"teacher": str(file)}})
    run = build_run(
        folder=job.folder,
        seed=RunSettings(name=config.name, seed=config.seed).seed,
        environment=as_environment(instantiate(config.env)),
        make_agent=instantiate(config.agent, _partial_=True),
        collector=CollectorSettings(**plain["collector"]),
        training=TrainingSettings(**plain["training"] | {"init_from": networks_path(config.training.init_from)}),
        loggers={name: instantiate(entry, _partial_=True) for name, entry in config.logger.items()},
        config=plain,
    )
    run.line.stage, run.line.later = stage, later
    return run


def plain_settings(job: Job) -> dict[str, Any]:
    """The resolved configuration: with a model's contents in the place of its file, and the checksum of a URDF."""
    import hashlib

    from omegaconf import OmegaConf

    from tactile_cube.drivetrain.model_file import read_model
    from tactile_cube.hand.urdf_hand import urdf_file

    plain: dict[str, Any] = OmegaConf.to_container(job.config, resolve=True)  # type: ignore[assignment]
    if not plain["stages"]:  # so runs from before there were stages stay the same
        del plain["stages"], plain["judgement"]
    if job.config.model is not None:
        plain["env"]["model"] = read_model(job.config.model).model_dump()
    hand = plain["env"].get("hand") or {}
    if "urdf" in hand:
        hand["sha256"] = hashlib.sha256(urdf_file(hand["urdf"]).read_bytes()).hexdigest()
    return _without_published(plain)


def _without_published(plain: dict[str, Any]) -> dict[str, Any]:
    """A configuration that says nothing of hand and object where they are the published ones.

    So runs and policies from before one could choose them stay the same.
    """
    environment = plain["env"]
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
