"""A configuration out of conf/, composed as a command line would, from within any program."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import yaml

from tactile_cube.command_help import CONFIG, RECIPE
from tactile_cube.did_you_mean import near_key
from tactile_cube.errors import InputError

if TYPE_CHECKING:
    from omegaconf import DictConfig


def composed(name: str | None, settings: Sequence[str], with_hydra: bool = False) -> DictConfig:
    """The configuration of a command with some of its settings chosen.

    A Hydra application that calls this keeps its own configuration.

    Args:
        name: of the command whose conf/<name>.yaml it is; None: nothing but what `settings` add.
        settings: choices and values as on the command line, e.g. "task=table", "seed=1".
        with_hydra: also give Hydra's own part, which names run folder and choices.

    Raises:
        hydra.errors.HydraException: a setting that there is not.
    """
    from hydra import compose, initialize_config_dir
    from hydra.core.global_hydra import GlobalHydra

    application = GlobalHydra.instance().hydra
    GlobalHydra.instance().hydra = None
    try:
        with initialize_config_dir(str(CONFIG.resolve()), version_base="1.3"):
            return compose(name, [*settings], return_hydra_config=with_hydra)
    finally:
        GlobalHydra.instance().hydra = application


def refuse_unknown_keys(name: str, config: DictConfig) -> None:
    """Refuse top-level keys that a command does not read: a mistyped `+experiment=` would start another run.

    Args:
        name: of the command.
        config: as composed.

    Raises:
        InputError: a key that is none of the command's and no group of conf/.
    """
    own = yaml.safe_load((CONFIG / f"{name}.yaml").read_text(encoding="utf-8"))
    groups = [key for entry in own.get("defaults", []) if isinstance(entry, dict) for key in entry]
    placed = {key.partition("@")[2].partition(".")[0] for key in groups if "@" in key}
    known = {"hydra", *own, *placed}
    for key in map(str, config.keys() - known):
        if not (CONFIG / key).is_dir():
            raise InputError(f"{key}: no such setting of {name}; --help lists them{near_key(key)}")


def with_recipe(name: str, words: list[str]) -> list[str]:
    """The words of a command line, with the command's recipe in front of the first `key=value` unless they choose one.

    Example:
        >>> with_recipe("train", ["train", "seed=1", "--cfg", "job"])
        ['train', '+experiment=curriculum', 'seed=1', '--cfg', 'job']
    """
    if name not in RECIPE or any(re.match(r"[+~]*experiment\b", word) for word in words):
        return words
    first = next((at for at, word in enumerate(words) if re.match(r"[+~]*[\w./@]+=", word)), len(words))
    return [*words[:first], f"+experiment={RECIPE[name]}", *words[first:]]
