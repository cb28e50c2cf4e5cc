"""What a user did wrong, in one line, from the errors of this package, of pydantic, of Hydra and of the disk."""

import errno
import re
import traceback
from collections.abc import Iterator
from typing import Any

from tactile_cube.composition import meaning, near_key, suggestion
from tactile_cube.errors import InputError

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
DENIED = (errno.EACCES, errno.EPERM, errno.EROFS, errno.EEXIST, errno.ENOTDIR)
CHOOSING = "defaults_list.py"
"""Where Hydra fails at `task=1` (a ValueError) and `task=[1]` (a TypeError), with errors that are none of its own."""


def usage_error(error: BaseException) -> str | None:
    """Return what the user did wrong, in one line; None if the error is none of the user's."""
    from hydra.errors import HydraException
    from omegaconf.errors import OmegaConfBaseException
    from pydantic import ValidationError

    causes = list(_causes(error))
    for kinds in (InputError, ValidationError, (HydraException, OmegaConfBaseException)):
        for cause in causes:
            if isinstance(cause, kinds):
                return _one_line(cause)
    for cause in causes:
        if isinstance(cause, OSError) and cause.errno in FULL:
            where = cause.filename or "output"
            return f"{where}: the disk is full; free some of it, or write elsewhere with hydra.run.dir=DIR"
        if isinstance(cause, OSError) and cause.errno in DENIED and cause.filename:
            return f"{cause.filename}: {cause.strerror}; choose another place"
        frames = traceback.extract_tb(cause.__traceback__)
        if isinstance(cause, TypeError | ValueError) and frames and frames[-1].filename.endswith(CHOOSING):
            return f"a choice from a group of conf/ is the name of a file there, e.g. task=table: {_flat(cause)}"
    return None


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    """Yield an error and its causes; Hydra's may cause each other in a circle."""
    known = set[int]()
    while error is not None and id(error) not in known:
        known.add(id(error))
        yield error
        error = error.__cause__ or error.__context__


def _one_line(error: BaseException) -> str:
    from hydra.errors import InstantiationException, MissingConfigException, OverrideParseException
    from omegaconf.errors import MissingMandatoryValue, OmegaConfBaseException
    from pydantic import ValidationError

    cause = error.__cause__ or error.__context__
    if key := re.match(r"Could not override '([^']+)'.\s*To append to your config", str(error)):
        asked = max(key[1], str(getattr(cause, "full_key", "")), key=len)
        return f"{asked}: no such setting{near_key(asked) or '; --help lists them'}"
    if isinstance(error, OverrideParseException):
        said = _flat(error).partition(" See http")[0]
        return f"{said}: quote what has brackets, colons or blanks, 'effects=[\"backlash@q2: play=0.05\"]'"
    if isinstance(error, MissingMandatoryValue):
        return f"{error.full_key}=... is missing{meaning(str(error.full_key))}"
    if isinstance(error, ValidationError):
        return "; ".join(_described(error.title, dict(entry)) for entry in error.errors())
    if isinstance(error, MissingConfigException) and error.missing_cfg_file:
        group, _, option = error.missing_cfg_file.rpartition("/")
        return _flat(error) + suggestion(option, map(str, error.options or ()), f"{group}=")
    if isinstance(error, InstantiationException) and isinstance(cause, TypeError):
        return f"{_flat(error)}; if it was set for another choice of the group, ~GROUP.KEY takes it out"
    return _flat(error) + (near_key(str(cause.full_key)) if isinstance(cause, OmegaConfBaseException) else "")


def _flat(error: BaseException) -> str:
    # Hydra appends where it searched, which nobody asked for
    return " ".join(str(error).partition("Config search path:")[0].split()) or type(error).__name__


def _described(title: str, entry: dict[str, Any]) -> str:
    group = title.removesuffix("Settings").lower()
    prefix = [] if group == "run" else [group]  # the run's own settings stand at the top
    key = ".".join([*prefix, *(str(part) for part in entry["loc"])])
    message = str(entry["msg"]).removeprefix("Value error, ")
    if entry["type"] == "extra_forbidden":
        return f"{key}: no such setting{near_key(key)}"
    return f"{key}={entry['input']}: {message}" if entry["loc"] else f"{group}: {message}"
