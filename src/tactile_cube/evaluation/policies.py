"""Policies to be evaluated, trained actors and baselines, and the environment of an evaluation."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import hydra.utils
import numpy as np
import torch
from numpy.typing import NDArray
from omegaconf import DictConfig, OmegaConf

from tactile_cube.agent.networks import Actor
from tactile_cube.agent.policy_file import load_actor, require_sizes
from tactile_cube.agent.policy_parts import making, require_parts
from tactile_cube.drivetrain.plain_yaml import read_yaml
from tactile_cube.env import RotationEnv
from tactile_cube.errors import InputError
from tactile_cube.evaluation.episode_record import Array, EpisodeRecord
from tactile_cube.evaluation.policy_path import SHIPPED, policy_path
from tactile_cube.hand import DLR_HAND2, Gait, grasp_angles
from tactile_cube.transforms import EnvConfig

SQUEEZE = 0.010
"""How far the targets of the tips lie inside the faces when a baseline holds the cube [m]; gives 1 to 3 N."""


class Policy(Protocol):
    """Chooses the action of each policy step."""

    def start(self, env: RotationEnv, seed: int) -> None:
        """Begin an episode that has just been reset; by default there is nothing to prepare."""
        return

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return the action `(joints,)` in [-1, 1] for the stacked observation."""


class ActorPolicy(Policy):
    """A trained actor without exploration: the same observation always gives the same action."""

    def __init__(self, actor: Actor) -> None:
        self._actor = actor

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return tanh of the actor's mean."""
        with torch.no_grad():
            action = self._actor.deterministic(torch.from_numpy(observation)[None])
        return action[0].double().numpy()


class HoldPolicy:
    """Squeezes the cube at its start pose, which it is given, and never moves again."""

    def start(self, env: RotationEnv, seed: int) -> None:
        """Aim the fingertips `SQUEEZE` inside the faces."""
        world = env.world
        size = np.asarray(env.constants.cube_size)
        pose, shape = (world.cube_position, world.cube_quaternion), env.constants.object_shape
        angles = grasp_angles(env.hand, size, *pose, clearance=-SQUEEZE, shape=shape)
        self._action = env.hand.action_of(angles)

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return the same action at every step."""
        return self._action


class RandomPolicy:
    """Draws every action uniformly from the action range."""

    def start(self, env: RotationEnv, seed: int) -> None:
        """Seed the draws."""
        self._rng, self._joints = np.random.default_rng(seed), env.hand.joints

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return a fresh draw."""
        return self._rng.uniform(-1.0, 1.0, self._joints)


class ReplayPolicy:
    """Sends the targets of a recorded episode again, whatever the fingers feel, and keeps the last one after its end.

    Args:
        targets: q_n `(n, joints)` [rad], in the encoders' coordinates.
    """

    def __init__(self, targets: Array) -> None:
        self._targets = targets

    def start(self, env: RotationEnv, seed: int) -> None:
        """Scale the targets to the hand's action range."""
        self._actions = env.hand.action_of(self._targets)

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return the recorded action of this step."""
        return np.asarray(self._actions[min(step, len(self._actions) - 1)])


class ScriptedPolicy:
    """Plays the gait in the rewarded direction."""

    def __init__(self, gait: Gait | None = None) -> None:
        self._gait = gait or Gait()

    def start(self, env: RotationEnv, seed: int) -> None:
        """Remember hand and direction."""
        self._hand, self._direction = env.hand, env.task.direction

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return the action of the clock's step."""
        return self._gait.action(self._hand, step, self._direction)


BASELINES: dict[str, Callable[[], Policy]] = {"hold": HoldPolicy, "random": RandomPolicy, "scripted": ScriptedPolicy}


@dataclass(frozen=True)
class PolicySource:
    """A policy and where it comes from.

    Attributes:
        policy: what decides.
        label: how it is called in tables.
        provenance: seed, steps, commit and the like of its training, for the results file.
        config: configuration of its training, or empty.
        stack: readings in its observation, or None when it reads none.
        joints: that it acts on, or None when it takes those of any hand.
    """

    policy: Policy
    label: str
    provenance: dict[str, Any] = field(default_factory=dict)
    config: Mapping[str, Any] = field(default_factory=dict)
    stack: int | None = None
    joints: int | None = None


def find_policy(name: str | None) -> PolicySource:
    """Return the policy of a name.

    Args:
        name: a policy file, a folder of a training run, the name of a policy that ships with the package, "hold",
            "random", "scripted", "scripted:FILE" (the best gait that `benchmarks.gait` found), "replay:FILE" (an
            episode that evaluate wrote, `*.npz`), or None for the shipped default.

    Raises:
        InputError: there is no such policy, or its file cannot be used.
    """
    if name in BASELINES:
        return PolicySource(BASELINES[name](), name)
    kind, separator, place = (name or "").partition(":")
    if separator and kind == "scripted":
        try:
            best = read_yaml(Path(place))["best"]
            gait = Gait(**best | {"phases": tuple(best["phases"])})
        except (KeyError, TypeError) as error:
            raise InputError(f"policy=scripted:{place}: no gait of benchmarks.gait (key 'best')") from error
        return PolicySource(ScriptedPolicy(gait), f"scripted gait of {Path(place).name}")
    if separator and kind == "replay":
        record = EpisodeRecord.load(Path(place))
        if record.steps == 0:
            raise InputError(f"{place}: the recorded episode has no steps to replay")
        return PolicySource(ReplayPolicy(record.target), f"replay of {Path(place).name}")
    path = policy_path(name)
    actor, info = load_actor(path)
    joints = info.action_size
    stack = max(1, info.observation_size // (2 * joints))  # of q_m and e_q
    require_sizes(path, info, 2 * joints * stack, joints)
    shipped = path.parent == SHIPPED
    file, label = (path.name, path.stem) if shipped else (str(path), f"{path.resolve().parent.name}/{path.stem}")
    provenance = {"file": file, **info.model_dump(exclude={"config"})}
    return PolicySource(ActorPolicy(actor), label, provenance, info.config, stack, joints)


CONSTANTS = "tactile_cube.simulation.constants_of"
GROUPS = ("task", "reward", "randomization", "start")
PUBLISHED_SPINNING_FRICTION = 0.1
"""Spinning friction [m] of policies whose files do not state it: it was the only nominal value then."""


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
    """Return the training's environment with the chosen hand and object; for an untrained policy, that of evaluate."""
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
    """Set one engine for the one world of an evaluation: the wanted one, else that of the training."""
    trained = OmegaConf.select(settings, "simulation.engine")
    if wanted not in (None, "bullet", "mujoco"):
        raise InputError(f"engine={wanted}: choose bullet or mujoco")
    engine = wanted or ("bullet" if trained == "mixed" else trained)
    if engine is not None:
        OmegaConf.update(settings, "simulation.engine", engine, force_add=True)
