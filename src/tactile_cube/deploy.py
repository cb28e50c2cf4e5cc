"""Run a policy's control loop on a hand: a dry run on the simulated one, or ROS 2."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command
from tactile_cube.run_folder import INTERRUPTED

TOUCHED = (
    "fingers touched the object or one another, which this recording does not describe: compare counts that as error. "
    "For a log that judges the model of the hand: motion=multisine robot.cube=false runs=2"
)


@command("deploy")
def main(config: DictConfig) -> None:
    """Open the fingers, wait for the object, let the policy decide, stop; write the loop's log as a recording."""
    import functools
    import sys

    from tactile_cube.api.deployment import run_deployment
    from tactile_cube.api.job import typed_job

    job = typed_job(config)
    result = run_deployment(job, functools.partial(print, flush=True))
    print(result.text)
    recording = result.write(job.folder / "recording") if config.record else None
    if recording is not None:
        print(f"log: {recording}\nnext: python -m tactile_cube.compare recording={recording}")
        if result.touched:
            print(TOUCHED)
    if result.runs[-1].interrupted:
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
