"""Collect experience: in this process, or in workers while the learner works.

Both give the same numbers for the same seed and division of worlds: everything random in a worker comes from torch's
generator and the worlds' own, and `restart` sets both.
"""

import contextlib
import ctypes
import os
import pickle
import signal
import time
from collections.abc import Callable
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torchrl.collectors import Collector
from torchrl.envs import EnvBase

from tactile_cube.agent.networks import Actor
from tactile_cube.env import Conditions
from tactile_cube.training.settings import CollectorSettings

MakeEnv = Callable[..., EnvBase]
"""make_env(worlds=n, seed=s) -> batched environment of n worlds whose first transform is a `Curriculum`."""
Progress = tuple[Any, ...]
"""What `Curriculum.set_progress` takes."""


class CollectionError(RuntimeError):
    """A simulation worker died, got stuck or failed; the run can go on from its last checkpoint."""


class Behaviour(TensorDictModuleBase):  # type: ignore[misc]
    """The stochastic actor, or uniform actions while it is `random`, as in the first steps of a run.

    Noise comes from torch's global generator of the process.
    """

    in_keys = ["observation"]  # noqa: RUF012 - the name and type TorchRL asks for
    out_keys = ["action"]  # noqa: RUF012

    def __init__(self, actor: Actor):
        super().__init__()
        self.actor, self.random = actor, False

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Sample an action for each world."""
        action = self.actor.sample(tensordict["observation"]).action
        if self.random:
            action = torch.rand_like(action) * 2.0 - 1.0
        return tensordict.set("action", action)


class SingleCollection:
    """All worlds in this process, stepped before the learner's updates: nothing overlaps, everything is in reach.

    Args:
        make_env: see `MakeEnv`.
        actor: the one that acts; `launch` gives it others' weights.
        settings: number of worlds.
        steps: environment steps a world and block.
        seed: of the worlds until the first restart.
    """

    def __init__(self, make_env: MakeEnv, actor: Actor, settings: CollectorSettings, steps: int, seed: int = 0):
        self._behaviour = Behaviour(actor.requires_grad_(False))
        with torch.random.fork_rng(devices=[]):  # worlds seed torch's generator, which here is the learner's too
            self._collector = Collector(
                make_env(worlds=settings.worlds, seed=seed),
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

    def restart(self, seed: int, progress: Progress) -> int:
        """Reset all worlds and seed everything random in them; gives the seed of a worker beside this one."""
        self.set_progress(progress)

        def seed_and_reset() -> int:
            following: int = self._collector.set_seed(seed)
            torch.manual_seed(seed)
            self._collector.reset()
            return following

        return int(self._aside(seed_and_reset))

    def launch(self, actor: Actor, random: bool, progress: Progress) -> Conditions:
        """Collect one block."""
        self._behaviour.actor.load_state_dict(actor.state_dict())
        conditions, self._block = self.collect(random, progress)
        return conditions

    def collect(self, random: bool, progress: Progress) -> tuple[Conditions, TensorDictBase]:
        """Conditions of a block, and the block."""
        self._behaviour.random = random
        return self.set_progress(progress), self._aside(lambda: next(self._blocks).clone())

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

    def set_progress(self, progress: Progress) -> Conditions:
        """Tell the curriculum; gives the conditions of the episodes that start from here on."""
        conditions: Conditions = self._collector.env.transform[0].set_progress(*progress)
        return conditions

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
    """Worker processes, each a `SingleCollection` of several worlds, that collect while the learner updates.

    Weights are in memory that all share: the learner writes them while the workers wait. A worker that is killed is
    noticed at once, one that hangs after the time limit of the settings. TorchRL's own `MultiSyncCollector` would wait
    for ever for a worker that hangs, and to send weights to a dead one.

    Raises:
        CollectionError: a worker failed, died or got stuck, here or in any method.
    """

    def __init__(self, make_env: MakeEnv, actor: Actor, settings: CollectorSettings, steps: int):
        self._settings, self._started, self._collecting = settings, False, False
        self._actor = actor.requires_grad_(False).share_memory()
        context: Any = torch.multiprocessing.get_context(settings.start_method)
        parent = None if settings.start_method == "forkserver" else os.getpid()
        share = settings.model_copy(update={"worlds": settings.worlds // settings.workers})
        self._pipes, self._processes = list[Connection](), list[Any]()
        self._final_cpu: float | None = None
        try:
            for index in range(settings.workers):
                mine, its = context.Pipe()
                work = (its, parent, make_env, self._actor, share, steps, index)
                process = context.Process(target=_work, args=work, daemon=True)
                self._pipes.append(mine)
                self._processes.append(process)
                process.start()
                its.close()
            self._answers("start")
        except BaseException:  # Ctrl-C too
            self._kill()
            raise

    def restart(self, seed: int, progress: Progress) -> None:
        """Reset all worlds and seed everything random in them, each worker from the seed after its neighbour's."""
        for index in range(len(self._pipes)):
            seed = self._ask("restart", (seed, progress), index)[0]

    def launch(self, actor: Actor, random: bool, progress: Progress) -> Conditions:
        """Hand the weights to the workers and let them collect one block."""
        self._actor.load_state_dict(actor.state_dict())
        conditions: Conditions = self._ask("set_progress", (progress,))[0]
        self._send("collect", (random, progress))
        self._collecting = True
        return conditions

    def take(self) -> TensorDictBase:
        """Wait for the block begun last."""
        assert self._collecting, "launch first"
        block: TensorDictBase = torch.cat([block for _, block in self._answers("collect")])
        self._started, self._collecting = True, False
        return block

    def cpu_seconds(self) -> float:
        """CPU time of all workers since they started [s]; 0 where the system does not tell."""
        return sum(map(_cpu_seconds, self._processes)) if self._final_cpu is None else self._final_cpu

    def close(self) -> None:
        """End the workers: nothing in them is worth a wait, and one that is stuck would not listen."""
        self._final_cpu = self.cpu_seconds()
        self._kill()

    def _ask(self, name: str, arguments: tuple[Any, ...], worker: int | None = None) -> list[Any]:
        self._send(name, arguments, worker)
        return self._answers({"set_progress": "set the curriculum"}.get(name, name), worker)

    def _send(self, name: str, arguments: tuple[Any, ...], worker: int | None = None) -> None:
        for pipe in self._pipes if worker is None else [self._pipes[worker]]:
            with contextlib.suppress(OSError):  # of a worker that is dead: its answer says so
                pipe.send((name, arguments))

    def _answers(self, doing: str, worker: int | None = None) -> list[Any]:
        """An answer of each worker, or of one."""
        name = "timeout" if self._started else "start_timeout"  # workers that start may have to compile first
        seconds = float(getattr(self._settings, name))
        until, answers = time.monotonic() + seconds, list[Any]()
        asked = range(len(self._pipes)) if worker is None else [worker]
        try:
            for index in asked:
                pipe, sentinels = self._pipes[index], [one.sentinel for one in self._processes]
                ready = wait([pipe, *sentinels], max(until - time.monotonic(), 0.0))
                if not ready:
                    limit = f"collector.{name}={seconds:g} s (to {doing})"
                    raise CollectionError(f"no simulation worker answered within {limit}")
                if pipe not in ready:  # this worker or another one ended
                    ended = self._processes[sentinels.index(ready[0])]
                    ended.join(1.0)
                    raise CollectionError(f"simulation worker failed to {doing}: exit code {ended.exitcode}")
                answers.append(pickle.loads(pipe.recv_bytes()))
                if isinstance(answers[-1], CollectionError):
                    raise CollectionError(f"simulation worker failed to {doing}: {answers[-1]}")
        except (EOFError, OSError):
            self._kill()
            raise CollectionError(f"simulation worker failed to {doing}: it ended") from None
        except BaseException:  # Ctrl-C: workers ignore it, and would be waited for
            self._kill()
            raise
        return answers

    def _kill(self) -> None:
        for process in self._processes:
            if process.pid is not None:
                process.kill()
                process.join(1.0)
        for pipe in self._pipes:
            pipe.close()


