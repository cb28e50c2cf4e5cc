"""What a checkpoint of the default recipe costs: `python -m benchmarks.faults.checkpoint_cost FOLDER`."""

import sys
import time
from pathlib import Path

import torch
from hydra.utils import instantiate

from tactile_cube.composition import composed
from tactile_cube.env import Conditions
from tactile_cube.training.build import as_environment
from tactile_cube.training.checkpoint import Checkpoints
from tactile_cube.training.replay import Replay


def main(folder: Path) -> None:
    """Fill the ring, save at five barriers, load; print bytes and seconds."""
    config = composed("train", ["+experiment=taught"])
    environment = as_environment(instantiate(config.env))
    agent = instantiate(config.agent, _partial_=True)(environment.sizes)
    replay = Replay(config.training.replay_size, environment.sizes, len(environment.terms), 0)
    fresh = config.collector.worlds * config.training.steps_per_iteration * config.training.barrier_iterations
    checkpoints = Checkpoints(folder)
    for barrier in range(5):
        rows = replay.capacity if barrier == 0 else fresh
        replay.extend({name: torch.randn(rows, width) for name, width in replay.widths.items()})
        agent.update(
            replay.sample(agent.settings.batch_size, environment.reward_weights(Conditions(0.12, 1.0, 1.0)))
        )  # the optimiser's state too
        before = {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}
        began, cpu = time.perf_counter(), time.process_time()
        learner = {"agent": agent.state_dict(), "replay": replay.state_dict()}
        checkpoints.save({"learner": learner, "best_angle": 0.0, "config": {}})
        seconds, cpu = time.perf_counter() - began, time.process_time() - cpu
        now = [path for path in folder.rglob("*") if path.is_file() and path.name != "checkpoint_before.pt"]
        written = sum(path.stat().st_size for path in now if before.get(path) != path.stat().st_mtime_ns)
        print(
            f"barrier {barrier}: {rows} new rows, {written / 1e6:.1f} MB written in {seconds:.2f} s, {cpu:.2f} s of CPU"
        )
    began = time.perf_counter()
    loaded = Checkpoints(folder).load()
    assert loaded is not None
    print(f"read and checked in {time.perf_counter() - began:.2f} s; equal: ", end="")
    print(torch.equal(loaded["learner"]["replay"]["rows"], replay.rows[:]))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
