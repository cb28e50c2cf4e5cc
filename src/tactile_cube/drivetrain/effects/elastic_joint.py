"""Rotor and link as two masses with a spring between them."""

from math import pi
from typing import ClassVar

from tactile_cube.compiled import compiled
from tactile_cube.drivetrain import signals as sig
from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Scales, Simpler, Stage

RESONANCES = (8.0, 16.0, 32.0)  # where a search starts at a finger [Hz], with half of the joint's inertia in the rotor
DAMPING_RATIO = 0.03


@compiled
def _push(
    x: Array, j: int, p: Array, own: float, speed: float, torque: float, pull: float, now: float, dt: float
) -> float:
    """Return the torque that would hold the rotor at rest after the step [N m].

    The link is free to follow, against the friction that is left to it; the other joints stand.
    """
    link, friction = 2.0 * (x[sig.INERTIA, j] - p[1]) / dt, (1.0 - p[4]) * x[sig.FRICTION, j]
    follows = 0.0 if pull <= 0.0 or (x[sig.VELOCITY, j] == 0.0 and friction > 0.0) else pull / (link + pull)
    held = x[sig.LOAD, j] - x[sig.JOINT_TORQUE, j] + (friction if x[sig.VELOCITY, j] > 0.0 else -friction)
    carried = follows * (link * x[sig.VELOCITY, j] + now - held)
    return own * speed + torque - now + carried - 0.5 * (own + (1.0 - follows) * pull) * speed


class ElasticJoint(Effect):
    """Rotor that a spring connects with the link; controller and sensor see the rotor.

    rotor th'' = tau - s - motor_damping th' - F_m, M_link q'' + h = s - F_l, s = (th - q) / compliance + damping
    (th' - q'), of th - q what is beyond half of `gap`. The rotor is a part of the joint's stated inertia. Of its dry
    friction the part `motor_share` is the rotor's, F_m, and the rest the link's, F_l; only the bristles of
    `presliding_friction` stay with the link. At the start the gap is closed on the side of the load.

    In data: a resonance at sqrt((1 / rotor + 1 / M_link) / compliance) in what the motor's sensor shows. A rotor that
    sticks hides it while the link swings on; a link that sticks lets the rotor swing alone.
    Confused with: `elasticity` far below the resonance, where the share of friction is unseen too; `actuator_lag`. Its
    gap with `backlash`, the rotor's damping with `viscous_friction` and the controller's K_D.
    Source: Spong, Modeling and control of elastic joint robots, 1987; the gap: Nordin and Gutman, Controlling
    mechanical systems with backlash, 2002.
    """

    name = "elastic_joint"
    stage = Stage.VELOCITY_SENSOR
    contains: ClassVar[Simpler] = {"elasticity": {"rotor": 0.0}}
    parameters = (
        Parameter("compliance", "rad/(N m)", 0.0, 0.0, 1.0, 0.05, "5-50 N m/rad"),
        Parameter("rotor", "kg m^2", 0.0, 0.0, 0.0049, 0.0025, "gears are chosen for a rotor like the load"),
        Parameter("damping", "N m s/rad", 0.0, 0.0, 0.2, 0.01, "2-5 % of critical"),
        Parameter("gap", "rad", 0.0, 0.0, 0.15, 0.0, "0.1-1 deg", scale=0.005),
        Parameter("motor_share", "1", 0.0, 0.0, 1.0, 0.0, "most of it where a gear slows the link down", scale=0.2),
        Parameter("motor_damping", "N m s/rad", 0.0, 0.0, 1.0, 0.0, "0.004-0.3 N m s/rad in geared joints", scale=0.01),
    )

    forms = ({"compliance": 0.05, "rotor": 0.0025, "damping": 0.01},)
    details = ("gap", "motor_share", "motor_damping")

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

    state_size = 6  # th - q, th' - q', first-call flag, last q', rotor's mean speed at a resting link, its slope

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the rotor's speed [rad/s]; the last step is completed, now that the link's motion is known.

        Relative angle and speed are kept: a simulation that is started anew moves rotor and link together.
        """
        if p[0] <= 0.0:
            return x[sig.MEASURED_VELOCITY, j]
        if s[2] == 0.0:
            s[2] = 1.0
            s[0] = p[0] * x[sig.LOAD, j]
            if p[3] > 0.0 and x[sig.LOAD, j] != 0.0:
                s[0] += 0.5 * p[3] if x[sig.LOAD, j] > 0.0 else -0.5 * p[3]
        else:
            change = dt * x[sig.ACCELERATION, j]
            mean = s[4] + s[5] * (s[3] + 0.5 * change)
            s[1] = 2.0 * (mean - s[3]) - s[1] - change
            s[0] += dt * s[1]
        s[3] = x[sig.VELOCITY, j]
        x[sig.SENSOR_VELOCITY, j] += s[1]
        x[sig.MOTOR_SHARE, j] = p[4]
        return x[sig.MEASURED_VELOCITY, j] + s[1]

    @staticmethod
    def ahead_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the rotor's angle [rad]."""
        return x[sig.MOTOR_POSITION, j] + s[0]

    @staticmethod
    def torque_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the spring's torque on the link [N m].

        Newmark's mean over three steps for the spring, at the mean speeds of rotor and link: stable at any stiffness,
        exact in the limit of a rigid joint. The link's speed is found later: DAMPING is what the spring makes of it,
        less the rotor's inertia, which the spring takes off the joint's.
        """
        if p[0] <= 0.0:
            return x[sig.TORQUE, j]
        spring, damping, beyond = 1.0 / p[0], p[2], s[0]
        if p[3] > 0.0:
            beyond -= min(max(s[0], -0.5 * p[3]), 0.5 * p[3])
            if beyond == 0.0:
                spring = damping = 0.0
        inertia, speed = 2.0 * p[1] / dt, x[sig.VELOCITY, j] + s[1]
        own, pull = inertia + x[sig.DAMPING, j] + p[5], 0.5 * dt * spring + damping
        now = spring * (beyond - 0.5 * dt * s[1])
        torque, most = x[sig.TORQUE, j] - p[5] * speed, p[4] * max(x[sig.FRICTION, j], 0.0)
        if most > 0.0:
            push = _push(x, j, p, own, speed, torque, pull, now, dt)
            if abs(push) <= most:
                s[4], s[5] = 0.5 * speed, 0.0
                x[sig.DAMPING, j] = pull - inertia
                return now + pull * (s[4] - x[sig.VELOCITY, j])
            torque -= most if push > 0.0 else -most
        s[5] = pull / (own + pull) if own + pull > 0.0 else 0.0
        s[4] = (own * speed + torque - now) / (own + pull) if own + pull > 0.0 else 0.0
        x[sig.DAMPING, j] = own * s[5] - inertia
        return now + pull * s[4] - own * s[5] * x[sig.VELOCITY, j]
