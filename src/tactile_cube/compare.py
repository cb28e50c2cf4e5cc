"""Simulate a recording's commands and show how far model and measurement are apart, and where."""

from tactile_cube.api.job import Job
from tactile_cube.cli import command


@command("compare")
def main(job: Job) -> None:
    """Write comparison.json, report.html and comparison.rrd; print the errors and where the model fails."""
    from tactile_cube.api.comparison import run_comparison

    result = run_comparison(job, job.config.recording, job.config.model)
    result.write(job.folder, job.config.rerun)
    print(f"{result.text}\nreport: {job.folder / 'report.html'}")


if __name__ == "__main__":
    main()
