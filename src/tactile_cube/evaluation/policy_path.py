"""Where the policy file lies that a user names: a path, a run's folder, or a policy that ships with the package."""

from importlib import resources
from pathlib import Path

from tactile_cube.composition import suggestion
from tactile_cube.errors import InputError
from tactile_cube.run_folder import CHECKPOINT, CONFIGURATION

BASELINES = ("hold", "random", "scripted", "scripted:GAIT.yaml", "replay:EPISODE.npz")
"""Names that are no files; evaluate knows them."""
SHIPPED = Path(str(resources.files("tactile_cube"))) / "policies"
"""Policies that come with the package; the one called `default` is taken when none is named."""


def policy_path(name: str | None, key: str = "policy") -> Path:
    """Return the policy file that a name means.

    Args:
        name: a policy file, a run's folder (its latest policy), or the name of a shipped policy; None takes `default`.
        key: that the user wrote the name behind.

    Raises:
        InputError: there is no such file.
    """
    if name is None:
        name = "default"
    path, packaged = Path(name), SHIPPED / f"{name}.safetensors"
    if path.is_dir():
        folder, path = path, path / "policy.safetensors"
        # A training in stages has a policy of its own in the end; before that, the stage's that was written last.
        stages = folder.glob("*/policy.safetensors") if (folder / CONFIGURATION).is_dir() else ()
        if not path.is_file():
            path = max(stages, key=lambda file: file.stat().st_mtime, default=path)
        if not path.is_file():
            raise InputError(f"{key}={name}: the folder holds no {path.name}; is the run's first checkpoint written?")
    if not path.is_file() and packaged.is_file():
        return packaged
    if not path.is_file():
        known = sorted(file.stem for file in SHIPPED.glob("*.safetensors"))
        known += BASELINES if key == "policy" else ()
        raise InputError(
            f"{key}={name}: no such file; give a policy file, a run folder, or one of {', '.join(known)}"
            f"{suggestion(name, known, f'{key}=')}"
        )
    return path


def networks_path(name: str | None) -> str | None:
    """Return the file whose networks a training run begins with; None begins with fresh ones.

    Args:
        name: a checkpoint, or what `policy_path` takes; of a run's folder the checkpoint, which has the critics too.

    Raises:
        InputError: there is no such file.
    """
    if name is None:
        return None
    checkpoint = Path(name) / CHECKPOINT if Path(name).is_dir() else Path(name)
    return str(checkpoint if checkpoint.is_file() else policy_path(name, "training.init_from"))
