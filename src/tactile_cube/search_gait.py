"""Search for a scripted gait that turns the object: what exploration=demonstrations plays."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("search_gait")
def main(config: DictConfig) -> None:
    """Search, try the best again in fresh episodes, write gait.yaml and, after each generation, ledger.json."""
    import time
    from pathlib import Path

    from hydra.core.hydra_config import HydraConfig
    from hydra.utils import instantiate

    from tactile_cube.evaluation.gait_search import search_gait, write_gait
    from tactile_cube.training.ledger import LEDGER, Ledger
    from tactile_cube.transforms.make_env import rotation_env

    folder = Path(HydraConfig.get().runtime.output_dir)
    began = time.process_time()
    ledger = Ledger(folder / LEDGER, 1, lambda: time.process_time() - began, in_process=True)
    environment = instantiate(config.env)
    worlds = [rotation_env(environment) for _ in range(config.worlds)]
    found = search_gait(worlds, config.generations, config.population, config.seed, book=ledger.write)
    write_gait(folder / "gait.yaml", found, config.seed, ledger.costs())
    best, cpu_hours = found.best, ledger.costs().simulating / 3600
    print(f"{best.angle:.2f} rad, kept in {best.kept:.0%} of {len(worlds)} fresh episodes; {found.tried} gaits tried")
    print(f"{cpu_hours:.2f} CPU hours; {folder / 'gait.yaml'} has the `gaits` for conf/exploration/demonstrations.yaml")


if __name__ == "__main__":
    main()
