"""The environment a policy is tried in: the one it was trained in, with what the user asks to be different."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Any

import hydra.utils
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from tactile_cube.errors import InputError
from tactile_cube.evaluation.policy_source import PolicySource
from tactile_cube.transforms import EnvConfig

GROUPS = ("task", "reward", "randomization", "start")
UNCHOSEN = (None, "null")
"""What stands for an option where a group is as in the policy's training."""
PUBLISHED_SPINNING_FRICTION = 0.1
"""What policies were trained at [m] before files stated it: it was the only nominal value then."""
PARTS = ("curriculum", "env", "randomization", "simulation", "transforms")
"""A policy file is data from somewhere: of the classes it names, only those that these packages list are made."""

MAKERS = (
    "tactile_cube.hand.hand_from_urdf",
    "tactile_cube.hand.published_hand",
    "tactile_cube.simulation.constants_of",
)
"""Functions that it may name besides: they make hands and constants of plain numbers."""


def environment(config: DictConfig, source: PolicySource, choices: Mapping[str, str | None]) -> EnvConfig:
    """Return the environment of `source` with the overrides of the command line.

    `model` and `effects` replace those that the policy was trained with. A group chosen on the command line
    (`task=full`) replaces the policy's; `engine` replaces the one it was trained in; single values
    (`+task.filter_time=0.3`, `+env.simulation.solver_iterations=100`) change it.

    Args:
        config: of evaluate.
        source: the policy.
        choices: group -> option that was chosen for it.

    Raises:
        InputError: the policy file's configuration cannot be used.
    """
    trained = source.config.get("env")
    named = config.get("model") is not None or config.get("effects") is not None
    settings: Any
    if trained is None:
        settings = OmegaConf.create(OmegaConf.to_container(config.untrained, resolve=True))
    else:
        settings = OmegaConf.create(_checked(dict(trained) | {"curriculum": None, "exploration": None}, source.label))
        constants = {"tip_spinning_friction": PUBLISHED_SPINNING_FRICTION}
        settings.constants = OmegaConf.merge(constants, settings.get("constants") or {})
        settings.constants["_target_"] = "tactile_cube.simulation.constants_of"
        _set_hand_and_object(settings, config)
    if named:
        settings.model, settings.effects = config.model, config.effects or []
    if config.protocol.worlds == "paper":
        settings.randomization, settings.start = config.paper.randomization, config.paper.start
    for group in GROUPS:
        if group in config:
            own = choices.get(group) in UNCHOSEN
            settings[group] = OmegaConf.merge(settings[group], config[group]) if own else config[group]
    settings = OmegaConf.merge(
        settings, config.get("env") or {}, {} if source.stack is None else {"stack": source.stack}
    )
    _set_engine(settings, config.get("engine"))
    made = _made(settings, source.label)
    if source.joints not in (None, made.hand.joints):
        raise InputError(
            f"policy={source.label}: acts on {source.joints} joints, hand '{made.hand.name}' has {made.hand.joints}; "
            "leave hand= out for the one it was trained on"
        )
    return made


def worlds(config: DictConfig, source: PolicySource, choices: Mapping[str, str | None]) -> dict[str, str]:
    """Return which options draw worlds and starts; arguments as of `environment`."""
    own = source.config and config.protocol.worlds == "training"
    named = {}
    for group in ("randomization", "start"):
        unchosen = "as in training" if own else choices[f"{group}@paper.{group}"]
        named[group] = str(unchosen if choices.get(group) in UNCHOSEN else choices[group])
    return named


def _made(settings: Any, label: str) -> EnvConfig:
    try:
        made = hydra.utils.instantiate(settings)
    except (hydra.errors.InstantiationException, OmegaConfBaseException) as error:
        if isinstance(error.__cause__, InputError):
            raise error.__cause__ from None
        raise InputError(f"environment of policy={label}: {' '.join(str(error).split())}") from error
    if not isinstance(made, EnvConfig):
        raise InputError(f"policy={label}: its configuration has no environment of this package")
    return made


def _set_hand_and_object(settings: Any, config: DictConfig) -> None:
    """Those of the training unless others are asked for."""
    for group in ("hand", "object"):
        if group in config:
            settings.constants[group] = config[group]
    if "hand" in config:
        settings.hand = config.hand


def _set_engine(settings: Any, wanted: str | None) -> None:
    """One engine for the one world of an evaluation: the wanted one, else that of the training."""
    trained = OmegaConf.select(settings, "simulation.engine")
    engine = wanted or ("bullet" if trained == "mixed" else trained)
    if engine is not None:
        OmegaConf.update(settings, "simulation.engine", engine, force_add=True)


def _checked(config: Mapping[str, Any], label: str) -> dict[str, Any]:
    """Return the configuration as plain data after making sure that it names no foreign class."""
    for key, text in _texts(config):
        if key == "_target_" and not _is_part(text):
            raise InputError(f"policy={label}: its configuration names {text!r}, which is no part of an environment")
        if "${" in text:
            raise InputError(f"policy={label}: its configuration refers to something outside ({key}: {text})")
    return {str(key): value for key, value in config.items()}


def _is_part(target: str) -> bool:
    """Whether it names one of `MAKERS` or a class that one of `PARTS` lists.

    By Hydra, tactile_cube.cli.os.system would be found too.
    """
    if target in MAKERS:
        return True
    module, _, name = target.rpartition(".")
    if module not in {f"tactile_cube.{part}" for part in PARTS}:
        return False
    listed = import_module(module)
    return name in listed.__all__ and isinstance(getattr(listed, name), type)


def _texts(value: Any, key: str = "") -> Iterator[tuple[str, str]]:
    """All that may be text in plain data, with the key it stands at; a target that is no text, as text."""
    if isinstance(value, Mapping):
        for name, part in value.items():
            yield "", str(name)
            yield from _texts(part, str(name))
    elif isinstance(value, list | tuple):
        for part in value:
            yield from _texts(part, key)
    else:
        yield key, str(value)