Collection = SingleCollection | MultiSyncCollection
"""A source of blocks of experience (worlds, steps)."""


def _work(
    pipe: Connection,
    parent: int | None,
    make_env: MakeEnv,
    actor: Actor,
    settings: CollectorSettings,
    steps: int,
    index: int,
) -> None:
    """Answer what the main process asks of a collection, until it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the main process
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    torch.set_num_threads(1)
    if os.uname().sysname == "Linux":
        pr_set_pdeathsig = 1
        ctypes.CDLL(None).prctl(pr_set_pdeathsig, signal.SIGKILL)  # SIGTERM would not reach a stopped process
        if parent is not None and os.getppid() != parent:  # it ended before
            os._exit(1)
    with contextlib.suppress(EOFError, OSError):  # the main process is gone
        try:
            collection = SingleCollection(make_env, actor, settings, steps, seed=index)
            pipe.send_bytes(pickle.dumps(None))
            while True:
                name, arguments = pipe.recv()
                pipe.send_bytes(pickle.dumps(getattr(collection, name)(*arguments)))
        except Exception as error:  # of any kind: the main process says it
            pipe.send_bytes(pickle.dumps(CollectionError(str(error))))


def _cpu_seconds(process: Any) -> float:
    """User and system time of a running process [s], from /proc; 0 for one that is closed already."""
    try:
        fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    except (OSError, ValueError):
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
