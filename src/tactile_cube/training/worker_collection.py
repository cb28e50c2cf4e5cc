"""What collecting in workers has in common, wherever they run: nothing is waited for without a limit."""

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import Future, TimeoutError
from functools import partial
from typing import Any

from tensordict import TensorDict, TensorDictBase

from tactile_cube.agent.behaviour import Behaviour
from tactile_cube.agent.networks import Actor
from tactile_cube.env import Conditions
from tactile_cube.training.background import Background
from tactile_cube.training.collection import CollectionError, Progress


class WorkerCollection(ABC):
    """Workers that host several worlds each and step them while the learner updates.

    Args:
        actor: any actor of the right sizes.
        workers: how many there are.
        timeout: longest wait for a block [s]; then the workers count as stuck.
        start_timeout: the same up to the end of the first block: workers that start may have to compile first.
    """

    _collector: Any  # a collector of TorchRL whose worlds live in workers

    def __init__(self, actor: Actor, workers: int, timeout: float, start_timeout: float):
        self._workers, self._timeout, self._start_timeout = workers, timeout, start_timeout
        self._started = False
        self._behaviour = Behaviour(copy.deepcopy(actor))
        self._thread = Background()
        self._block: Future[TensorDictBase] | None = None

    def restart(self, seed: int, progress: Progress) -> None:
        """Reset all worlds and seed everything random in them."""
        self._set_progress(progress)
        self._call(partial(self._restart, seed), "restart")

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

    @abstractmethod
    def cpu_seconds(self) -> float:
        """CPU time spent simulating so far [s]."""

    @abstractmethod
    def close(self) -> None:
        """End the workers: nothing in them is worth a wait, and one that is stuck would not listen."""

    @abstractmethod
    def _restart(self, seed: int) -> None:
        """Seed and reset all worlds."""

    @abstractmethod
    def _collect(self, weights: TensorDictBase) -> TensorDictBase:
        """One block (worlds, steps) with these weights."""

    @abstractmethod
    def _kill(self) -> None:
        """End the workers at once, those of a start that did not come to its end too."""

    def _set_progress(self, progress: Progress) -> Conditions:
        call = partial(self._collector.map_fn, "env.set_progress", [progress] * self._workers)
        conditions: Conditions = self._call(call, "set the curriculum")[0]
        return conditions

    def _call(self, call: Callable[[], Any], doing: str) -> Any:
        return self._wait(self._thread.submit(call), doing)

    def _wait(self, future: "Future[Any]", doing: str) -> Any:
        name, seconds = ("timeout", self._timeout) if self._started else ("start_timeout", self._start_timeout)
        try:
            return future.result(timeout=seconds)
        except TimeoutError:
            self._kill()
            raise CollectionError(
                f"no simulation worker answered within collector.{name}={seconds:g} s (to {doing})"
            ) from None
        except Exception as error:
            self._kill()
            raise CollectionError(f"simulation worker failed to {doing}: {self._reason(error)}") from error

    def _reason(self, error: Exception) -> str:
        """What went wrong, in words."""
        return str(error)
