"""Dry friction of a joint."""

from dataclasses import replace
from math import exp, inf
from typing import ClassVar

from tactile_cube.drivetrain import signals as sig
from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Scales, Simpler, Stage


class CoulombFriction(Effect):
    """Dry friction of constant size.

    F += friction against the motion, at any speed; the joint sticks under a smaller torque.

    In data: a step in the torque at every reversal, whatever the speed.
    Confused with: `command_dead_zone`; `viscous_friction` at a single speed.
    Source: Olsson et al., Friction models and friction compensation, 1998.
    """

    name = "coulomb_friction"
    stage = Stage.FRICTION
    parameters = (Parameter("friction", "N m", 0.0, 0.0, 0.5, 0.03, "0.01-0.1 N m, 2-10 % of the rating"),)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        return x[sig.FRICTION, j] + p[0]


class StribeckFriction(Effect):
    """Dry friction that is larger at standstill and falls with the speed (stiction).

    F += excess * exp(-|v / velocity|^exponent).

    In data: spikes after standstill; small motion falls short of its command.
    Confused with: `backlash` and `elasticity` in motion of one amplitude.
    Source: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994), who report exponents of 0.5 to 2.
    """

    name = "stribeck_friction"
    stage = Stage.FRICTION
    contains: ClassVar[Simpler] = {"coulomb_friction": {"velocity": inf}}
    parameters = (
        Parameter("excess", "N m", 0.0, 0.0, 0.5, 0.04, "+10-50 % of the Coulomb friction"),
        Parameter("velocity", "rad/s", 0.15, 0.01, 3.0, 0.15, "0.05-0.3 rad/s"),
        Parameter("exponent", "1", 2.0, 0.3, 4.0, 2.0, "0.5-2", scale=0.5),
    )

    forms = ({"excess": 0.04, "velocity": 0.15},)
    details = ("exponent",)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        speed = abs(x[sig.VELOCITY, j] / p[1])
        return x[sig.FRICTION, j] + p[0] * exp(-(speed * speed if p[2] == 2.0 else speed ** p[2]))


class LoadDependentFriction(Effect):
    """Dry friction that grows with the transmitted torque.

    F += coefficient * |tau|, tau the torque of the motor.

    In data: steps at reversals that grow with the load.
    Confused with: `torque_gain` where the motor drives the motion under one load; lifting and lowering separate them.
    Source: Duclos et al., BAM: extended friction models for servo actuators, 2025 (models M3-M6).
    """

    name = "load_dependent_friction"
    stage = Stage.FRICTION
    parameters = (
        Parameter("coefficient", "1", 0.0, 0.0, 0.9, 0.1, "0.07-0.3 for small gears"),
    )  # at 1 a gear holds any load

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        return x[sig.FRICTION, j] + p[0] * abs(x[sig.TORQUE, j])


class AsymmetricFriction(Effect):
    """Dry friction that differs between the two directions of motion.

    F(+v) - F(-v) = difference; the mean of both is `friction` above the nominal friction. A `ratio` r multiplies all
    dry friction, also that of other effects, by 1 + r in the positive and 1 - r in the negative direction.

    In data: steps at reversals that are not symmetric about zero torque.
    Confused with: `torque_bias` while the joint moves; `payload` in one configuration.
    Source: Olsson et al., Friction models and friction compensation, 1998.
    """

    name = "asymmetric_friction"
    stage = Stage.FRICTION
    contains: ClassVar[Simpler] = {"coulomb_friction": {"difference": 0.0, "ratio": 0.0}}
    parameters = (
        Parameter("difference", "N m", 0.0, -0.3, 0.3, 0.02, "5-30 % of the dry friction; more with worn gears"),
        Parameter("ratio", unit="1", neutral=0.0, low=-0.9, high=0.9, typical=0.0, source="5-30 %"),
        Parameter("friction", unit="N m", neutral=0.0, low=-0.1, high=0.5, typical=0.0, source="worn or dry gears"),
    )
    forms = ({"difference": 0.02}, {"difference": 0.02, "friction": 0.02}, {"ratio": 0.2, "friction": 0.02})

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        return (x[sig.FRICTION, j] + p[2] + 0.5 * p[0] * x[sig.DIRECTION, j]) * (1.0 + p[1] * x[sig.DIRECTION, j])


