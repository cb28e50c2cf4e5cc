"""Fit a rig's constants and the effects that you name."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("identify")
def main(config: DictConfig) -> None:
    """Write model.yaml, identification.json and report.html; print the error after each stage."""
    from tactile_cube.api.comparison import opened
    from tactile_cube.api.identification import run_identification
    from tactile_cube.api.job import typed_job

    job = typed_job(config)
    found = run_identification(job, opened(config.recording), job.say)
    found.write(job.folder)
    print(found.text)
    print(f"model: {job.folder / 'model.yaml'}\nreport: {job.folder / 'report.html'}")


if __name__ == "__main__":
    main()
