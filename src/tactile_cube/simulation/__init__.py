"""The world in PyBullet or MuJoCo: bodies, 500 Hz steps, contacts, every constant of an episode in one dataclass."""

import os
import sys


def _import_quietly() -> None:
    """Load pybullet without the line that it prints on stderr, where a user's mistake shall be the only line."""
    sys.stderr.flush()
    stderr, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        import pybullet  # noqa: F401
    finally:
        os.dup2(stderr, 2)
        os.close(stderr)
        os.close(nowhere)


_import_quietly()

from tactile_cube.simulation.constants import EpisodeConstants, Start, constants_of  # noqa: E402
from tactile_cube.simulation.engine import Contact, SimulationOptions  # noqa: E402
from tactile_cube.simulation.world import World  # noqa: E402

__all__ = ["Contact", "EpisodeConstants", "SimulationOptions", "Start", "World", "constants_of"]
