"""Has this machine changed since its model was identified: drift of known numbers, and an alarm for something new."""

from tactile_cube.api.job import Job
from tactile_cube.cli import command


@command("monitor")
def main(job: Job) -> None:
    """Refit the model on the newest recording, hold it against the one before, say what has changed."""
    from tactile_cube.api.monitoring import run_monitor

    result = run_monitor(job, job.config.recording, job.config.model)
    print(result.text)
    result.write(job.folder)


if __name__ == "__main__":
    main()
