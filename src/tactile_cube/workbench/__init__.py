"""Compare model and measurement in a browser, add what is missing, and watch the error fall."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("workbench")
def main(config: DictConfig) -> None:
    """Serve one window to this machine's browser until Ctrl-C, and print its address."""
    from tactile_cube.api.job import typed_job
    from tactile_cube.workbench.server import serve

    serve(typed_job(config))
