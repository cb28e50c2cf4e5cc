"""Run a policy's control loop on a hand: a dry run on the simulated one, or ROS 2."""

from tactile_cube.api.job import Job, shown_at_once
from tactile_cube.cli import command
from tactile_cube.run_folder import INTERRUPTED


@command("deploy")
def main(job: Job) -> None:
    """Open the fingers, wait for the object, let the policy decide, stop; write the loop's log as a recording."""
    import shutil
    import sys

    from tactile_cube.api.deployment import run_deployment

    log = job.folder / "log"
    result = run_deployment(job, shown_at_once, log)
    print(result.text)
    recording = result.write(job.folder / "recording")
    shutil.rmtree(log, ignore_errors=True)  # it is the recording now
    if recording is not None:
        print(f"log: {recording}")
        if job.config.motion != "policy":  # else fingers touch the object, of which the recording says nothing
            print(f"next: python -m tactile_cube.compare recording={recording}")
    if result.runs[-1].interrupted:
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
