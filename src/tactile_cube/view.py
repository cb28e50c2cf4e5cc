"""See the best and the worst episode of a run side by side, and its learning curves."""

from tactile_cube.api.job import Job, shown_at_once
from tactile_cube.cli import command


@command("view")
def main(job: Job) -> None:
    """Run episodes, write the best and the worst as one Rerun recording, open it where there is a viewer."""
    from tactile_cube.api.view import run_view

    print(run_view(job, shown_at_once).text)


if __name__ == "__main__":
    main()
