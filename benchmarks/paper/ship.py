"""Put a trained policy into the package, with its model card.

python -m benchmarks.paper.ship outputs/train/table-seed0 --name table --results docs/results/runs/paper.json
"""

import argparse
import shutil
from pathlib import Path

from benchmarks.paper.model_card import model_card, read_ancestry
from benchmarks.paper.rows import read_results
from tactile_cube.agent.policy_file import load_actor
from tactile_cube.evaluation.policy_path import SHIPPED, policy_path


def main() -> None:
    """Copy the policy file and write the card beside it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("policy", help="a policy file or the folder of a training run")
    parser.add_argument(
        "--run", type=Path, help="folder of the training run, for its ledger; else where the policy lies"
    )
    parser.add_argument("--before", nargs="*", type=Path, default=[], help="runs that it comes from, in their order")
    parser.add_argument("--results", nargs="*", type=Path, default=[], help="results files of its evaluations")
    parser.add_argument("--limits", default="", help="what it cannot do, in a sentence or two")
    parser.add_argument("--name", default="default", help="what it is called: evaluate policy=<name>")
    given = parser.parse_args()
    source = policy_path(given.policy)
    info = load_actor(source)[1]
    runs = read_ancestry([*given.before, given.run or source.parent])
    results = [read_results(file) for file in given.results]
    target = SHIPPED / f"{given.name}.safetensors"
    shutil.copyfile(source, target)
    card = target.with_suffix(".md")
    card.write_text(model_card(given.name, info, runs, results, given.limits), encoding="utf-8")
    print(f"{source} -> {target}\ncard: {card}")


if __name__ == "__main__":
    main()
