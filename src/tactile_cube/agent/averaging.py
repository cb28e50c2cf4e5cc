"""The mean of the weights that a run had at several times: one policy out of several.

A policy that learns all the time sways about what is best; the mean over its way stands nearer to it. Source: Izmailov
et al., *Averaging Weights Leads to Wider Optima and Better Generalization*, UAI 2018.
"""

import re
from collections.abc import Sequence
from pathlib import Path

import torch

from tactile_cube.agent.networks import Actor
from tactile_cube.agent.policy_file import PolicyInfo, load_actor
from tactile_cube.errors import InputError

KEPT = re.compile(r"policy_(\d+)\.safetensors")
"""Policies that a run keeps each `training.policy_every` steps."""


def kept_policies(run: Path, last: int) -> list[Path]:
    """The last policies that a run has kept, the oldest first.

    Raises:
        InputError: there is no such folder, or it has fewer of them.
    """
    if not run.is_dir():
        raise InputError(f"run={run}: no such folder; give that of a training run")
    steps = {path: int(found[1]) for path in run.iterdir() if (found := KEPT.fullmatch(path.name))}
    kept = sorted(steps, key=lambda path: steps[path])
    if not 1 <= last <= len(kept):
        raise InputError(
            f"last={last}: {run} has {len(kept)} kept policies (policy_STEPS.safetensors); ask for 1 to {len(kept)}, "
            "or train with a smaller training.policy_every"
        )
    return kept[-last:]


def averaged(files: Sequence[Path]) -> tuple[Actor, PolicyInfo]:
    """An actor with the mean of the weights in policy files, described as the last of them.

    Raises:
        InputError: a file is damaged, or not of the size of the last one.
    """
    loaded = [load_actor(file) for file in files]
    actor, info = loaded[-1]
    for file, (_, other) in zip(files, loaded, strict=True):
        if (other.observation_size, other.hidden) != (info.observation_size, info.hidden):
            raise InputError(
                f"{file}: its layers have other sizes than those of {files[-1]}; average one run's policies"
            )
    with torch.no_grad():
        for weights in zip(*(other.parameters() for other, _ in loaded), strict=True):
            weights[-1].copy_(torch.stack(list(weights)).mean(0))
    return actor, info.model_copy(update={"averaged": tuple(other.steps for _, other in loaded), "performance": None})
