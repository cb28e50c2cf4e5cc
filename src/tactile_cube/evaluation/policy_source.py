"""From what the user writes after `policy=` to something that acts, and the environment it was trained in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

from tactile_cube.agent.policy_file import load_policy, require_sizes
from tactile_cube.errors import InputError
from tactile_cube.evaluation.policies import ActorPolicy, HoldPolicy, Policy, RandomPolicy, ReplayPolicy
from tactile_cube.evaluation.scripted import ScriptedPolicy

BASELINES = {"hold": HoldPolicy, "random": RandomPolicy, "scripted": ScriptedPolicy}
READING = 24
"""Numbers in one reading of the observation: q_m (12) and e_q (12)."""
JOINTS = 12


@dataclass(frozen=True)
class PolicySource:
    """A policy and where it comes from.

    Attributes:
        policy: what decides.
        label: how it is called in tables.
        provenance: seed, steps, commit and the like of its training, for the results file.
        config: configuration of its training, or empty.
        stack: readings in its observation, or None when it reads none.
    """

    policy: Policy
    label: str
    provenance: dict[str, Any] = field(default_factory=dict)
    config: Mapping[str, Any] = field(default_factory=dict)
    stack: int | None = None


def find_policy(name: str | None) -> PolicySource:
    """Return the policy of a name.

    Args:
        name: a policy file, a folder of a training run, the name of a policy that ships with the package, "hold",
            "random", "scripted", "replay:FILE", or None for the shipped default.

    Raises:
        InputError: there is no such policy, or its file cannot be used.
    """
    if name in BASELINES:
        return PolicySource(BASELINES[name](), name)
    if name is not None and name.startswith("replay:"):
        file = Path(name.removeprefix("replay:"))
        return PolicySource(ReplayPolicy.from_file(file), f"replay of {file.name}")
    return _from_file(policy_path(name))


def policy_path(name: str | None) -> Path:
    """Return the policy file that a name means."""
    shipped = Path(str(resources.files("tactile_cube"))) / "policies"
    if name is None:
        name = "default"
    path, packaged = Path(name), shipped / f"{name}.safetensors"
    if path.is_dir():
        files = sorted(path.rglob("*.safetensors"), key=lambda file: file.stat().st_mtime)
        if not files:
            raise InputError(
                f"policy={name}: the folder holds no *.safetensors; is the run's first checkpoint written?"
            )
        return files[-1]
    if not path.is_file() and packaged.is_file():
        return packaged
    if not path.is_file():
        known = sorted(file.stem for file in shipped.glob("*.safetensors"))
        choices = ", ".join([*known, *BASELINES, "replay:EPISODE.npz"])
        raise InputError(f"policy={name}: no such file; give a policy file, a run folder, or one of {choices}")
    return path


def _from_file(path: Path) -> PolicySource:
    actor, info = load_policy(path)
    stack = max(1, info.observation_size // READING)
    require_sizes(path, info, stack * READING, JOINTS)
    provenance = {"file": str(path), **info.model_dump(exclude={"config"})}
    return PolicySource(ActorPolicy(actor), path.stem, provenance, info.config, stack)
