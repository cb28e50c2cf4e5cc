"""How long a run will take, said before it begins."""

import itertools

import torch

from tactile_cube.agent.flat_perceptron import MULTIPLIES_BF16
from tactile_cube.agent.settings import AgentSettings
from tactile_cube.training.settings import CollectorSettings, TrainingSettings

SIMULATING = 1 / 457
"""Seconds of a worker process for an environment step."""
LEARNING = {torch.bfloat16: 8.6e-3, torch.float32: 28.3e-3}
"""Seconds of an update of `LARGE` weights and samples, by the precision of its products."""
LARGE = 512 * 512 * 256
"""Weights of the middle layer times samples of a batch, in the published agent. Source: docs/results/speed.md."""


def expected_seconds(
    steps: int, agent: AgentSettings, collector: CollectorSettings, training: TrainingSettings
) -> float:
    """Time on the clock that environment steps take on two idle cores of the benchmark's machine [s].

    Args:
        steps: still to do.
        agent: its size, batch and precision.
        collector: where worlds are simulated: beside the learner, or in turns with it.
        training: the ratio of updates to steps.
    """
    block = collector.worlds * training.steps_per_iteration
    layers = [*agent.hidden, agent.hidden[-1]]
    size = max(a * b for a, b in itertools.pairwise(layers)) * agent.batch_size / LARGE
    precision = agent.product_dtype if MULTIPLIES_BF16 else torch.float32
    learning = LEARNING[precision] * size * training.updates_per_iteration
    if collector.kind == "single":
        return steps / block * (block * SIMULATING + learning)
    return steps / block * max(block * SIMULATING / collector.workers, learning)
