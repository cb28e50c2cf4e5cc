"""Logs and controllers as strangers have them: parts of a controller that its owner does not state, poor logs.

Every log reads its positions up to half a row before or after the end of the row, one number a machine, and begins
some seconds after its controller was switched on. Ten turns hide:

| turn | hidden | right answer |
|---|---|---|
| nothing | the reading's skew alone | `adequate` |
| late_command | commands are logged some rows late: positions move before them | `adequate` |
| outliers | one reading in a thousand is off by 3 degrees of a finger | `adequate` |
| integral_action, clamped_integral_action | the controller integrates its error, up to a limit | `integral_action` |
| velocity_feedforward | a torque in proportion to the command's speed | `velocity_feedforward` |
| gravity_compensation | every joint's controller carries part of its weight | `gravity_compensation`, or a set; below |
| mount_tilt | gravity has another direction than stated | `mount_tilt`, or a set; below |
| back_emf | the supply's voltage limits torque and speed together | `back_emf` |
| hobby_servo | backlash, Stribeck friction and a late command at one joint | exactly these three |

A late command is the log's fault and no effect, as the skew is. Where a twin predicts the same for any command, TWINS
says so, and a set that holds both names is right; the true name alone is acceptable, the twin's alone wrong.

Seeds below 1000 are for development; a round begins above all that `docs/results/rounds.md` lists.
"""

from dataclasses import replace

import numpy as np

from benchmarks.blind.hidden import Maker, Scene, Truth, _put
from benchmarks.blind.worlds import Bench, World, draw_usual

LATE = 0.02
"""Most that a command is logged late [s]."""
ACROSS = 8.0
"""Gravity along a joint's axis above which the joint hardly feels its weight [m/s^2]."""
SWITCHED_ON = (2.0, 5.0)
"""How long before a log its controller was switched on [s]."""
OUTLIERS, OFF = 1e-3, 0.05
"""Share of readings that are nonsense, and by how much of a finger's angle [rad]."""


def integral_action(s: Scene, i: int) -> Truth:
    """The controller integrates its error, within 0.3 to 2 s to as much as its stiffness."""
    time = s.size(0.3, 2.0) * s.lag(i)
    return {"ki": _put(s.plant.integral, i, float(s.plant.kp[i]) / time)}


def clamped_integral_action(s: Scene, i: int) -> Truth:
    """The same within a part of the motion's largest torque."""
    limit = _put(s.plant.integral_limit, i, float(s.peak_torque[i] * s.rng.uniform(0.15, 0.4)))
    return {**integral_action(s, i), "limit": limit}


def velocity_feedforward(s: Scene, i: int) -> Truth:
    """A torque in proportion to the speed of the command, up to what damps the joint."""
    return {"gain": _put(s.plant.feedforward, i, float(s.plant.kd[i]) * s.size(0.2, 1.0))}


def gravity_compensation(s: Scene, i: int) -> Truth:
    """Every joint's controller carries the same part of the weight that the description gives its links."""
    s.plant.compensation[:] = s.size(0.3, 1.0)
    return {"share": float(s.plant.compensation[i])}


def mount_tilt(s: Scene, i: int) -> Truth:
    """The base is turned about an axis across gravity."""
    down = np.array(s.rig.gravity) / np.linalg.norm(s.rig.gravity)
    axis = np.cross(down, s.rng.normal(size=3))
    angle = np.deg2rad(s.size(3.0, 15.0))
    across = np.cross(axis / np.linalg.norm(axis), down)
    x, y, z = (9.81 * (np.cos(angle) * down + np.sin(angle) * across)).tolist()
    s.rig.felt = (x, y, z)
    return {"angle": float(angle), "gravity": [x, y, z]}


def back_emf(s: Scene, i: int) -> Truth:
    """The motor's torque falls to nothing at its no-load speed."""
    stall = _put(s.plant.stall, i, float(s.peak_torque[i] * s.rng.uniform(0.6, 1.2)))
    speed = float(s.peak_command_speed[i] * s.rng.uniform(0.5, 1.0) * (1 - 0.5 * s.strength))
    return {"stall": stall, "no_load": _put(s.plant.no_load, i, speed)}


MAKERS: dict[str, tuple[Maker, tuple[str, ...]]] = {
    f.__name__: (f, names)
    for f, names in (
        (integral_action, ("integral_action",)),
        (clamped_integral_action, ("integral_action",)),
        (velocity_feedforward, ("velocity_feedforward",)),
        (gravity_compensation, ("gravity_compensation",)),
        (mount_tilt, ("mount_tilt",)),
        (back_emf, ("back_emf",)),
    )
}
"""Each part of a controller or a mount, and the catalogue's name that is right for it."""
WHOLE_RIG = ("mount_tilt",)
EVERY_JOINT = ("gravity_compensation",)
TWINS = {"gravity_compensation": ("payload",), "mount_tilt": ("position_offset",)}
"""Names that predict the same where one joint alone moves."""
LOG_FAULTS = ("late_command", "outliers")
TURNS: dict[str, tuple[str, ...]] = {
    "nothing": (),
    **{name: (name,) for name in (*LOG_FAULTS, *MAKERS)},
    "hobby_servo": ("backlash", "stribeck_friction", "command_delay"),
}
"""What the seeds hide, in turn."""


def draw_log(
    rng: np.random.Generator, chosen: list[str], seconds: float | None, kind: str | None
) -> tuple[World, Bench, bool]:
    """A usual rig, and how a stranger logs it."""
    weighed = {"gravity_compensation", "mount_tilt"} & set(chosen)
    while True:
        world, bench, poor = draw_usual(rng, [], seconds, kind)
        if not weighed or any(abs(np.dot(world.rig.gravity, x.axis)) < ACROSS for x in world.rig.links):
            break
    late = int(rng.integers(1, max(2, round(LATE * bench.rate) + 1))) if "late_command" in chosen else 0
    outliers = OUTLIERS if "outliers" in chosen else 0.0
    skew, settle = float(rng.uniform(-0.5, 0.5)), float(rng.uniform(*SWITCHED_ON))
    return world, replace(bench, settle=settle, skew=skew, late=late, outliers=outliers), poor
