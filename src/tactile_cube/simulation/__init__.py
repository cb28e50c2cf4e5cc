"""The world in PyBullet or MuJoCo: bodies, 500 Hz steps, contacts, every constant of an episode in one dataclass."""

import tactile_cube.simulation.quiet_engine  # noqa: F401  # isort: skip (before whatever imports pybullet)

from tactile_cube.simulation.constants import EpisodeConstants, Start, constants_of
from tactile_cube.simulation.contact import Contact
from tactile_cube.simulation.options import SimulationOptions
from tactile_cube.simulation.rig import RigWorld
from tactile_cube.simulation.world import World

__all__ = ["Contact", "EpisodeConstants", "RigWorld", "SimulationOptions", "Start", "World", "constants_of"]
