"""Collect experience: in this process, or in workers while the learner works.

Both give the same numbers for the same seed and division of worlds: everything random in a worker comes from torch's
generator and the worlds' own, and `restart` sets both.
"""

import contextlib
import copy
import ctypes
import multiprocessing
import os
import queue
import signal
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, TimeoutError
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torchrl.collectors import Collector, MultiSyncCollector
from torchrl.envs import EnvBase
from torchrl.weight_update import SharedMemWeightSyncScheme, WeightSyncScheme

from tactile_cube.agent.networks import Actor
from tactile_cube.env import Conditions
from tactile_cube.training.settings import CollectorSettings

T = TypeVar("T")
MakeEnv = Callable[..., EnvBase]
"""make_env(worlds=n, seed=s) -> batched environment of n worlds whose first transform is a `Curriculum`."""
Progress = tuple[Any, ...]  # what `Curriculum.set_progress` takes
GLANCE = 0.5
"""How long a dead worker may go unnoticed [s]; siblings that inherited its pipe would hide its death for ever."""
LAST_START = 3.0  # how long a start that is given up may go on making processes [s]


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
        self.actor = copy.deepcopy(actor).requires_grad_(False)
        self.register_buffer("random", torch.zeros(()))

    def take_over(self, actor: Actor, random: bool) -> None:
        """Act as `actor` does from here on, or at random."""
        self.actor.load_state_dict(actor.state_dict())
        self.random.fill_(float(random))

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

    def __init__(self, make_env: MakeEnv, actor: Actor, settings: CollectorSettings, steps: int):
        self._behaviour = Behaviour(actor)
        with torch.random.fork_rng(devices=[]):  # worlds seed torch's generator, which here is the learner's too
            self._collector = Collector(
                make_env(worlds=settings.worlds, seed=0),
                self._behaviour,
                frames_per_batch=settings.worlds * steps,
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
        self._set_progress(progress)

        def seed_and_reset() -> None:
            self._collector.set_seed(seed)
            torch.manual_seed(seed)
            self._collector.reset()

        self._aside(seed_and_reset)

    def launch(self, actor: Actor, random: bool, progress: Progress) -> Conditions:
        """Collect one block."""
        conditions = self._set_progress(progress)
        self._behaviour.take_over(actor, random)
        self._block = self._aside(lambda: next(self._blocks).clone())
        return conditions

    def take(self) -> TensorDictBase:
        """Return the block collected last."""
        assert self._block is not None, "launch first"
        return self._block

    def cpu_seconds(self) -> float:
        """Return the CPU time spent simulating so far [s]."""
        return self._cpu

    def close(self) -> None:
        """Close the worlds."""
        self._collector.shutdown()

    def _set_progress(self, progress: Progress) -> Conditions:
        conditions: Conditions = self._collector.env.transform[0].set_progress(*progress)
        return conditions

    def _aside(self, call: Callable[[], Any]) -> Any:
        """Run a call on the collection's own random state, as if it were another process."""
        started = time.thread_time()
        with torch.random.fork_rng(devices=[]):
            torch.set_rng_state(self._random_state)
            result = call()
            self._random_state = torch.get_rng_state()
        self._cpu += time.thread_time() - started
        return result


class MultiSyncCollection:
    """Worker processes that host several worlds each and step them while the learner updates.

    Args:
        make_env: see `MakeEnv`.
        actor: any actor of the right sizes.
        settings: number of worlds and workers, and how long to wait for them.
        steps: environment steps a world and block.

    Raises:
        CollectionError: a worker failed, died or got stuck, here or in any method.
    """

    def __init__(self, make_env: MakeEnv, actor: Actor, settings: CollectorSettings, steps: int):
        self._settings, self._started = settings, False
        self._behaviour, self._weights, self._thread = Behaviour(actor), WeightSync(), Background()
        self._block: Future[TensorDictBase] | None = None
        self._final_cpu: float | None = None
        self._processes: list[Any] = []
        self._others = set(multiprocessing.active_children())
        try:
            self._collector, self._blocks = self._call(partial(self._build, make_env, steps), "start")
        except BaseException:
            self._thread.close()
            raise
        self._processes = self._collector.procs

    def _build(self, make_env: MakeEnv, steps: int) -> tuple[MultiSyncCollector, Any]:
        method, workers, worlds = self._settings.start_method, self._settings.workers, self._settings.worlds
        torch.multiprocessing.set_start_method(method, force=True)
        threads = torch.get_num_threads()
        collector = MultiSyncCollector(
            [make_env] * workers,
            self._behaviour,
            create_env_kwargs=[{"worlds": worlds // workers, "seed": index} for index in range(workers)],
            frames_per_batch=worlds * steps,
            total_frames=-1,
            cat_results="stack",
            num_threads=threads,
            num_sub_threads=1,
            trust_policy=True,
            auto_register_policy_transforms=False,
            weight_sync_schemes={"policy": self._weights},
            init_fn=partial(prepare_worker, None if method == "forkserver" else os.getpid()),
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
        self._behaviour.take_over(actor, random)
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
        """Return the CPU time of all workers since they started [s]; 0 where the system does not tell."""
        return sum(map(_cpu_seconds, self._processes)) if self._final_cpu is None else self._final_cpu

    def close(self) -> None:
        """Kill the workers: nothing in them needs saving, and a stuck one would not react."""
        self._final_cpu = self.cpu_seconds()
        self._kill()
        closing = self._thread.submit(partial(self._collector.shutdown, timeout=1.0, raise_on_error=False))
        with contextlib.suppress(Exception):  # the thread is daemonic: it may stay where it is
            closing.result(timeout=3.0)
        self._thread.close()

    def _set_progress(self, progress: Progress) -> Conditions:
        arguments = [progress] * self._settings.workers
        call = partial(self._collector.map_fn, "env.transform[0].set_progress", arguments)
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
        name = "timeout" if self._started else "start_timeout"  # workers that start may have to compile first
        seconds = float(getattr(self._settings, name))
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
                if not all(process.is_alive() for process in getattr(self._weights.context, "procs", ())):
                    self._kill()  # the call that waits for it then fails
                    until = time.monotonic() + LAST_START

    def _kill(self) -> None:
        idle = self._thread.submit(lambda: None)  # until this has run, the thread may start one more process
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


Collection = SingleCollection | MultiSyncCollection  # a source of blocks of experience (worlds, steps)


class WeightSync(SharedMemWeightSyncScheme):  # type: ignore[misc]
    """Weight transfer by shared memory without a "stop" message: workers are killed, and their queues not waited for.

    torchrl's own sends "stop" when it is deleted. Where that is at the end of the interpreter, the thread that a
    queue's first item starts never runs, and the program never ends.
    """

    def init_on_sender(self, *args: Any, **kwargs: Any) -> None:
        """Make the queues."""
        super().init_on_sender(*args, **kwargs)
        for queues in (self._weight_init_queues, self._instruction_queues, self._ack_queues):
            for one in queues.values():
                one.cancel_join_thread()

    def shutdown(self) -> None:
        """End the thread that receives weights, in a worker."""
        WeightSyncScheme.shutdown(self)


class Background:
    """A daemon thread that runs submitted calls one after another, so that none is waited for without a time limit.

    Daemonic, because a call may be stuck in a pipe to a dead process, and that must not keep the program from ending.
    One for all calls, because a worker ends with the thread that started it (`prepare_worker`).
    """

    def __init__(self) -> None:
        self._calls: queue.SimpleQueue[tuple[Future[object], Callable[[], object]] | None] = queue.SimpleQueue()
        threading.Thread(target=self._run, daemon=True, name="collection").start()

    def submit(self, call: Callable[[], T]) -> "Future[T]":
        """Queue a call; its result or exception arrives in the future."""
        future: Future[T] = Future()
        self._calls.put((future, call))  # type: ignore[arg-type]
        return future

    def close(self) -> None:
        """End the thread after the calls already queued."""
        self._calls.put(None)

    def _run(self) -> None:
        while (entry := self._calls.get()) is not None:
            future, call = entry
            try:
                future.set_result(call())
            except BaseException as error:  # noqa: BLE001, RUF100 - handed to whoever asks for the result
                future.set_exception(error)


def prepare_worker(parent: int | None) -> None:
    """Leave Ctrl-C to the main process `parent`, and end with it even if it is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    torch.set_num_threads(1)
    if os.uname().sysname == "Linux":
        pr_set_pdeathsig = 1
        ctypes.CDLL(None).prctl(pr_set_pdeathsig, signal.SIGKILL)  # SIGTERM would not reach a stopped process
        if parent is not None and os.getppid() != parent:  # it ended before
            os._exit(1)


def _cpu_seconds(process: Any) -> float:
    """Return the user and system time of a running process [s], from /proc; 0 for one that is closed already."""
    try:
        fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    except (OSError, ValueError):
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
