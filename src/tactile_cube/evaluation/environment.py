"""The environment a policy is tried in: the one it was trained in, with what the user asks to be different."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import hydra.utils
from omegaconf import DictConfig, OmegaConf

from tactile_cube.agent.policy_parts import making, require_parts
from tactile_cube.errors import InputError
from tactile_cube.evaluation.policies import PolicySource
from tactile_cube.hand import DLR_HAND2
from tactile_cube.transforms import EnvConfig

CONSTANTS = "tactile_cube.simulation.constants_of"
GROUPS = ("task", "reward", "randomization", "start")
PUBLISHED_SPINNING_FRICTION = 0.1
"""What policies were trained at [m] before files stated it: it was the only nominal value then."""


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
    named = config.get("model") is not None or config.get("effects") is not None
    settings: Any = _trained(config, source, choices, named)
    if named:
        settings.model, settings.effects = config.model, config.effects or []
    if config.protocol.worlds == "paper":
        settings.randomization, settings.start = config.paper.randomization, config.paper.start
    for group in GROUPS:
        if group in config:
            trained = {} if _chosen(group, choices) else settings.get(group) or {}
            settings[group] = OmegaConf.merge(trained, config[group])
    settings = OmegaConf.merge(
        settings, config.get("env") or {}, {} if source.stack is None else {"stack": source.stack}
    )
    _set_engine(settings, config.get("engine"))
    with making(f"policy={source.label}"):
        made: EnvConfig = hydra.utils.instantiate(settings)
    if source.joints not in (None, made.hand.joints):
        raise InputError(
            f"policy={source.label}: acts on {source.joints} joints, hand '{made.hand.name}' has {made.hand.joints}; "
            "leave hand= out for the one it was trained on"
        )
    if env := source.config.get("env"):
        trained = (env.get("hand") or {}).get("name", DLR_HAND2.name)
        if made.hand.name != trained:
            raise InputError(f"policy={source.label}: trained on hand {trained}, not {made.hand.name}; leave hand= out")
    return made


def worlds(config: DictConfig, source: PolicySource, choices: Mapping[str, str | None]) -> dict[str, str]:
    """Return which options draw worlds and starts; arguments as of `environment`."""
    own = source.config and config.protocol.worlds == "training"
    named = {}
    for group in ("randomization", "start"):
        unchosen = "as in training" if own else choices[f"{group}@paper.{group}"]
        named[group] = str(choices[group] if _chosen(group, choices) else unchosen)
    return named


def _trained(config: DictConfig, source: PolicySource, choices: Mapping[str, str | None], named: bool) -> DictConfig:
    """The environment of the training, with the hand and object asked for; what nobody trained has that of evaluate."""
    if source.config.get("env") is None:
        return OmegaConf.create(OmegaConf.to_container(config.untrained, resolve=True))  # type: ignore[return-value]
    asked = {group for group in ("hand", "object") if group in config}
    chosen = {group for group in GROUPS if _chosen(group, choices)} | ({"model", "effects"} if named else set())
    kept = require_parts(source.config["env"], f"policy={source.label}", asked | chosen)
    nobody = {"curriculum": None, "exploration": None, "_target_": "tactile_cube.transforms.EnvConfig"}
    constants = {"tip_spinning_friction": PUBLISHED_SPINNING_FRICTION} | kept["constants"] | {"_target_": CONSTANTS}
    settings = OmegaConf.create(kept | nobody | {"constants": constants})
    for group in asked:
        settings.constants[group] = config[group]
    if "hand" in asked:
        settings.hand = config.hand
    return settings


def _chosen(group: str, choices: Mapping[str, str | None]) -> bool:
    return choices.get(group) not in (None, "null")


def _set_engine(settings: Any, wanted: str | None) -> None:
    """One engine for the one world of an evaluation: the wanted one, else that of the training."""
    trained = OmegaConf.select(settings, "simulation.engine")
    if wanted not in (None, "bullet", "mujoco"):
        raise InputError(f"engine={wanted}: choose bullet or mujoco")
    engine = wanted or ("bullet" if trained == "mixed" else trained)
    if engine is not None:
        OmegaConf.update(settings, "simulation.engine", engine, force_add=True)
