"""Put a trained policy into the package, with its model card."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("ship")
def main(config: DictConfig) -> None:
    """Copy the policy file and write the card beside it."""
    import shutil
    from pathlib import Path

    from tactile_cube.agent.policy_file import load_policy
    from tactile_cube.evaluation.ancestry import read_ancestry
    from tactile_cube.evaluation.model_card import model_card
    from tactile_cube.evaluation.policy_path import SHIPPED, policy_path
    from tactile_cube.evaluation.results_file import read_results

    source = policy_path(config.policy)
    _, info = load_policy(source)
    folders = [Path(folder) for folder in (*config.before, config.run or source.parent)]
    runs = read_ancestry(folders)
    results = [read_results(Path(file)) for file in config.results]
    SHIPPED.mkdir(exist_ok=True)
    target = SHIPPED / f"{config.name}.safetensors"
    shutil.copyfile(source, target)
    card = target.with_suffix(".md")
    card.write_text(model_card(config.name, info, runs, results, config.limits), encoding="utf-8")
    print(f"{source} -> {target}\ncard: {card}")


if __name__ == "__main__":
    main()
