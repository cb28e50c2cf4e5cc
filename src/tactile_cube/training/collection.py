"""Collect experience: in this process, or in workers while the learner works.

Both give the same numbers for the same seed and division of worlds: everything random in a worker comes from torch's
generator and the worlds' own, and `restart` sets both.
"""

import contextlib
import copy
import multiprocessing
import os
import time
from collections.abc import Callable
from concurrent.futures import Future, TimeoutError
from functools import partial
from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torchrl.collectors import Collector, MultiSyncCollector
from torchrl.envs import EnvBase

from tactile_cube.agent.networks import Actor
from tactile_cube.env import Conditions
from tactile_cube.training.worker_process import Background, WeightSync, cpu_seconds, prepare_worker

MakeEnv = Callable[..., EnvBase]
"""make_env(worlds=n, seed=s) -> batched environment of n worlds with a method set_progress(steps, performance)."""

Progress = tuple[Any, ...]
"""What a curriculum goes by: environment steps so far, and mean final angle [rad] of the last episodes; where constants
are steered also the odds of their parts."""


GLANCE = 0.5
"""How long a dead worker may go unnoticed [s]; siblings that inherited its pipe would hide its death for ever."""
LAST_START = 3.0
"""How long a start that is given up may go on making processes [s]."""


class CollectionError(RuntimeError):
    """A simulation worker died, got stuck or failed; the run can go on from its last checkpoint."""


class Behaviour(TensorDictModuleBase):  # type: ignore[misc]
    """The stochastic actor, its own copy, or uniform actions in the first steps of a run.

    Whether actions are random travels with the weights as a buffer, so that it reaches every worker in the same
    iteration. Noise comes from torch's global generator of the worker.
    """

    in_keys = ["observation"]  # noqa: RUF012 - the name and type TorchRL asks for
    out_keys = ["action"]  # noqa: RUF012

    def __init__(self, actor: Actor):
        super().__init__()
        self.actor = actor.requires_grad_(False)
        self.register_buffer("random", torch.zeros(()))

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Sample an action for each world."""
        action = self.actor.sample(tensordict["observation"]).action
        if self.random:
            action = torch.rand_like(action) * 2.0 - 1.0
        return tensordict.set("action", action)


class SingleCollection:
    """All worlds in this process, stepped before the learner's updates: nothing overlaps, everything is in reach.

    Arguments as of `MultiSyncCollection`.
    """

    def __init__(self, make_env: MakeEnv, actor: Actor, worlds: int, steps: int):
        self._behaviour = Behaviour(copy.deepcopy(actor))
        with torch.random.fork_rng(devices=[]):  # worlds seed torch's generator, which here is the learner's too
            self._env = make_env(worlds=worlds, seed=0)
            self._collector = Collector(
                self._env,
                self._behaviour,
                frames_per_batch=worlds * steps,
                total_frames=-1,
                trust_policy=True,
                auto_register_policy_transforms=False,
            )
            self._random_state = torch.get_rng_state()
        self._blocks = iter(self._collector)
        self._block: TensorDictBase | None = None
        self._cpu = 0.0

    def restart(self, seed: int, progress: Progress) -> None:
        """Reset all worlds and seed everything random in them."""
        self._env.set_progress(*progress)

        def seed_and_reset() -> None:
            self._collector.set_seed(seed)
            torch.manual_seed(seed)
            self._collector.reset()

        self._aside(seed_and_reset)

    def launch(self, actor: Actor, random: bool, progress: Progress) -> Conditions:
        """Collect one block."""
        conditions: Conditions = self._env.set_progress(*progress)
        self._behaviour.actor.load_state_dict(actor.state_dict())
        self._behaviour.random.fill_(float(random))
        self._block = self._aside(lambda: next(self._blocks).clone())
        return conditions

    def take(self) -> TensorDictBase:
        """The block collected last."""
        assert self._block is not None, "launch first"
        return self._block

    def cpu_seconds(self) -> float:
        """CPU time spent simulating so far [s]."""
        return self._cpu

    def close(self) -> None:
        """Close the worlds."""
        self._collector.shutdown()

    def _aside(self, call: Callable[[], Any]) -> Any:
        """Run a call on the collection's own random state, as if it were another process."""
        learner_state, started = torch.get_rng_state(), time.thread_time()
        torch.set_rng_state(self._random_state)
        try:
            return call()
        finally:
            self._random_state = torch.get_rng_state()
            torch.set_rng_state(learner_state)
            self._cpu += time.thread_time() - started


