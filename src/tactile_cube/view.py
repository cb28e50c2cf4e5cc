"""See the best and the worst episode of a run side by side, and its learning curves."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("view")
def main(config: DictConfig) -> None:
    """Run episodes, write the best and the worst as one Rerun recording, open it where there is a viewer."""
    import functools

    from tactile_cube.api.job import typed_job
    from tactile_cube.api.view import run_view

    print(run_view(typed_job(config), functools.partial(print, flush=True)).text)


if __name__ == "__main__":
    main()
