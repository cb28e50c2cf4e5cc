"""Search for a scripted gait that turns the object: what `exploration=demonstrations` plays.

    python -m benchmarks.gait hand=three_finger task=table --generations 20

Words such as `task=table` are those of `train`. The best gaits are tried again in fresh
episodes; gait.yaml has the result, ledger.json the cost.
"""

import argparse
import time
from pathlib import Path

import yaml

import tactile_cube
from benchmarks.gait.gait_search import search_gait, write_gait
from tactile_cube.training.ledger import LEDGER, Ledger
from tactile_cube.transforms.make_env import rotation_env

SETTINGS = {"reward": "air", "start": "wide_yaw", "curriculum": "none", "task.filter_time": 0.25}
"""Where the recipe's curriculum begins."""


def main() -> None:
    """Search, and say what came of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("settings", nargs="*", help="group=option and key=value, as of tactile_cube.train")
    parser.add_argument("--generations", type=int, default=40)
    parser.add_argument("--population", type=int, default=12, help="gaits a generation")
    parser.add_argument("--worlds", type=int, default=6, help="episodes a gait")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("outputs/search_gait"))
    given = parser.parse_intermixed_args()
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.process_time()
    ledger = Ledger(given.out / LEDGER, lambda: time.process_time() - began, in_process=True)
    asked = dict(word.split("=", 1) for word in given.settings)
    config = tactile_cube.env_config(values=SETTINGS | {key: yaml.safe_load(value) for key, value in asked.items()})
    worlds = [rotation_env(config) for _ in range(given.worlds)]
    found = search_gait(worlds, given.generations, given.population, given.seed, book=ledger.write)
    write_gait(given.out / "gait.yaml", found, given.seed, ledger.costs())
    best, cpu_hours = found.best, ledger.costs().simulating / 3600
    print(f"{best.angle:.2f} rad, kept in {best.kept:.0%} of {len(worlds)} fresh episodes; {found.tried} gaits tried")
    print(f"{cpu_hours:.2f} CPU hours; {given.out / 'gait.yaml'} has `gaits` for conf/exploration/demonstrations.yaml")


if __name__ == "__main__":
    main()
