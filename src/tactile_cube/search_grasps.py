"""Search for grasps that hold the object by themselves: what start=grasps begins with."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("search_grasps")
def main(config: DictConfig) -> None:
    """Search until enough grasps held, write grasps.npz."""
    import shlex
    import sys
    from dataclasses import replace
    from pathlib import Path

    from hydra.core.hydra_config import HydraConfig
    from hydra.utils import instantiate

    from tactile_cube.agent.policy_file import current_commit
    from tactile_cube.evaluation.grasp_search import search_grasps
    from tactile_cube.simulation import World

    folder = Path(HydraConfig.get().runtime.output_dir)
    hand, constants = instantiate(config.hand), instantiate(config.constants)
    world = World(hand, instantiate(config.simulation))
    found = search_grasps(world, constants, instantiate(config.search), config.grasps, config.seed)
    command = shlex.join(["python", "-m", "tactile_cube.search_grasps", *sys.argv[1:]])
    written = replace(found, origin=found.origin | {"command": command, "commit": current_commit()})
    written.save(folder / "grasps.npz")
    print(f"{len(found.angles)} grasps in {found.origin['tries']} tries: {folder / 'grasps.npz'}")


if __name__ == "__main__":
    main()
