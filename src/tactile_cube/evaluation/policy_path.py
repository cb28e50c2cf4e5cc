"""Where the policy file lies that a user names: a path, a run's folder, or a policy that ships with the package."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from tactile_cube.errors import InputError

BASELINES = ("hold", "random", "scripted", "replay:EPISODE.npz")
"""Names that are no files; evaluate knows them."""
SHIPPED = Path(str(resources.files("tactile_cube"))) / "policies"
"""Policies that come with the package; the one called `default` is taken when none is named."""


def policy_path(name: str | None) -> Path:
    """Return the policy file that a name means."""
    if name is None:
        name = "default"
    path, packaged = Path(name), SHIPPED / f"{name}.safetensors"
    if path.is_dir():
        path /= "policy.safetensors"
        if not path.is_file():
            raise InputError(f"policy={name}: the folder holds no {path.name}; is the run's first checkpoint written?")
    if not path.is_file() and packaged.is_file():
        return packaged
    if not path.is_file():
        known = sorted(file.stem for file in SHIPPED.glob("*.safetensors"))
        choices = ", ".join([*known, *BASELINES])
        raise InputError(f"policy={name}: no such file; give a policy file, a run folder, or one of {choices}")
    return path
