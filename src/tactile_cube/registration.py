"""What `gymnasium.make("tactile_cube/Rotation-v0")` calls."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tactile_cube.api.input_errors import as_input_errors

if TYPE_CHECKING:
    from tactile_cube.gymnasium_env import GymnasiumRotation


@as_input_errors
def make_rotation(
    task: str = "table",
    reward: str = "early",
    randomization: str = "paper",
    start: str = "wide_yaw",
    engine: str = "bullet",
    hand: str = "dlr_hand2",
    object: str = "box",
    overrides: tuple[str, ...] = (),
    render_mode: str | None = None,
) -> GymnasiumRotation:
    """Return the environment of the named options of `conf/`.

    Args:
        task: option of the group of that name.
        reward: option of the group of that name.
        randomization: option of the group of that name.
        start: option of the group of that name.
        engine: "bullet" or "mujoco".
        hand: option of the group of that name.
        object: option of the group of that name.
        overrides: further settings as on the command line, e.g. "task.filter_time=0.25".
        render_mode: "rgb_array", or None for no pictures.

    Raises:
        InputError: an option that there is not.
    """
    from hydra.utils import instantiate

    from tactile_cube.composition import composed
    from tactile_cube.gymnasium_env import GymnasiumRotation

    groups = {
        "hand": hand,
        "object": object,
        "task": task,
        "reward": reward,
        "randomization": randomization,
        "start": start,
    }
    groups |= {"exploration": "none", "curriculum": "none", "env": "rotation"}
    chosen = [f"+{group}={option}" for group, option in groups.items()]
    config = composed(None, [*chosen, "+model=null", f"+engine={engine}", *overrides])
    return GymnasiumRotation(instantiate(config.env), render_mode)
