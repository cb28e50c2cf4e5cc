"""List the physical effects that a model can have, or explain one: law, parameters, what it looks like in data."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("effects")
def main(config: DictConfig) -> None:
    """Print the catalogue, or the effect that `name` names."""
    from tactile_cube.api.effects import effects, effects_table

    found = effects(config.name)
    print(effects_table(found) if config.name is None else found[0].text)


if __name__ == "__main__":
    main()
