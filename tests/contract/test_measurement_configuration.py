"""Every source of recordings composes, and its settings are those of its class."""

import inspect
from pathlib import Path

import pytest
from hydra import compose, initialize_config_dir
from hydra.utils import get_class
from omegaconf import OmegaConf

from tactile_cube.command_help import CONFIG

SOURCES = sorted(path.stem for path in (Path(CONFIG) / "source").glob("*.yaml"))


@pytest.mark.parametrize("source", SOURCES)
def test_a_source_has_the_settings_of_its_class(source: str) -> None:
    with initialize_config_dir(str(Path(CONFIG).resolve()), version_base="1.3"):
        config = compose("record", overrides=[f"source={source}", "out=somewhere"])
    settings = OmegaConf.to_container(config.source, resolve=False)
    cls = get_class(settings.pop("_target_"))
    assert set(settings) == set(inspect.signature(cls).parameters)
