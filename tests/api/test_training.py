"""A training in stages, by the one command."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from omegaconf import OmegaConf

import tactile_cube
from benchmarks.paper.model_card import read_ancestry
from tactile_cube import InputError
from tactile_cube.agent.networks import Actor, Sizes
from tactile_cube.agent.policy_file import PolicyInfo, load_actor, save_policy
from tactile_cube.agent.policy_parts import require_parts
from tactile_cube.api import training
from tactile_cube.api.job import Job, worded_job
from tactile_cube.api.training import TrainingResult
from tactile_cube.drivetrain.model_file import Estimate, ModelFile, write_model
from tactile_cube.hand.urdf_hand import DESCRIPTIONS
from tactile_cube.training.run import INTERRUPTED, Run

TINY = {
    "collector": "single",
    "logger": "csv",
    "collector.worlds": 2,
    "agent.hidden": [8],
    "agent.batch_size": 8,
    "training.steps": 32,
    "training.steps_per_iteration": 4,
    "training.barrier_iterations": 2,
    "training.updates_per_iteration": 1,
    "training.learning_starts": 8,
    "training.replay_size": 200,
    "training.policy_every": 16,
    "training.log_iterations": 1,
    "judgement": ["protocol=smoke", "protocol.episodes=1", "protocol.seconds=0.3"],
}
NAMES = ["gaiting", "holding", "worlds"]


@pytest.fixture
def trained(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str, int]]:
    """What stages are asked to train: folder, networks to begin with, steps still to come after it; nothing is."""
    asked: list[tuple[str, str, int]] = []

    def run(job: Job, plain: dict[str, Any], stage: str, later: int) -> TrainingResult:
        asked.append((job.folder.name, str(job.config.training.init_from), later))
        return TrainingResult(job.folder, "mastered: above 5 rad" if len(asked) < 3 else "all 9 steps done", 9, 5.0)

    def judge(job: Job, last: Path) -> str:
        (job.folder / "policy.safetensors").touch()
        return f"judged {last.name}"

    monkeypatch.setattr(training, "_in_one", run)
    monkeypatch.setattr(training, "judged", judge)
    return asked


def test_each_stage_goes_on_from_the_one_before_and_the_screen_says_what_is_mastered(tmp_path, trained, capsys) -> None:
    result = tactile_cube.train(experiment="curriculum", values={"training.steps": 50}, folder=tmp_path)
    before = ["None", f"{tmp_path}/gaiting/checkpoint.pt", f"{tmp_path}/holding/checkpoint.pt"]
    assert trained == list(zip(NAMES, before, (100, 50, 0), strict=True))
    assert (result.reason, result.steps, result.folder) == ("judged worlds", 27, tmp_path)
    said = capsys.readouterr().out
    assert "stage 2 of 3, holding, until 5 rad and 93 % kept" in said
    assert "gaiting: mastered: above 5 rad; to come: holding, worlds, mean" in said
    assert "worlds: not mastered: all 9 steps done; to come: mean" in said
    tactile_cube.train(experiment="curriculum", values={"training.steps": 50}, folder=tmp_path)
    assert len(trained) == 3, "finished before"


def test_what_the_user_asks_for_holds_in_every_stage(tmp_path: Path) -> None:
    words = ("+experiment=curriculum", "seed=3", "name=mine", "reward=air", "start=paper", "~stages.holding")
    found = training.stages_of(worded_job("train", [*words, "model=mine.yaml"], tmp_path))
    assert [stage.folder.name for stage in found] == ["gaiting", "worlds"]
    assert {(stage.config.seed, stage.config.reward.spin) for stage in found} == {(3, 16)}
    assert found[1].config.randomization.steered == 0.7
    assert {stage.config.model for stage in found} == {"mine.yaml"}


def test_no_stage_is_taught_by_anybody(tmp_path: Path) -> None:
    for stage in training.stages_of(worded_job("train", ("+experiment=curriculum",), tmp_path)):
        config = stage.config
        assert (config.exploration.demonstrations, config.agent.demonstration_weight) == (0.0, 0)
        assert "gaits" not in config.exploration
        assert "teacher" not in config.exploration


def test_a_hand_in_a_file_of_its_owners_gets_grasps_of_its_own_and_its_policy_is_judged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(training, "GRASPS", 1)
    monkeypatch.chdir(tmp_path)
    Path("mine.urdf").write_bytes((DESCRIPTIONS / "three_finger.urdf").read_bytes())
    job = worded_job("train", ("+experiment=curriculum", "hand=three_finger", "hand.urdf=mine.urdf"), tmp_path)
    job.config.judgement = [*job.config.judgement, "protocol.episodes=1", "protocol.seconds=0.3"]
    stages = training.stages_of(job)
    stage, grasps = stages[-1], tmp_path / "grasps.npz"
    assert (stages[0].config.start.file, grasps.is_file()) == (str(grasps), True)
    actor = Actor(Sizes(120, 0, 12), (8,))
    told = PolicyInfo.describe(actor, time_constant=0.5, config=OmegaConf.to_container(stage.config, resolve=True))
    save_policy(tmp_path / "worlds" / "policy.safetensors", actor, told)
    assert training.judged(job, tmp_path / "worlds") == "trained and judged"
    assert (tmp_path / "mujoco" / "results.json").is_file()


def test_a_policy_is_told_nothing_infinite_of_the_servo_it_was_trained_with(tmp_path: Path) -> None:
    """JSON knows no infinity: a policy trained with a rigid bench's model could not be read again."""
    rigid = Estimate(value=np.inf, low=np.inf, high=np.inf)
    values = {"stiffness": {"servo": rigid}, "kp": {"servo": Estimate(value=0.9, low=0.8, high=1.0)}}
    write_model(ModelFile(joints=["servo"], values=values), tmp_path / "model.yaml")
    job = worded_job("train", ("+experiment=smoke", f"model={tmp_path}/model.yaml"), tmp_path)
    told = PolicyInfo.describe(Actor(Sizes(120, 0, 12), (8,)), config=training.plain_settings(job))
    save_policy(tmp_path / "policy.safetensors", Actor(Sizes(120, 0, 12), (8,)), told)
    _, info = load_actor(tmp_path / "policy.safetensors")
    assert list(info.config["env"]["model"]["values"]) == ["kp"]
    assert "model" in require_parts(info.config["env"], "it")


