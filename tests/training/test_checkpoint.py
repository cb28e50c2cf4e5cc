"""Checkpoints are whole or not there, cost what is new, and the one before serves when the newest is damaged."""

import errno
import shutil
from pathlib import Path
from typing import Any

import pytest
import torch

from tactile_cube.errors import InputError
from tactile_cube.training import checkpoint
from tactile_cube.training.checkpoint import BEFORE, FILE, load_checkpoint
from tests.training.tiny_run import finish, tiny_run


@pytest.fixture(scope="module")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    finish(tiny_run(folder := tmp_path_factory.mktemp("ended")))
    return folder


@pytest.fixture
def ended(made_once: Path, tmp_path: Path) -> Path:
    """Folder of a run that came to its end."""
    return shutil.copytree(made_once, tmp_path / "run")


def test_two_checkpoints_and_nothing_half_written_are_kept(ended: Path) -> None:
    names = {path.name for path in ended.iterdir()}
    assert {FILE, BEFORE} <= names
    assert not any("partial" in name or "next" in name for name in names)


def test_the_replay_comes_back_row_for_row_after_the_ring_went_round(tmp_path: Path) -> None:
    whole = tiny_run(tmp_path, steps=240)
    finish(whole)
    resumed = tiny_run(tmp_path, steps=240)
    assert resumed.learner.replay.buffer.write_count > resumed.learner.replay.capacity
    assert (resumed.learner.replay.buffer[:] == whole.learner.replay.buffer[:]).all()


@pytest.mark.parametrize("damage", ["flip", "gone"])
def test_damage_to_the_newest_is_said_and_the_one_before_is_used(ended, reference, damage, capsys) -> None:
    path = ended / FILE
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content) if damage == "flip" else path.unlink()
    resumed = tiny_run(ended)
    assert resumed.learner.steps == 80
    resumed.announce()
    said = capsys.readouterr().out
    assert "the run goes on from the checkpoint before it" in said
    assert FILE in said
    assert torch.equal(finish(resumed), reference)


def test_when_both_are_damaged_the_file_and_the_remedy_are_named(ended: Path) -> None:
    for name in (FILE, BEFORE):
        (ended / name).write_bytes(b"not a checkpoint")
    with pytest.raises(InputError, match=r"checkpoint\.pt: damaged checkpoint .*training\.resume=never starts over"):
        tiny_run(ended)
    assert tiny_run(ended, resume="never").learner.steps == 0


def test_starting_over_leaves_nothing_of_the_run_before_and_a_refusal_all_of_it(ended: Path) -> None:
    (ended / "policy_75.safetensors").write_text("old")
    before = sorted(path.name for path in ended.rglob("*"))
    with pytest.raises(InputError):
        tiny_run(ended, resume="never", init_from=str(ended / "none.safetensors"))
    assert sorted(path.name for path in ended.rglob("*")) == before
    (ended / "policy_averaged.safetensors").write_text("mine")
    tiny_run(ended, resume="never").close()
    left = [path.name for path in ended.iterdir() if path.name.startswith(("policy", "finished", "checkpoint"))]
    assert left == ["policy_averaged.safetensors"]


def test_a_folder_in_the_place_of_a_checkpoint_is_damage(ended: Path) -> None:
    (ended / FILE).unlink()
    (ended / FILE).mkdir()
    with pytest.raises(InputError, match=r"checkpoint\.pt: is a folder"):
        tiny_run(ended)


@pytest.mark.parametrize("failing", ["write_whole", "sync_folder"])
def test_a_full_disk_leaves_the_checkpoint_before_whole(tmp_path, reference, monkeypatch, failing) -> None:
    finish(tiny_run(tmp_path, steps=80))
    run = tiny_run(tmp_path)

    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(checkpoint, failing, full)
    with pytest.raises(InputError, match=r"checkpoint\.pt: cannot be written \(No space left.*disk full"):
        run.train()
    run.close()
    monkeypatch.undo()
    resumed = tiny_run(tmp_path)
    assert resumed.learner.steps >= 80
    assert torch.equal(finish(resumed), reference)


def test_a_checkpoint_of_an_older_version_is_told_as_that(tmp_path: Path) -> None:
    (tmp_path / FILE).write_bytes(b"tactile_cube checkpoint 3, sha256 " + b"0" * 64 + b"\n")
    with pytest.raises(InputError, match=r"of another version of this program; begin with its policy\.safetensors"):
        load_checkpoint(tmp_path / FILE)
