"""Measure cases of contact that have an answer from mechanics, in each engine at each accuracy setting."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("mechanics")
def main(config: DictConfig) -> None:
    """Run the cases and write the page."""
    import shlex
    import sys
    from pathlib import Path

    from tactile_cube.agent.policy_file import current_commit
    from tactile_cube.simulation import SimulationOptions
    from tactile_cube.simulation.mechanics.page import mechanics_page
    from tactile_cube.simulation.mechanics.refinement import refine
    from tactile_cube.simulation.mechanics.settings import chosen, measure

    commit = current_commit()
    settings = chosen(config.engines, config.accuracy, config.cases)
    found = measure(*settings, say=print)
    finer = [
        row for engine in config.engines for row in refine(SimulationOptions.fast(engine), config.spinning, say=print)
    ]
    words = shlex.join(["python", "-m", "tactile_cube.mechanics", *sys.argv[1:]])
    command = f"{words}` at commit `{commit}" if commit else words
    page = Path(config.page)
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(mechanics_page(found, finer, command), encoding="utf-8")
    print(f"page: {page}")


if __name__ == "__main__":
    main()
