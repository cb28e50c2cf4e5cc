"""Has this machine changed since its model was identified: drift of known numbers, and an alarm for something new."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("monitor")
def main(config: DictConfig) -> None:
    """Refit the model on the newest recording, hold it against the one before, say what has changed."""
    from tactile_cube.api.comparison import modelled, opened
    from tactile_cube.api.job import typed_job
    from tactile_cube.api.monitoring import run_monitor

    job = typed_job(config)
    model = modelled(config.model)
    assert model is not None  # the configuration insists on it
    result = run_monitor(job, opened(config.recording), model, job.say)
    print(result.text)
    result.write(job.folder)


if __name__ == "__main__":
    main()
