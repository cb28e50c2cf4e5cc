"""The environment that collectors and learners are timed on: the table task of `+experiment=table`."""

from __future__ import annotations

from dataclasses import replace

from tactile_cube.simulation.engine import EngineName
from tactile_cube.training.build import Environment, rotation_environment
from tactile_cube.transforms import EnvConfig


def table_config() -> EnvConfig:
    """The configuration of the experiment, composed as on the command line."""
    from hydra import compose, initialize_config_dir
    from hydra.core.global_hydra import GlobalHydra
    from hydra.utils import instantiate

    from tactile_cube.composition import CONFIG

    GlobalHydra.instance().clear()  # of the command that runs this, which has its configuration already
    with initialize_config_dir(str(CONFIG.resolve()), version_base="1.3"):
        config: EnvConfig = instantiate(compose("train", overrides=["+experiment=table"]).env)
    return config


def table_environment(engine: EngineName = "bullet") -> Environment:
    """The same, as training takes it."""
    config = table_config()
    return rotation_environment(replace(config, simulation=replace(config.simulation, engine=engine)))
