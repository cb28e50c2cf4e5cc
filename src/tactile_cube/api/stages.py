"""A training in stages: each goes on from the networks of the one before, then the last policies' mean is judged."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from tactile_cube.api.job import Job, called_job
from tactile_cube.api.training import TrainingResult, plain_settings, run_training
from tactile_cube.errors import InputError
from tactile_cube.training.finished import Finished
from tactile_cube.training.ledger import LEDGER, Costs, read_costs, write_costs
from tactile_cube.training.run import INTERRUPTED, MASTERED, POLICY
from tactile_cube.training.settings import TrainingSettings

KEY = re.compile(r"[+~]*([\w./@]+)")
"""What a word of a command line sets."""
NOT_A_STAGES = re.compile(r"(experiment|stages|judgement|name)\b")
"""Keys of the training as a whole."""
ENGINES = ("bullet", "mujoco")
AVERAGED = 5
"""Policies whose mean is what comes out, as in conf/average.yaml."""
GRASPS = 1000
"""As many as those that come with the package."""


@dataclass(frozen=True)
class TrainingStage:
    """One training of several.

    Attributes:
        job: what it trains; its networks come from the stage before.
        title: which one it is and what it comes to an end at, in words.
        steps: environment steps, at most.
    """

    job: Job
    title: str
    steps: int

    @property
    def name(self) -> str:
        """That of its folder."""
        return self.job.folder.name


def run_stages(job: Job) -> TrainingResult:
    """Train through the stages of a job, each until its goal or its last step; the same call goes on where it was.

    Raises:
        InputError: a stage that cannot be composed, or what one's training raises.
    """
    plain = plain_settings(job)
    before = Finished.of(job.folder, plain)
    if before is not None:
        print(f"{job.folder}: finished before ({before.reason}); training.resume=never starts over")
        return TrainingResult(job.folder, before.reason, before.steps, before.final_angle)
    stages, results = stages_of(job), list[TrainingResult]()
    for number, stage in enumerate(stages):
        print(f"{overview(stages, results)}\n{stage.title}", flush=True)
        results.append(run_training(stage.job, stage.title, sum(later.steps for later in stages[number + 1 :])))
        _sum_up(job.folder, results)
        if results[-1].reason == INTERRUPTED:
            return replace(results[-1], folder=job.folder)
    print(overview(stages, results))
    reason = judged(job, results[-1].folder)
    total = sum(result.steps for result in results)
    Finished(reason, total, results[-1].final_angle, plain).write(job.folder)
    return TrainingResult(job.folder, reason, total, results[-1].final_angle)


def stages_of(job: Job) -> list[TrainingStage]:
    """The stages that a job's configuration lists; what the user asked for holds in each of them."""
    own = [word for word in job.words if not NOT_A_STAGES.match(_key(word))]
    chosen = {_key(word) for word in own}
    jobs: list[Job] = []
    for name, words in job.config.stages.items():
        fitting = [word for word in words if _key(word).partition(".")[0] not in chosen]  # not of another choice
        asked = {_key(word): word for word in (*fitting, *own, f"name={name}")}
        jobs.append(called_job("train", tuple(asked.values()), job.folder / name, model=job.config.model))
        config: Any = jobs[-1].config
        if len(jobs) > 1:
            config.training.init_from = str(jobs[-2].folder / "checkpoint.pt")
        if "file" in config.start and config.start.file is None:
            config.start.file = _own_grasps(jobs[-1], job.folder / "grasps.npz")
    return [_stage(one, f"stage {number} of {len(jobs)}") for number, one in enumerate(jobs, 1)]


def _stage(job: Job, which: str) -> TrainingStage:
    training = TrainingSettings(**dict(job.config.training))
    until = f", until {training.goal}" if training.goal else ""
    return TrainingStage(job, f"{which}, {job.folder.name}{until}", training.steps)


