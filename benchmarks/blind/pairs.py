"""Effects at two joints at once, and effects that a joint alone cannot tell from another.

| worlds | hidden | right answer |
|---|---|---|
| pairs | something late or lost in one joint's command, friction at another joint | exactly both |
| twins | payload, torque gain, tilted mount or wrong zero of an arm with one joint | a set with its twin |

An arm of one joint bears a payload as it would a weaker motor once its friction and inertia are fitted, and a wrong
zero is a mount's tilt. Its log reads positions up to half a row before or after the row's end. The true name alone is
acceptable, the twin's alone wrong.
"""

from dataclasses import replace

import numpy as np

from benchmarks.blind.logs import ACROSS
from benchmarks.blind.sizes import draw_machine
from benchmarks.blind.worlds import Bench, World, draw_usual

COMMAND = ("command_delay", "rate_limit", "velocity_filter_lag", "actuator_lag", "command_dead_zone")
FRICTION = (
    "stribeck_friction", "load_dependent_friction", "presliding_friction", "friction_drift", "asymmetric_friction",
    "viscous_friction",
)  # fmt: skip
TWINS = {
    "payload": ("torque_gain",),
    "torque_gain": ("payload", "gravity_compensation"),
    "mount_tilt": ("position_offset",),
    "position_offset": ("mount_tilt",),
}
"""Each hidden effect, and the names of which one at least belongs beside it."""


def draw_pair(
    rng: np.random.Generator, chosen: list[str], seconds: float | None, kind: str | None
) -> tuple[World, Bench, bool]:
    """A usual rig of several joints, its bench, and whether its excitation is poor."""
    return draw_usual(rng, chosen, seconds, kind or str(rng.choice(["finger", "finger", "two_link"])))


def draw_twin(
    rng: np.random.Generator, chosen: list[str], seconds: float | None, kind: str | None
) -> tuple[World, Bench, bool]:
    """An arm of one joint that feels its weight, how it is logged, and whether its excitation is poor."""
    while True:
        world, bench, poor = draw_machine(rng, chosen, seconds, kind or "turning")
        links = world.rig.links
        if len(links) == 1 and abs(np.dot(world.rig.gravity, links[0].axis)) < ACROSS:
            return world, replace(bench, skew=float(rng.uniform(-0.5, 0.5))), poor
