"""Search for stable grasps from a program: what `start=grasps` begins with."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tactile_cube.api.environment import env_config
from tactile_cube.api.input_errors import as_input_errors

if TYPE_CHECKING:
    from tactile_cube.randomization import Grasps


@as_input_errors
def search_grasps(*settings: str, grasps: int = 2000, seed: int = 0) -> Grasps:
    """Search for grasps that hold the object by themselves; no gait and no policy takes part.

    Fingertips are put at random places and close; what still holds the object at full weight is kept.

    Args:
        settings: choices and values as on the command line, e.g. "hand=three_finger", "object=cylinder".
        grasps: how many to find.
        seed: of everything random.

    Raises:
        InputError: a value that cannot be used, or a hundred times as many tries find fewer.

    Example:
        >>> tactile_cube.search_grasps("object=cylinder").save(Path("grasps.npz"))  # then start=grasps start.file=...
    """
    from tactile_cube.agent.policy_file import current_commit
    from tactile_cube.evaluation.grasp_search import GraspSearch, search_grasps
    from tactile_cube.simulation import World

    config = env_config(*settings)
    found = search_grasps(World(config.hand, config.simulation), config.constants, GraspSearch(), grasps, seed)
    words = ", ".join([*map(repr, settings), f"grasps={grasps}", f"seed={seed}"])
    command = f"tactile_cube.search_grasps({words})"
    return replace(found, origin={**found.origin, "command": command, "commit": current_commit()})