class MultiSyncCollection:
    """Worker processes that host several worlds each and step them while the learner updates.

    Args:
        make_env: see `MakeEnv`.
        actor: any actor of the right sizes.
        worlds: number of worlds in all.
        steps: environment steps a world and block.
        processes: worker processes; divides `worlds`.
        timeout: longest wait for a block [s]; then the workers count as stuck.
        start_timeout: the same up to the end of the first block: workers that start may have to compile first.
        start_method: "fork" (Linux, fast) or "spawn".

    Raises:
        CollectionError: a worker failed, died or got stuck, here or in any method.
    """

    def __init__(
        self,
        make_env: MakeEnv,
        actor: Actor,
        worlds: int,
        steps: int,
        processes: int,
        timeout: float,
        start_timeout: float,
        start_method: str,
    ):
        self._workers, self._timeout, self._start_timeout = processes, timeout, start_timeout
        self._started = False
        self._behaviour, self._weights = Behaviour(copy.deepcopy(actor)), WeightSync()
        self._thread = Background()
        self._block: Future[TensorDictBase] | None = None
        self._final_cpu: float | None = None
        self._processes: list[Any] = []
        self._others = set(multiprocessing.active_children())
        build = partial(self._build, make_env, worlds // processes, worlds * steps, start_method)
        try:
            self._collector, self._blocks = self._call(build, "start")
        except BaseException:
            self._thread.close()
            raise
        self._processes = self._collector.procs

    def _build(self, make_env: MakeEnv, worlds: int, frames: int, start_method: str) -> tuple[MultiSyncCollector, Any]:
        torch.multiprocessing.set_start_method(start_method, force=True)
        threads = torch.get_num_threads()
        collector = MultiSyncCollector(
            [make_env] * self._workers,
            self._behaviour,
            create_env_kwargs=[{"worlds": worlds, "seed": index} for index in range(self._workers)],
            frames_per_batch=frames,
            total_frames=-1,
            cat_results="stack",
            num_threads=threads,
            num_sub_threads=1,
            trust_policy=True,
            auto_register_policy_transforms=False,
            weight_sync_schemes={"policy": self._weights},
            init_fn=partial(prepare_worker, None if start_method == "forkserver" else os.getpid()),
        )
        torch.set_num_threads(threads)
        return collector, iter(collector)

    def restart(self, seed: int, progress: Progress) -> None:
        """Reset all worlds and seed everything random in them."""
        self._set_progress(progress)
        self._call(partial(self._collector.set_seed, seed), "restart")

    def launch(self, actor: Actor, random: bool, progress: Progress) -> Conditions:
        """Hand the weights to the workers and let them collect one block."""
        conditions = self._set_progress(progress)
        self._behaviour.actor.load_state_dict(actor.state_dict())
        self._behaviour.random.fill_(float(random))
        weights = TensorDict.from_module(self._behaviour).data.clone()
        self._block = self._thread.submit(partial(self._collect, weights))
        return conditions

    def take(self) -> TensorDictBase:
        """Wait for the block begun last."""
        assert self._block is not None, "launch first"
        block: TensorDictBase = self._wait(self._block, "collect")
        self._started = True
        return block

    def cpu_seconds(self) -> float:
        """CPU time of all workers since they started [s]; 0 where the system does not tell."""
        if self._final_cpu is not None:
            return self._final_cpu
        return sum(map(cpu_seconds, self._processes))

    def close(self) -> None:
        """End the workers: nothing in them is worth a wait, and one that is stuck would not listen."""
        self._final_cpu = self.cpu_seconds()
        self._kill()
        closing = self._thread.submit(partial(self._collector.shutdown, timeout=1.0, raise_on_error=False))
        with contextlib.suppress(Exception):  # the thread is daemonic: it may stay where it is
            closing.result(timeout=3.0)
        self._thread.close()

    def _set_progress(self, progress: Progress) -> Conditions:
        call = partial(self._collector.map_fn, "env.set_progress", [progress] * self._workers)
        conditions: Conditions = self._call(call, "set the curriculum")[0]
        return conditions

    def _collect(self, weights: TensorDictBase) -> TensorDictBase:
        for index, process in enumerate(self._processes):  # torchrl would hang sending weights to a dead worker
            if not process.is_alive():
                raise RuntimeError(f"worker {index} ended with exit code {process.exitcode}")
        self._collector.update_policy_weights_(weights)
        block: TensorDictBase = next(self._blocks).flatten(0, 1).clone()
        return block

    def _call(self, call: Callable[[], Any], doing: str) -> Any:
        return self._wait(self._thread.submit(call), doing)

    def _wait(self, future: "Future[Any]", doing: str) -> Any:
        name, seconds = ("timeout", self._timeout) if self._started else ("start_timeout", self._start_timeout)
        try:
            return self._answer(future, seconds)
        except TimeoutError:
            self._kill()
            raise CollectionError(
                f"no simulation worker answered within collector.{name}={seconds:g} s (to {doing})"
            ) from None
        except Exception as error:
            self._kill()
            raise CollectionError(f"simulation worker failed to {doing}: {error}") from error
        except BaseException:  # Ctrl-C: workers ignore it, and would be waited for
            self._kill()
            raise

    def _answer(self, future: "Future[Any]", seconds: float) -> Any:
        until = time.monotonic() + seconds
        while True:
            try:
                return future.result(timeout=max(min(GLANCE, until - time.monotonic()), 0.0))
            except TimeoutError:
                if future.done() or time.monotonic() >= until:
                    raise
                if not all(process.is_alive() for process in self._weights.processes):
                    self._kill()  # what waits for it, says so then
                    until = time.monotonic() + LAST_START

    def _kill(self) -> None:
        idle = self._thread.submit(lambda: None)  # before, it may start one more
        until = time.monotonic() + LAST_START
        while not idle.done() and time.monotonic() < until:
            self._kill_children()
            with contextlib.suppress(TimeoutError):
                idle.result(timeout=0.05)
        self._kill_children()

    def _kill_children(self) -> None:
        # also those of a start that did not come to its end: they would be waited for when the program ends
        for process in set(multiprocessing.active_children()) - self._others:
            process.kill()
            process.join(1.0)


Collection = SingleCollection | MultiSyncCollection
"""A source of blocks of experience (worlds, steps)."""
