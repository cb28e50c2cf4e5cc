"""Check of the environment stated in a policy file: plain data that names listed classes only.

The file may come from anywhere, and Hydra makes whatever a configuration names. So all that any command has made of it
passes `require_parts` first. It names no class that is not in `PARTS`, gives Hydra no other instruction, refers to
nothing outside itself (`${...}`), and names only shipped files: who has the hand, the object or the
grasps in files of their own names them on the command line.
"""

import inspect
import math
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from tactile_cube.drivetrain.plain_yaml import describe
from tactile_cube.errors import InputError
from tactile_cube.hand.urdf_hand import DESCRIPTIONS

DISTRIBUTIONS = ("Choice", "Constant", "LogUniform", "Uniform", "UniformPerJoint")
PARTS = {
    "tactile_cube.env": ("Reward", "Task"),
    "tactile_cube.hand": ("hand_from_urdf", "published_hand"),
    "tactile_cube.randomization": ("GraspStarts", "Randomization", "StartStates", *DISTRIBUTIONS),
    "tactile_cube.simulation": ("EpisodeConstants", "SimulationOptions", "constants_of"),
}
"""Package -> the classes, and functions of plain numbers, that a policy file may name."""
KINDS = {"bool": (bool,), "float": (float, int), "int": (int,), "str": (str,), "None": (type(None),)}
MOST = 50_000
"""Maximum number of values in a configuration; one with an identified model of twelve joints has ten thousand."""
Part = dict[str, Any]


class _Environment(BaseModel):
    """The shape of `env`; keys that are in no policy file so far are refused."""

    model_config = ConfigDict(extra="forbid")

    target: Literal["tactile_cube.transforms.EnvConfig"] | None = Field(default=None, alias="_target_")
    task: Part | None = None
    reward: Part | None = None
    randomization: Part | None = None
    start: Part | None = None
    exploration: Any = Field(default=None, exclude=True)  # used in training only
    curriculum: Any = Field(default=None, exclude=True)
    constants: Part | None = None
    simulation: Part | None = None
    effects: list[str] = []
    model: Part | None = None
    stack: int = Field(default=5, ge=1)
    privileged: bool = True
    hand: Part | None = None


def require_parts(env: Any, label: str, replaced: Collection[str] = ()) -> dict[str, Any]:
    """Return the part `env` of a policy's configuration, checked, so that an environment can be built from it.

    Args:
        env: as the file has it.
        label: how the policy is called in a message.
        replaced: `hand`, `object`, or keys of `env` that the user names instead; they are left out.

    Raises:
        InputError: it asks for something else than a listed part, or is no plain data of that shape.
    """
    try:
        kept = _Environment.model_validate(env).model_dump(by_alias=True, exclude_unset=True)
        kept["constants"] = {key: value for key, value in (kept.get("constants") or {}).items() if key not in replaced}
        kept = {key: value for key, value in kept.items() if key not in replaced}
        if _count(kept) > MOST:
            raise InputError(f"{label}: its configuration has more than {MOST} values")
        return {key: _entry(key, value, f"env.{key}", label) for key, value in kept.items()}
    except ValidationError as error:
        raise InputError(f"{label}: in its configuration under env, {describe(error)}") from error
    except RecursionError:
        raise InputError(f"{label}: its configuration is nested too deeply") from None


@contextmanager
def making(label: str) -> Iterator[None]:
    """Raise any error in building from a policy's configuration as an `InputError` of one line."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:  # any kind of error: the values are untrusted
        if isinstance(error.__cause__, InputError):
            raise error.__cause__ from None
        raise InputError(f"{label}: its configuration cannot be used: {' '.join(str(error).split())}") from error


def _count(value: Any) -> int:
    parts = value.values() if isinstance(value, Mapping) else value if isinstance(value, list) else ()
    return 1 + sum(_count(part) for part in parts)


def _checked(value: Any, place: str, label: str) -> Any:
    if isinstance(value, Mapping):
        if "_target_" in value:
            _require_known(value, place, label)
        return {key: _entry(str(key), part, f"{place}.{key}", label) for key, part in value.items()}
    if isinstance(value, list):
        return [_checked(part, f"{place}[{index}]", label) for index, part in enumerate(value)]
    if isinstance(value, str) and "${" in value:
        raise InputError(f"{label}: its configuration refers to something outside ({place}: {value[:60]})")
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"{label}: {place} is {value}; give a finite number")
    return value


def _entry(key: str, value: Any, place: str, label: str) -> Any:
    """Return a key's value after a check; for a file that ships with the package, return its path."""
    if "${" in key or (key.startswith("_") and key not in ("_target_", "_convert_")):
        raise InputError(f"{label}: {place[:60]} is no setting of an environment")
    if key not in ("file", "urdf") or value is None:
        return _checked(value, place, label)
    shipped = {path.name: str(path) for path in DESCRIPTIONS.iterdir()} if key == "urdf" else {}
    if str(value) not in shipped:
        group = "hand" if key == "urdf" else "object" if ".object" in place else "start"
        raise InputError(
            f"{label}: {place} is {str(value)[:60]!r}, a file that is none of the package's; a policy file "
            f"may name no other; choose it yourself: {group}=..., with the options that it was trained with"
        )
    return shipped[str(value)]


def _require_known(part: Mapping[str, Any], place: str, label: str) -> None:
    """Refuse what is not listed, and values of another kind than it takes."""
    target = str(part["_target_"])
    package, _, name = target.rpartition(".")
    if name not in PARTS.get(package, ()):
        raise InputError(f"{label}: its configuration names {target[:60]!r}, which is no part of an environment")
    takes = inspect.signature(getattr(import_module(package), name)).parameters
    for key in part.keys() & takes.keys():
        kinds = inspect.formatannotation(takes[key].annotation).strip("'").split(" | ")
        value = part[key]
        kinds_known = KINDS.keys() >= set(kinds)
        wrong_flag = isinstance(value, bool) and "bool" not in kinds  # True and False are no numbers
        if kinds_known and (wrong_flag or not any(isinstance(value, KINDS[kind]) for kind in kinds)):
            raise InputError(f"{label}: {place}.{key} is {str(value)[:60]!r}; give {' or '.join(kinds)}")
