"""Same seed, same weights: for two runs, for other ways of collecting, and for a run that was interrupted."""

import os
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch

from tactile_cube.agent.sac import Sac
from tactile_cube.errors import InputError
from tactile_cube.randomization import Learnability, Uniform
from tactile_cube.training.build import FROZEN
from tactile_cube.training.run import Run
from tests.training.tiny_env import tiny_environment
from tests.training.tiny_run import finish, tiny_run


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run of 80 steps, at its end, that others begin with."""
    finish(run := tiny_run(tmp_path_factory.mktemp("first"), steps=80))
    return run


def test_same_seed_gives_the_same_weights_bit_for_bit(tmp_path: Path, reference: torch.Tensor) -> None:
    assert torch.equal(finish(tiny_run(tmp_path)), reference)


def test_other_seed_gives_other_weights(tmp_path: Path, reference: torch.Tensor) -> None:
    assert not torch.equal(finish(tiny_run(tmp_path, seed=1)), reference)


def test_worker_process_gives_the_weights_of_this_process(tmp_path: Path, reference: torch.Tensor) -> None:
    assert torch.equal(finish(tiny_run(tmp_path, collector={"kind": "multi_sync"})), reference)


@pytest.mark.parametrize("agent_settings", [{"n_step": 1}, {"n_step": 3}])
def test_resumed_run_equals_an_uninterrupted_one(tmp_path: Path, agent_settings: dict[str, Any]) -> None:
    whole = tiny_run(tmp_path / "whole", agent_settings=agent_settings)
    expected = finish(whole)
    finish(tiny_run(tmp_path / "parts", agent_settings=agent_settings, steps=80))
    resumed = tiny_run(tmp_path / "parts", agent_settings=agent_settings)
    assert resumed.learner.steps == 80
    assert torch.equal(finish(resumed), expected)
    assert (tmp_path / "whole/metrics.csv").read_text().count("\n") == (
        tmp_path / "parts/metrics.csv"
    ).read_text().count("\n")
    assert whole.learner.episodes.summary() == resumed.learner.episodes.summary()


@pytest.mark.parametrize(("at", "number"), [(0, signal.SIGINT), (6, signal.SIGTERM)])
def test_ctrl_c_ends_a_run_at_once_and_it_goes_on_from_the_last_barrier(
    tmp_path: Path, reference: torch.Tensor, at: int, number: int, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tiny_run(tmp_path)
    iterate = run.learner.iterate

    def interrupted() -> None:
        if run.learner.iteration == at:
            os.kill(os.getpid(), number)
        iterate()

    run.learner.iterate = interrupted  # type: ignore[method-assign]
    reason = run.train()
    run.conclude(reason)
    run.close()
    assert (reason, run.learner.iteration) == ("interrupted", at)
    again = "; the 40 steps since then are done again" if at else ""
    assert f"saved at {run.saved_at} steps: the same command goes on from there{again}\n" in capsys.readouterr().out
    assert (tmp_path / "checkpoint.pt").is_file()
    resumed = tiny_run(tmp_path)
    assert resumed.learner.iteration == at // 4 * 4
    assert torch.equal(finish(resumed), reference)


def test_other_loss_and_precision_resume_bit_for_bit_too(tmp_path: Path) -> None:
    other: dict[str, Any] = {"agent": Sac, "agent_settings": {"precision": "bf16"}}
    expected = finish(tiny_run(tmp_path / "whole", **other))
    finish(tiny_run(tmp_path / "parts", **other, steps=80))
    assert torch.equal(finish(tiny_run(tmp_path / "parts", **other)), expected)


def test_changed_settings_are_not_mixed_into_a_run(tmp_path: Path) -> None:
    finish(tiny_run(tmp_path, steps=80))
    with pytest.raises(InputError, match=r"agent\.learning_rate was 0.01, is 0.5"):
        tiny_run(tmp_path, agent_settings={"learning_rate": 0.5})
    fresh = tiny_run(tmp_path, agent_settings={"learning_rate": 0.5}, resume="never")
    assert fresh.learner.steps == 0


def test_run_gives_up_without_regrasping_and_finishes_early_when_good(tmp_path: Path) -> None:
    assert "no regrasping" in tiny_run(tmp_path / "a", stop_if_no_regrasp_by=80).train()
    good = tiny_run(tmp_path / "b", stop_when_angle_above=0.0001, random_steps=0)
    good.learner.episodes.angles.append(1.0)
    assert good.train() == "mastered: above 0.0001 rad"


def test_warm_start_takes_networks_from_checkpoint_and_policy(first: Run, tmp_path: Path) -> None:
    given = first.learner.agent.policy()
    for file in ("checkpoint.pt", "policy.safetensors"):
        run = tiny_run(tmp_path / f"next-{file}", init_from=str(first.folder / file))
        assert run.learner.steps == 0
        for mine, theirs in zip(run.learner.agent.policy().parameters(), given.parameters(), strict=True):
            assert torch.equal(mine, theirs)
        with pytest.raises(InputError, match=r"networks of other shape"):
            tiny_run(tmp_path / "other", agent_settings={"hidden": (8,)}, init_from=str(first.folder / file))


def test_an_actor_without_its_critics_waits_for_fresh_ones_and_so_does_the_temperature(first, tmp_path) -> None:
    policy, checkpoint = (str(first.folder / file) for file in ("policy.safetensors", "checkpoint.pt"))
    new = tiny_run(tmp_path / "policy", init_from=policy)
    given = [*new.learner.agent.policy().parameters(), new.learner.agent.loss.log_alpha]
    assert new.learner.settings.actor_frozen == FROZEN
    assert tiny_run(tmp_path / "checkpoint", init_from=checkpoint).learner.settings.actor_frozen is None
    for updates, still in ((1000, True), (3, False)):
        run = tiny_run(tmp_path / f"next-{updates}", init_from=policy, actor_frozen=updates)
        finish(run)
        after = [*run.learner.agent.policy().parameters(), run.learner.agent.loss.log_alpha]
        assert {torch.equal(a, b) for a, b in zip(after, given, strict=True)} == {still}


def test_a_run_says_how_much_ctrl_c_costs_and_whose_networks_it_begins_with(first, tmp_path, capsys) -> None:
    policy = str(first.folder / "policy.safetensors")
    capsys.readouterr()
    tiny_run(tmp_path / "next", init_from=policy).announce()
    starts, saved, second = capsys.readouterr().out.splitlines()[:3]
    assert starts.endswith("starts, 160 steps in all")
    assert saved.startswith("saved every 80 steps; after Ctrl-C the same command goes on from the last time")
    assert second == f"networks of {policy}; critics begin anew, the actor waits for {FROZEN} updates"


def test_a_run_does_the_steps_it_was_asked_for_and_says_how_many_that_were(tmp_path, capsys) -> None:
    run = tiny_run(tmp_path, steps=90)  # 20 an iteration, 80 from barrier to barrier
    run.announce()
    assert run.train() == "all 100 steps done"
    run.close()
    assert run.learner.steps == run.saved_at == 100
    assert "starts, 100 steps in all" in capsys.readouterr().out
    assert tiny_run(tmp_path, steps=90).train() == "all 100 steps done"


def test_a_run_can_begin_with_the_experience_of_another(first: Run, tmp_path: Path) -> None:
    given = first.learner.replay
    next_one = tiny_run(tmp_path / "next", init_from=str(first.folder / "checkpoint.pt"), init_replay=True)
    assert len(next_one.learner.replay) == len(given) > 0
    assert (next_one.learner.replay.buffer[:] == given.buffer[:]).all()
    assert next_one.learner.steps == 0


@pytest.mark.parametrize("file", ["policy.safetensors", "nothing/checkpoint.pt"])
def test_a_policy_file_has_no_experience(file: str, first: Run, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nothing|training\.init_replay=true.*policy\.safetensors"):
        tiny_run(tmp_path / "next", init_from=str(first.folder / file), init_replay=True)


def test_faulty_transitions_never_reach_the_replay(tmp_path: Path) -> None:
    run = tiny_run(tmp_path, environment=tiny_environment(fault=0.2), agent_settings={"n_step": 3})
    finish(run)
    assert run.learner.episodes.faulty > 0
    assert all(part.isfinite().all() for part in run.learner.replay.state_dict()["transitions"])
    assert run.learner.replay.buffer.write_count + run.learner.episodes.faulty == run.learner.steps


def test_workers_are_told_the_odds_of_the_worlds_where_they_are_steered(tmp_path: Path) -> None:
    steered = replace(tiny_environment(), learnability=lambda: Learnability({"cube_mass": Uniform(0.0, 1.0)}, 0.5))
    told = [tiny_run(tmp_path / str(n), environment=one).learner._progress() for n, one in enumerate((None, steered))]
    assert told[0] == (0, 0.0)
    assert told[1][2].tolist() == [[0.125] * 8]
