"""Fit a rig's constants and the effects that you name."""

from tactile_cube.api.job import Job
from tactile_cube.cli import command


@command("identify")
def main(job: Job) -> None:
    """Write model.yaml, identification.json and report.html; print the error after each stage."""
    from tactile_cube.api.identification import run_identification

    found = run_identification(job, job.config.recording)
    found.write(job.folder)
    print(f"{found.text}\nmodel: {job.folder / 'model.yaml'}\nreport: {job.folder / 'report.html'}")


if __name__ == "__main__":
    main()
