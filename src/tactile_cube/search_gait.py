"""Search for a scripted gait that turns the object: what exploration=demonstrations plays."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import verb


@verb("search_gait")
def main(config: DictConfig) -> None:
    """Search, try the best again in fresh episodes, write gait.yaml."""
    from pathlib import Path

    from hydra.core.hydra_config import HydraConfig
    from hydra.utils import instantiate

    from tactile_cube.evaluation.gait_search import search_gait, write_gait
    from tactile_cube.transforms.make_env import rotation_env

    environment = instantiate(config.env)
    worlds = [rotation_env(environment) for _ in range(config.worlds)]
    found = search_gait(worlds, config.generations, config.population, config.seed)
    file = Path(HydraConfig.get().runtime.output_dir) / "gait.yaml"
    write_gait(file, found, config.seed)
    best = found.best
    print(f"{best.angle:.2f} rad, kept in {best.kept:.0%} of {len(worlds)} fresh episodes; {found.tried} gaits tried")
    print(f"{found.cpu_seconds / 3600:.2f} CPU hours; {file} has the `gaits` for conf/exploration/demonstrations.yaml")


if __name__ == "__main__":
    main()
