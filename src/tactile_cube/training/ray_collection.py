"""Collect experience in workers of a Ray cluster, by TorchRL's RayCollector."""

import contextlib
import time
from functools import partial
from typing import Any

import numpy as np
import torch
from tensordict import TensorDictBase
from torchrl.collectors import Collector
from torchrl.collectors.distributed import RayCollector

from tactile_cube.agent.networks import Actor
from tactile_cube.training.collection import MakeEnv
from tactile_cube.training.ray_cluster import RayCluster
from tactile_cube.training.worker_collection import WorkerCollection


class RemoteCollector(Collector):  # type: ignore[misc]
    """What a Ray worker does as one of MultiSyncCollector's: one thread, and torch's generator seeded with the worlds.

    Args:
        arguments: those of `Collector`.
    """

    def __init__(self, *arguments: Any, **named: Any):
        torch.set_num_threads(1)
        super().__init__(*arguments, **named)

    def __bool__(self) -> bool:
        """Ray asks; the answer by length that a collector has fails and hides why a worker failed."""
        return True

    def set_seed(self, seed: int, static_seed: bool = False) -> int:
        """Seed the worlds, and then all that is random besides; gives the next worker's seed."""
        following: int = super().set_seed(seed, static_seed)
        torch.manual_seed(seed)
        np.random.seed(seed)
        return following

    def collect(self, weights: TensorDictBase) -> tuple[TensorDictBase, float]:
        """A block with these weights, and this process's CPU time so far [s]."""
        self.update_policy_weights_(weights)
        return self.next(), time.process_time()


class RayCollection(WorkerCollection):
    """Workers on the machines of a Ray cluster, each with a core, that step their worlds while the learner updates.

    Same seed, worlds and workers give the bits of `MultiSyncCollection` where the machines have the same processor.

    Args:
        make_env: see `MakeEnv`; the package must be installed on all machines.
        actor: any actor of the right sizes.
        worlds: number of worlds in all.
        steps: environment steps a world and block.
        workers: how many; divides `worlds`.
        timeout: longest wait for a block [s]; then the workers count as stuck.
        start_timeout: the same up to the end of the first block.
        address: of the cluster; None: one of its own on this machine.
    """

    def __init__(
        self,
        make_env: MakeEnv,
        actor: Actor,
        worlds: int,
        steps: int,
        workers: int,
        timeout: float,
        start_timeout: float,
        address: str | None,
    ):
        super().__init__(actor, workers, timeout, start_timeout)
        self._cpu = 0.0
        self._cluster = RayCluster(address, workers, start_timeout)
        if (cores := self._cluster.cores()) < workers:
            print(f"the Ray cluster has {cores} of the {workers} cores that collector.processes asks for: waiting")
        self._collector = self._call(partial(self._build, make_env, worlds // workers, worlds * steps), "start")

    def _build(self, make_env: MakeEnv, worlds: int, frames: int) -> RayCollector:
        workers = range(self._workers)
        self._collector = RayCollector(
            [partial(make_env, worlds=worlds, seed=index) for index in workers],
            self._behaviour,
            collector_class=RemoteCollector,
            collector_kwargs=[{"auto_register_policy_transforms": False} for _ in workers],
            frames_per_batch=frames,
            total_frames=-1,
            trust_policy=True,
            sync=True,
            remote_configs={"num_cpus": 1, "num_gpus": 0, "scheduling_strategy": "SPREAD"},
            weight_sync_schemes={},  # they open ports of their own; weights travel with the call
        )
        self._collector.map_fn("stats")  # worlds that cannot be made say so here
        return self._collector

    def _restart(self, seed: int) -> None:
        self._collector.set_seed(seed)
        self._collector.map_fn("reset")

    def _collect(self, weights: TensorDictBase) -> TensorDictBase:
        sent = self._cluster.put(weights)  # once to each machine, not to each worker
        collected = self._collector.map_fn("collect", [(sent,)] * self._workers)
        self._cpu = sum(cpu for _, cpu in collected)
        return torch.cat([block for block, _ in collected])

    def cpu_seconds(self) -> float:
        """CPU time of all workers since they started [s], as of their last block."""
        return self._cpu

    def close(self) -> None:
        """End the workers, then leave the cluster."""
        self._kill()
        self._thread.close()

    def _reason(self, error: Exception) -> str:
        lines = str(error).strip().splitlines() or [type(error).__name__]
        return lines[-1 if "ray::" in lines[0] else 0].strip()  # of a worker's own error, or of its loss

    def _kill(self) -> None:
        with contextlib.suppress(AttributeError):  # it did not come to a start
            while self._collector.remote_collectors:
                with contextlib.suppress(Exception):  # one that is dead already
                    self._collector.stop_remote_collectors()
            self._collector.shutdown()
        with contextlib.suppress(Exception):  # calls to them end by that
            self._thread.submit(lambda: None).result(timeout=5.0)
        self._cluster.close()