def overview(stages: Sequence[TrainingStage], results: Sequence[TrainingResult]) -> str:
    """What is mastered, what is not, and what is to come, in one line."""
    lines = [
        f"{stage.name}: {result.reason if result.reason.startswith(MASTERED) else f'not mastered: {result.reason}'}"
        for stage, result in zip(stages, results, strict=False)
    ]
    ahead = [stage.name for stage in stages[len(results) :]]
    return "; ".join([*lines, f"to come: {', '.join([*ahead, 'mean of the last policies, judgement'])}"])


def judged(job: Job, last: Path) -> str:
    """Write the mean of the last stage's policies, and judge it in fresh draws of its worlds, in both engines."""
    from tactile_cube.agent.averaging import averaged, kept_policies
    from tactile_cube.agent.policy_file import save_policy
    from tactile_cube.api.evaluation import evaluate

    kept = len(list(last.glob("policy_[0-9]*.safetensors")))
    policy = job.folder / POLICY
    save_policy(policy, *averaged(kept_policies(last, min(AVERAGED, kept)) if kept else [last / POLICY]))
    said = []
    for engine in ENGINES:
        result = evaluate(policy, *job.config.judgement, f"engine={engine}")
        result.write(job.folder / engine, film=False)
        said.append(f"{engine}: {result.text}")
    print("\n".join(said))
    return "trained and judged"


def _key(word: str) -> str:
    found = KEY.match(word)
    return found[1] if found else word


def _own_grasps(job: Job, file: Path) -> str | None:
    """Grasps of another hand or object than the package has them of, found before the first episode; else None."""
    from hydra.utils import instantiate

    from tactile_cube.agent.policy_file import current_commit
    from tactile_cube.evaluation.grasp_search import find_grasps
    from tactile_cube.randomization import GraspStarts
    from tactile_cube.simulation import SimulationOptions, World

    env = instantiate(job.config.env)
    try:
        GraspStarts().of(env.hand, env.constants)
    except InputError:
        if not file.is_file():
            print(f"searching {GRASPS} grasps of hand '{env.hand.name}': {file}", flush=True)
            found = find_grasps(World(env.hand, SimulationOptions()), env.constants, GRASPS, 0)
            file.parent.mkdir(parents=True, exist_ok=True)
            replace(found, origin=found.origin | {"command": job.command, "commit": current_commit()}).save(file)
        return str(file)
    return None


def _sum_up(folder: Path, results: Sequence[TrainingResult]) -> None:
    """Write costs and curve of all stages so far into the folder of the whole training."""
    costs = [asdict(read_costs(result.folder / LEDGER)) for result in results]
    spent = Costs(**{name: sum(one[name] for one in costs) for name in costs[0]})
    write_costs(folder / LEDGER, sum(result.steps for result in results), spent)
    write_joined_curve([result.folder / "metrics.csv" for result in results], folder / "metrics.csv")


def write_joined_curve(files: Iterable[Path], output: Path) -> None:
    """Write the curves of runs, each begun with the one before, as one: what is counted goes on."""
    import csv
    import io

    from tactile_cube.whole_file import write_whole

    counted = ("steps", "updates", "episodes", "wall_hours", "simulating_hours", "learning_hours")
    rows, reached = list[dict[str, str]](), dict.fromkeys(counted, 0.0)
    for file in filter(Path.is_file, files):
        with file.open(newline="", encoding="utf-8") as stream:
            read = [row | {"stage": file.parent.name} for row in csv.DictReader(stream)]
        sums = [{key: f"{float(row[key]) + reached[key]:.9g}" for key in counted if key in row} for row in read]
        rows += [row | more for row, more in zip(read, sums, strict=True)]
        reached |= {key: float(value) for key, value in sums[-1].items()} if sums else {}
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, list(rows[0]) if rows else list(counted), extrasaction="ignore")
    writer.writeheader()
    writer.writerows(rows)
    write_whole(output, text.getvalue().encode())
