"""Sizes of a joint, from which bounds, typical values and starts of an effect's parameters follow."""

import re
from dataclasses import dataclass
from math import inf

UNITS = re.compile(r"(N m|N|rad|kg|m|s|Hz)(?:\^(\d))?")
MORE_PERIODS = 3.0  # a sliding joint has this many times the periods of a turning one
FINGER_RANGE = 1.2  # [rad] of a finger's joint; corresponds to the range of a joint that slides


@dataclass(frozen=True)
class Scales:
    """Sizes of one joint; of a joint that slides in m, N and kg instead of rad, N m and kg m^2.

    Attributes:
        torque: usual torque of the drive, exceeded in a tenth of the samples [N m].
        often: torque exceeded in half of the samples [N m].
        seldom: largest torque but for a few samples [N m].
        low: lowest position, without a few samples [rad].
        high: highest [rad].
        speed: largest speed of the joint, without a few samples [rad/s].
        command_speed: largest speed of the command, without a few samples [rad/s].
        inertia: at the mean posture, rotor included [kg m^2].
        mass: of all links that the joint moves [kg].
        lever: radius of gyration of these links about the joint [m].
        time: the time that corresponds to 1 s of a finger, a power of ten [s].
        slides: whether the joint is prismatic.
        neighbours: number of other joints of the rig.
        leads: whether another joint follows this one.
        first: whether it is the first joint of the rig.
        torque_limit: stated limit of the controller [N m]; infinite without one.
        lower: stated lower end of the joint [rad]; infinite without one.
        upper: stated upper end [rad].
        lasts: time from the start of an initialisation to the end of its last trial [s].
    """

    torque: float
    often: float
    seldom: float
    low: float
    high: float
    speed: float
    command_speed: float
    inertia: float
    mass: float
    lever: float
    time: float
    slides: bool = False
    neighbours: int = 0
    leads: bool = False
    first: bool = True
    torque_limit: float = inf
    lower: float = -inf
    upper: float = inf
    lasts: float = 0.0

    @property
    def span(self) -> float:
        """Range of motion [rad]."""
        return self.high - self.low

    @property
    def position(self) -> float:
        """What 1 rad of a finger's joint corresponds to: 1 rad, or for a joint that slides a part of its range [m]."""
        return self.span / FINGER_RANGE if self.slides else 1.0

    def of(self, unit: str) -> float:
        """Return how many times larger a number of a unit (`N m s/rad`) is at this joint than at a finger's.

        Torques, positions and speeds scale with those of the recording; inertias, masses and lengths with those of the
        rig. Times scale in powers of ten. Units other than these (K, V) do not scale.
        """
        plain = {"kg m^2": self.inertia / FINGER.inertia, "kg": self.mass / FINGER.mass, "s": self.time / FINGER.time}
        plain |= {"m": self.lever / FINGER.lever, "1": 1.0}
        if unit in plain:
            return plain[unit]
        if unit == "1/rad" and self.slides:
            return MORE_PERIODS / self.position
        speed = self.speed / FINGER.speed
        sizes = {"N m": self.torque / FINGER.torque, "rad": self.position, "s": self.position / speed}
        sizes |= {"N": sizes["N m"], "m": sizes["rad"], "kg": self.mass / FINGER.mass, "Hz": 1.0 / plain["s"]}
        above, _, below = unit.partition("/")
        factor = 1.0
        for text, sign in ((above, 1), (below, -1)):
            for name, power in UNITS.findall(text):
                factor *= sizes[name] ** (sign * int(power or 1))
        return factor


FINGER = Scales(
    torque=0.15,
    often=0.06,
    seldom=0.7,
    low=0.0,
    high=FINGER_RANGE,
    speed=5.0,
    command_speed=7.0,
    inertia=0.005,
    mass=0.18,
    lever=0.08,
    time=1.0,
    neighbours=2,
)
"""Sizes of the joints for which the catalogue states its numbers: small geared joints of 0.02 to 1 N m."""


def unit_at(unit: str, slides: bool) -> str:
    """Return a unit as it reads at a joint: `N m s/rad` is `N s/m` at one that slides."""
    if not slides:
        return unit
    for turning, sliding in (("kg m^2", "kg"), ("(N m)", "N"), ("N m", "N"), ("rad", "m")):
        unit = unit.replace(turning, sliding)
    return unit
