"""Optional peers: other people's programs."""

from __future__ import annotations

import importlib
from types import ModuleType

INSTALL = {
    "mujoco": "pip install mujoco",
    "stable_baselines3": "pip install stable-baselines3",
    "mujoco.sysid": "pip install 'mujoco[sysid]'",
}
"""How to get each peer; all at once: pip install 'tactile-cube[benchmark]'."""


def find_peer(module: str, missing: list[str], needs: str = "") -> ModuleType | None:
    """A peer's module, or None after noting in `missing` how to install it.

    Args:
        module: of the peer.
        missing: takes the note.
        needs: an attribute that only a complete installation has.
    """
    try:
        found = importlib.import_module(module)
    except ImportError:
        found = None
    if found is None or (needs and not hasattr(found, needs)):
        missing.append(f"{module}: not installed ({INSTALL[module]})")
        return None
    return found