def test_a_stage_that_cannot_be_composed_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nonsense"):
        tactile_cube.train(
            experiment="curriculum", values={"stages.gaiting": ["+experiment=nonsense"]}, folder=tmp_path
        )


def interrupted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C in the middle of the second stage, the first time it is there; then before the third stage begins."""
    to_come = ["in holding", "before worlds"]
    reason, run = Run._reason_to_stop, training._in_one

    def stop(self: Run) -> str:
        if "in holding" in to_come and self.folder.name == "holding" and self.learner.steps == 16:
            to_come.remove("in holding")
            return INTERRUPTED
        return reason(self)

    def before(job: Job, *rest: Any) -> TrainingResult:
        if "before worlds" in to_come and job.folder.name == "worlds":
            to_come.remove("before worlds")
            raise KeyboardInterrupt
        return run(job, *rest)

    monkeypatch.setattr(Run, "_reason_to_stop", stop)
    monkeypatch.setattr(training, "_in_one", before)


def test_an_interrupted_training_goes_on_in_its_stage_and_comes_to_the_same_policy(tmp_path, monkeypatch) -> None:
    whole = tactile_cube.train(values=TINY, folder=tmp_path / "whole")
    interrupted_once(monkeypatch)
    parts = tmp_path / "parts"
    assert tactile_cube.train(values=TINY, folder=parts).reason == INTERRUPTED
    assert not (parts / "worlds").exists()
    with pytest.raises(KeyboardInterrupt):
        tactile_cube.train(values=TINY, folder=parts)
    assert tactile_cube.train(values=TINY, folder=parts).steps == whole.steps == 96
    same, other = (load_actor(one / "policy.safetensors")[0].state_dict() for one in (tmp_path / "whole", parts))
    assert all(torch.equal(same[key], other[key]) for key in same)
    assert all((parts / engine / "results.json").is_file() for engine in ("bullet", "mujoco"))
    assert [(run.name, run.steps) for run in read_ancestry([parts])] == [("parts", 96)]
    with (parts / "metrics.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [(row["stage"], int(row["steps"])) for row in rows][3:5] == [("gaiting", 32), ("holding", 40)]
    assert {"reward_tips", "reward_links", "reward_spin", "reward_climb"} <= rows[0].keys()
