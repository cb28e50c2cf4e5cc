"""Workers that die, fail or get stuck must never hang the run."""

import os
import signal
import time
from functools import partial

import pytest
import torch
from torchrl.envs import TransformedEnv

from tactile_cube.agent.networks import Actor
from tactile_cube.training.collection import CollectionError, MultiSyncCollection, SingleCollection
from tactile_cube.training.settings import CollectorSettings
from tests.training.tiny_env import LENGTH, SIZES, TinyEnv, tiny_environment, tiny_world


class StuckEnv(TinyEnv):
    """Stops answering in its second block."""

    def _step(self, tensordict):  # type: ignore[no-untyped-def]
        if self._calls >= 7:  # in the second block
            time.sleep(60)
        return super()._step(tensordict)


class ColdEnv(TinyEnv):
    """Takes its time before the first step, as if it had to compile, and once more in its second block."""

    def _step(self, tensordict):  # type: ignore[no-untyped-def]
        if self._calls in (0, 7):
            time.sleep(2.0)
        return super()._step(tensordict)


def start(  # type: ignore[no-untyped-def]
    make=None, timeout: float = 30.0, processes: int = 1, start_timeout: float = 30.0
) -> MultiSyncCollection:
    actor = Actor(SIZES, (8,))
    make = make or tiny_environment().make
    settings = CollectorSettings(worlds=4, processes=processes, timeout=timeout, start_timeout=start_timeout)
    return MultiSyncCollection(make, actor, settings, 5)


def collect(collection: MultiSyncCollection, blocks: int = 1) -> None:
    for _ in range(blocks):
        collection.launch(Actor(SIZES, (8,)), False, (0, 0.0))
        collection.take()


def test_killed_worker_is_reported_without_waiting_for_the_timeout() -> None:
    collection = start(processes=2)
    collection.restart(0, (0, 0.0))
    collect(collection)
    os.kill(collection._processes[0].pid, signal.SIGKILL)
    with pytest.raises(CollectionError, match=r"^simulation worker failed to"):  # not: no answer within the timeout
        collect(collection, blocks=3)
    collection.close()


def test_a_worker_killed_at_its_start_is_reported_though_its_sibling_keeps_its_pipe_open() -> None:
    def killed(worlds: int, seed: int) -> TransformedEnv:
        if seed == 1:  # begun after the sibling whose copy of the pipe stays open
            os.kill(os.getpid(), signal.SIGKILL)
        return tiny_world(worlds, seed)

    with pytest.raises(CollectionError, match=r"^simulation worker failed to start"):  # not: no answer within 30 s
        start(make=killed, processes=2)


def test_stuck_worker_is_reported_after_the_timeout() -> None:
    collection = start(make=partial(tiny_world, kind=StuckEnv), timeout=2.0)
    with pytest.raises(CollectionError, match=r"collector\.timeout=2 s"):
        collect(collection, blocks=3)
    collection.close()


def test_a_cold_start_is_not_taken_for_a_stuck_worker() -> None:
    collection = start(make=partial(tiny_world, kind=ColdEnv), timeout=0.5)
    collection.launch(Actor(SIZES, (8,)), False, (0, 0.0))
    assert collection.take().batch_size == (4, 5)
    with pytest.raises(CollectionError, match=r"collector\.timeout=0\.5 s"):
        collect(collection)
    collection.close()


def test_failing_world_is_reported() -> None:
    collection = start(make=tiny_environment(fail_at=3).make, timeout=20.0)
    with pytest.raises(CollectionError, match="worker"):
        collect(collection, blocks=3)
    collection.close()


def test_world_that_cannot_be_made_is_reported() -> None:
    def broken(worlds: int, seed: int) -> TinyEnv:
        raise RuntimeError("no such hand")

    with pytest.raises(CollectionError, match="no such hand"):
        start(make=broken)


def test_restart_makes_blocks_repeat_and_tells_the_curriculum() -> None:
    collection = SingleCollection(tiny_environment().make, Actor(SIZES, (8,)), CollectorSettings(worlds=4), LENGTH)
    actor = Actor(SIZES, (8,))
    blocks = []
    for _ in range(2):
        collection.restart(11, (500, 0.0))
        conditions = collection.launch(actor, False, (500, 0.0))
        assert conditions.gravity_scale == pytest.approx(1.5)
        blocks.append(collection.take())
    assert torch.equal(blocks[0]["next", "theta"], blocks[1]["next", "theta"])
    assert blocks[0].batch_size == (4, LENGTH)
    assert collection.cpu_seconds() > 0.0


def test_single_collection_leaves_the_learners_random_numbers_alone() -> None:
    torch.manual_seed(5)
    expected = torch.rand(3)
    torch.manual_seed(5)
    actor_state = torch.get_rng_state()
    actor = Actor(SIZES, (8,))
    torch.set_rng_state(actor_state)
    collection = SingleCollection(tiny_environment().make, actor, CollectorSettings(worlds=4), 5)
    collection.restart(1, (0, 0.0))
    collection.launch(actor, False, (0, 0.0))
    assert torch.equal(torch.rand(3), expected)
