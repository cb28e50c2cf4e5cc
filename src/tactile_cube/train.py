"""Train a policy, or go on training it: the same command resumes.

What a run writes into its folder: metrics.csv, tensorboard/, policy.safetensors (latest) and policy_best.safetensors,
checkpoint.pt (to go on from), ledger.json (CPU-hours) and .hydra/ (configuration).
"""

from typing import TYPE_CHECKING

from tactile_cube.cli import verb

if TYPE_CHECKING:
    from omegaconf import DictConfig


@verb("train")
def main(config: "DictConfig") -> None:
    """Train, and end with a status that a script or a sweep understands."""
    import sys

    from hydra.core.hydra_config import HydraConfig
    from hydra.types import RunMode

    from tactile_cube.api.job import typed_job
    from tactile_cube.api.training import run_training
    from tactile_cube.training.collection import CollectionError
    from tactile_cube.training.run import INTERRUPTED

    job = typed_job(config)
    try:
        result = run_training(job)
    except CollectionError as error:
        print(f"error: {error}; the same command goes on from the last checkpoint in {job.folder}", file=sys.stderr)
        sys.exit(1)
    if result.reason == INTERRUPTED and HydraConfig.get().mode == RunMode.MULTIRUN:
        sys.exit(130)  # else Ctrl-C would end one run of a sweep and start the next


if __name__ == "__main__":
    main()
