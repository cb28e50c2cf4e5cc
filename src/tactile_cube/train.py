"""Train a policy; the same command resumes it.

What a run writes into its folder: metrics.csv, tensorboard/, policy.safetensors (latest) and policy_best.safetensors,
checkpoint.pt, checkpoint_before.pt and replay/ (to go on from), train.log (what the console showed), ledger.json
(CPU-hours), finished.json (how it ended) and .hydra/ (configuration). A training in stages has such a folder for each
of them in its own, and bullet/ and mujoco/ with the judgement.
"""

from pathlib import Path

from tactile_cube.api.job import Job
from tactile_cube.cli import command


def sweep_summary(folders: list[Path]) -> None:
    """Say what came of the runs of a sweep."""
    from tactile_cube.evaluation.training_curve import read_sweep, sweep_table
    from tactile_cube.visualization.curves import write_sweep_curves

    for sweep in dict.fromkeys(folder.parent for folder in folders):
        runs, picture = read_sweep(sweep), sweep / "learning_curves.png"
        write_sweep_curves(runs, picture, sweep.name)
        print(f"\n{sweep}\n\n{sweep_table(runs)}\n\nlearning curves: {picture}")


@command("train", after_sweep=sweep_summary)
def main(job: Job) -> None:
    """Train, and end with a status that a script or a sweep understands."""
    import sys

    from hydra.core.hydra_config import HydraConfig
    from hydra.types import RunMode

    from tactile_cube.api.training import run_training
    from tactile_cube.training.collection import CollectionError
    from tactile_cube.training.run import INTERRUPTED

    try:
        result = run_training(job)
    except CollectionError as error:
        print(f"error: {error}; the same command goes on from the last checkpoint in {job.folder}", file=sys.stderr)
        sys.exit(1)
    if result.reason == INTERRUPTED and HydraConfig.get().mode == RunMode.MULTIRUN:
        sys.exit(130)  # else Ctrl-C would end one run of a sweep and start the next


if __name__ == "__main__":
    main()
