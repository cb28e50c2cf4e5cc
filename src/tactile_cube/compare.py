"""Simulate a recording's commands and show how far model and measurement are apart, and where."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("compare")
def main(config: DictConfig) -> None:
    """Write comparison.json, report.html and comparison.rrd; print the errors and where the model fails."""
    from tactile_cube.api.comparison import modelled, opened, run_comparison
    from tactile_cube.api.job import typed_job

    job = typed_job(config)
    model = modelled(config.model)
    result = run_comparison(job, opened(config.recording), model, job.say)
    result.write(job.folder, config.rerun)
    print(result.text)
    print(f"report: {job.folder / 'report.html'}")


if __name__ == "__main__":
    main()
