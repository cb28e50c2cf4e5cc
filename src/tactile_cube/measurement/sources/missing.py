"""The settings of a source that the user has to give, and what they are."""

import re

from omegaconf import DictConfig, OmegaConf

from tactile_cube.command_help import CONFIG
from tactile_cube.errors import InputError


def require_settings(source: DictConfig, option: str) -> None:
    """Refuse a source without its mandatory settings, naming all of them and what its file says of each.

    Raises:
        InputError: some are missing.
    """
    missing = sorted(OmegaConf.missing_keys(source))
    if missing:
        text = (CONFIG / "source" / f"{option}.yaml").read_text(encoding="utf-8")
        said = [f"{key}={_meaning(key, text)}" for key in missing]
        raise InputError(f"source={option} needs {'; '.join(said)}")


def _meaning(key: str, text: str) -> str:
    """What stands behind a key in its file."""
    found = re.search(rf"^ *{key.rpartition('.')[2]}: \?\?\? *(?:# *(.*))?$", text, re.MULTILINE)
    said = found.group(1) if found else None
    return f"... ({said})" if said else "..."
