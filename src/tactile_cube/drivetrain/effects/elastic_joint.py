"""A rotor and a link with a spring between them: elasticity with its resonance."""

from math import pi

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import (
    ACCELERATION,
    DAMPING,
    LOAD,
    MEASURED_VELOCITY,
    MOTOR_POSITION,
    SENSOR_VELOCITY,
    TORQUE,
    VELOCITY,
)

RESONANCES = (8.0, 16.0, 32.0)
"""Where a search starts at a finger [Hz], with half of the joint's inertia in the rotor."""
DAMPING_RATIO = 0.03


class ElasticJoint(Effect):
    """Rotor that a spring connects with the link; controller and sensor see the rotor.

    rotor th'' = tau - s, M_link q'' + h = s, s = (th - q) / compliance + damping (th' - q'), of th - q what is beyond
    half of `gap`. The rotor is a part of the joint's stated inertia. Dry friction acts on the link.

    In data: a resonance at sqrt((1 / rotor + 1 / M_link) / compliance) in what the motor's sensor shows.
    Confused with: `elasticity` far below the resonance, `actuator_lag`.
    Source: Spong, Modeling and control of elastic joint robots, 1987.
    """

    name = "elastic_joint"
    stage = Stage.VELOCITY_SENSOR
    contains = ("elasticity",)
    parameters = (
        Parameter("compliance", "rad/(N m)", 0.0, 0.0, 1.0, 0.05, "5-50 N m/rad"),
        Parameter("rotor", "kg m^2", 0.0, 0.0, 0.0049, 0.0025, "gears are chosen for a rotor like the load"),
        Parameter("damping", "N m s/rad", 0.0, 0.0, 0.2, 0.01, "2-5 % of critical"),
        Parameter("gap", "rad", 0.0, 0.0, 0.15, 0.0, "0.1-1 deg", scale=0.005),
    )

    forms = ({"compliance": 0.05, "rotor": 0.0025, "damping": 0.01},)
    details = ("gap",)

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return springs with the resonances of `RESONANCES` at this joint's inertia."""
        found = []
        for resonance in RESONANCES:
            fast = 2.0 * pi * resonance / scales.time
            spring = fast * fast * 0.25 * scales.inertia
            damping = 2.0 * DAMPING_RATIO * spring / fast
            found.append({"compliance": 1.0 / spring, "rotor": 0.5 * scales.inertia, "damping": damping})
        return found

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Return 6: th - q, th' - q', first-call flag, last q', rotor's mean speed at a resting link, its slope."""
        return 6

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the rotor's speed [rad/s]; the last step is completed, now that the link's motion is known.

        Relative angle and speed are kept: a simulation that is started anew moves rotor and link together.
        """
        if p[0] <= 0.0:
            return x[MEASURED_VELOCITY, j]
        if s[2] == 0.0:
            s[2] = 1.0
            s[0] = p[0] * x[LOAD, j]
        else:
            change = dt * x[ACCELERATION, j]
            mean = s[4] + s[5] * (s[3] + 0.5 * change)
            s[1] = 2.0 * (mean - s[3]) - s[1] - change
            s[0] += dt * s[1]
        s[3] = x[VELOCITY, j]
        x[SENSOR_VELOCITY, j] += s[1]
        return x[MEASURED_VELOCITY, j] + s[1]

    @staticmethod
    def ahead_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the rotor's angle [rad]."""
        return x[MOTOR_POSITION, j] + s[0]

    @staticmethod
    def torque_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the spring's torque on the link [N m].

        Newmark's mean over three steps for the spring, at the mean speeds of rotor and link: stable at any stiffness,
        exact in the limit of a rigid joint. The link's speed is found later: DAMPING is what the spring makes of it,
        less the rotor's inertia, which the spring takes off the joint's.
        """
        if p[0] <= 0.0:
            return x[TORQUE, j]
        spring, damping, beyond = 1.0 / p[0], p[2], s[0]
        if p[3] > 0.0:
            beyond -= min(max(s[0], -0.5 * p[3]), 0.5 * p[3])
            if beyond == 0.0:
                spring = damping = 0.0
        inertia = 2.0 * p[1] / dt
        own, pull = inertia + x[DAMPING, j], 0.5 * dt * spring + damping
        now = spring * (beyond - 0.5 * dt * s[1])
        s[5] = pull / (own + pull) if own + pull > 0.0 else 0.0
        s[4] = (own * (x[VELOCITY, j] + s[1]) + x[TORQUE, j] - now) / (own + pull) if own + pull > 0.0 else 0.0
        x[DAMPING, j] = own * s[5] - inertia
        return now + pull * s[4] - own * s[5] * x[VELOCITY, j]
