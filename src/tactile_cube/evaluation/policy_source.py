"""From what the user writes after `policy=` to something that acts, and the environment it was trained in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tactile_cube.agent.policy_file import load_policy, require_sizes
from tactile_cube.evaluation.policies import ActorPolicy, HoldPolicy, Policy, RandomPolicy, ReplayPolicy, ScriptedPolicy
from tactile_cube.evaluation.policy_path import SHIPPED, policy_path

BASELINES: dict[str, type[HoldPolicy] | type[RandomPolicy] | type[ScriptedPolicy]] = {
    "hold": HoldPolicy,
    "random": RandomPolicy,
    "scripted": ScriptedPolicy,
}


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
            "random", "scripted", "scripted:FILE" (the best gait that search_gait found), "replay:FILE", or None for the
            shipped default.

    Raises:
        InputError: there is no such policy, or its file cannot be used.
    """
    if name is not None and name in BASELINES:
        return PolicySource(BASELINES[name](), name)
    if name is not None and name.startswith("scripted:"):
        file = Path(name.removeprefix("scripted:"))
        return PolicySource(ScriptedPolicy.from_file(file), f"scripted gait of {file.name}")
    if name is not None and name.startswith("replay:"):
        file = Path(name.removeprefix("replay:"))
        return PolicySource(ReplayPolicy.from_file(file), f"replay of {file.name}")
    return _from_file(policy_path(name))


def _from_file(path: Path) -> PolicySource:
    actor, info = load_policy(path)
    joints = info.action_size
    reading = 2 * joints  # q_m and e_q
    stack = max(1, info.observation_size // reading)
    require_sizes(path, info, stack * reading, joints)
    shipped = path.parent == SHIPPED
    file, label = (path.name, path.stem) if shipped else (str(path), f"{path.resolve().parent.name}/{path.stem}")
    provenance = {"file": file, **info.model_dump(exclude={"config"})}
    return PolicySource(ActorPolicy(actor), label, provenance, info.config, stack, joints)
