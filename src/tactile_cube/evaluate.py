"""Evaluate a policy: a verdict for every episode, a film of the best one."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("evaluate")
def main(config: DictConfig) -> None:
    """Run the episodes of a protocol, print and write the verdicts, film the best episode."""
    import functools

    from tactile_cube.api.evaluation import run_evaluation
    from tactile_cube.api.job import typed_job

    job = typed_job(config)
    result = run_evaluation(job, functools.partial(print, flush=True))
    print(result.text)
    result.write(job.folder, config.film)


if __name__ == "__main__":
    main()
