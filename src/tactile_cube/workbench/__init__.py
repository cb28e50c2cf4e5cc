"""Compare model and measurement in a browser, add what is missing, and watch the error fall."""

from tactile_cube.api.job import Job
from tactile_cube.cli import command


@command("workbench")
def main(job: Job) -> None:
    """Serve one window to this machine's browser until Ctrl-C, and print its address."""
    from tactile_cube.workbench.server import serve

    serve(job)
