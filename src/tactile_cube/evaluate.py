"""Evaluate a policy: a verdict for every episode, a film of the best one."""

from tactile_cube.api.job import Job, shown_at_once
from tactile_cube.cli import command


@command("evaluate")
def main(job: Job) -> None:
    """Run the episodes of a protocol, print and write the verdicts, film the best episode."""
    from tactile_cube.api.evaluation import run_evaluation

    result = run_evaluation(job, shown_at_once)
    print(result.text)
    result.write(job.folder, job.config.film)


if __name__ == "__main__":
    main()