class FrictionDrift(Effect):
    """Dry friction that changes while the joint warms up.

    F += friction + change * (1 - exp(-t / time_constant)), t from the start of the robot's initialisation where time
    stamps go on from trial to trial, else of each trial. The longest time constant stands for a change proportional to
    time. Short recordings cannot separate the two numbers then: only change / time_constant counts, and `change` may be
    far larger than any change in the recording.

    In data: a trend over time in the same repeated motion.
    Confused with: `coulomb_friction` in a single short trial.
    Source: Bittencourt and Axelsson, Modeling and experiment design for temperature effects of joint friction, 2014.
    """

    name = "friction_drift"
    stage = Stage.FRICTION
    contains: ClassVar[Simpler] = {"coulomb_friction": {"change": 0.0}}
    parameters = (
        Parameter("change", unit="N m", neutral=0.0, low=-5.0, high=5.0, typical=0.02, source="-20 to -50 % over 20 K"),
        Parameter("time_constant", "s", 200.0, 0.5, 200.0, 5.0, "seconds (lubricant) to minutes (housing)"),
        Parameter("friction", unit="N m", neutral=0.0, low=-0.1, high=0.5, typical=0.0, source="cold, beyond nominal"),
    )

    forms = ({"change": 0.02, "time_constant": 5.0}, {"change": -0.02, "time_constant": 5.0, "friction": 0.04})
    details = ("friction",)

    @classmethod
    def parameters_at(cls, scales: Scales) -> dict[str, Parameter]:
        """Return the parameters; a time constant may be as long as the recording."""
        known = super().parameters_at(scales)
        slowest = max(known["time_constant"].high, scales.lasts)
        return known | {"time_constant": replace(known["time_constant"], high=slowest, neutral=slowest)}

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return the forms, and the same as slow as a recording is long that goes on over several trials."""
        known = super().starts_at(scales)
        slow = scales.lasts / 3.0
        return known + [{**form, "time_constant": slow} for form in known if slow > 2.0 * form["time_constant"]]

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        if p[0] == 0.0 and p[2] == 0.0:
            return x[sig.FRICTION, j]
        return max(x[sig.FRICTION, j] + p[2] + p[0] * (1.0 - exp(-x[sig.TIME, 0] / p[1])), 0.0)


FOLLOWED = 5.0  # steps of unseen motion, as long as the present one, that bristles have followed
TINY = 1e-12  # [N m]


class PreslidingFriction(Effect):
    """Dry friction on bristles, which act as a spring before the joint slides (Dahl, LuGre).

    z' = v / breakaway * (1 - z sgn v) is the bristles' deflection, -1 to 1; their torque is -(limit + excess) * z -
    micro_damping * breakaway * z'. It replaces rigid dry friction with its limit: the joint creeps elastically below
    break-away, with hysteresis between position and torque. Damped bristles (LuGre) add drag where the motion turns
    round, and none while it slides.

    In data: closed loops of torque over position in small motion, the same at any speed.
    Confused with: `elasticity` and `backlash` in motion of one amplitude.
    Source: Dahl, A solid friction model, 1968; Canudas de Wit et al., A new model for control of systems with friction,
    1995 (without their Stribeck curve).
    """

    name = "presliding_friction"
    stage = Stage.FRICTION
    contains: ClassVar[Simpler] = {"coulomb_friction": {"breakaway": 0.0}}
    parameters = (
        Parameter("breakaway", unit="rad", neutral=0.0, low=0.0, high=0.1, typical=0.003, source="0.05 mrad to 1 deg"),
        Parameter("excess", "N m", 0.0, -0.05, 0.5, 0.0, "friction beyond the nominal static friction"),
        Parameter("micro_damping", "N m s/rad", 0.0, 0.0, 2.0, 0.0, "0.5-1 of critical damping on the bristles"),
    )

    forms = (
        {"breakaway": 0.003},
        {"breakaway": 0.003, "excess": 0.02},
        {"breakaway": 0.003, "excess": 0.02, "micro_damping": 0.1},
    )

    state_size = 2  # the bristle deflection z, -1 to 1; whether it is still to be found from the torques of the step

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the rigid friction limit that remains [N m]; add the bristles' torque to the joint torque.

        Bristles whose past is not known hold a joint at rest where it is; one that moves they follow.
        """
        if p[0] <= 0.0:
            return x[sig.FRICTION, j] + p[1]
        limit = max(x[sig.FRICTION, j] + p[1], 0.0)
        direction = 1.0 if x[sig.VELOCITY, j] >= 0.0 else -1.0
        if s[1] > 0.0:
            s[1] = 0.0
            balance = (x[sig.TORQUE, j] + x[sig.JOINT_TORQUE, j] - x[sig.LOAD, j]) / max(limit, TINY)
            balance = min(max(balance, -1.0), 1.0)
            s[0] = direction + (balance - direction) * exp(-abs(x[sig.VELOCITY, j]) * FOLLOWED * dt / p[0])
        s[0] = direction + (s[0] - direction) * exp(-abs(x[sig.VELOCITY, j]) * dt / p[0])
        drag = p[2] * (1.0 - direction * s[0])
        x[sig.DAMPING, j] += drag
        x[sig.JOINT_TORQUE, j] -= limit * s[0] + drag * x[sig.VELOCITY, j]
        return 0.0
