"""Between motor and link, and what the sensors there report."""

from collections.abc import Mapping
from math import asinh, cos, exp, inf, sin, sinh, sqrt, tanh
from typing import ClassVar

import numpy as np

from tactile_cube.compiled import compiled
from tactile_cube.drivetrain import signals as sig
from tactile_cube.drivetrain.effects.effect import (
    Array,
    Effect,
    Parameter,
    Place,
    Scales,
    Simpler,
    Stage,
    View,
    harmonic,
)


class VelocityFilterLag(Effect):
    """Damping that acts on a filtered velocity.

    time_constant * v_f' = v - v_f: the controller's velocity passes a first-order low-pass, and a second one where
    `second` is above zero.

    In data: less damping than stated in fast motion; overshoot.
    Confused with: `command_delay` and `actuator_lag` in slow motion; a controller that computes its torque once a row,
    whose damping is half a row late.
    Source: any controller that differentiates an encoder; the filters of servo drives are of first or second order.
    """

    name = "velocity_filter_lag"
    stage = Stage.VELOCITY_SENSOR
    parameters = (
        Parameter("time_constant", unit="s", neutral=0.0, low=0.0, high=0.5, typical=0.005, source="1-30 ms"),
        Parameter("second", unit="s", neutral=0.0, low=0.0, high=0.5, typical=0.0, source="as the first, or none"),
    )

    forms = ({"time_constant": 0.005},)
    details = ("second",)

    state_size = 6  # first-call flag, last speed; for each filter its output and the share of its last input in that

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the measured velocity [rad/s], exact for an input that is linear from step to step.

        The speed of a step is that of its middle. The last step's state is moved to its end before it is used.
        """
        asked = x[sig.MEASURED_VELOCITY, j]
        if p[0] <= 0.0:
            return asked
        if s[0] == 0.0:
            s[0] = 1.0
            s[1] = asked
            s[2] = asked
            s[4] = asked
        later = 0.5 * dt * x[sig.ACCELERATION, j]
        before = s[1] + later
        s[1] = asked
        for k in range(2, 6, 2):
            time_constant = p[k // 2 - 1]
            if time_constant > 0.0:
                later *= s[k + 1]
                last = s[k] + later
                kept = exp(-dt / time_constant)
                mean = (1.0 - kept) * time_constant / dt
                x[sig.DAMPING, j] *= 1.0 - mean
                s[k] = kept * last + (mean - kept) * before + (1.0 - mean) * asked
                s[k + 1] = 1.0 - mean
                before, asked = last, s[k]
        return asked


STIFF = 0.03  # compliance of a stiffly controlled machine at which a search starts, as a part of a finger's


class Elasticity(Effect):
    """Drive that is softer than stated.

    q_m - q = tau (1 / K_e + compliance): a linear spring in series with the nominal stiffness K_e.

    In data: an error in phase with the torque; a resonance.
    Confused with: `backlash` in motion of one amplitude; `torque_gain`.
    Source: Sievers et al., ICRA 2022, eq. (2); Spong, Modeling and control of elastic joint robots, 1987.
    """

    name = "elasticity"
    stage = Stage.MECHANISM
    parameters = (Parameter("compliance", "rad/(N m)", 0.0, -0.03, 1.0, 0.05, "5-50 N m/rad"),)

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return the compliance of a finger's drive at this joint's sizes, and that of a stiffly controlled machine."""
        (form,) = cls.forms_at(scales)
        return [{"compliance": part * form["compliance"]} for part in (1.0, STIFF)]

    @staticmethod
    def configure(view: View, place: Place, p: Array) -> None:
        """Add to the drive's compliance."""
        view("compliance")[..., place.joint] += p[..., 0]


CUBIC = (0.01, 0.1, 1.0)
"""Torques at which the cubic part of the spring equals the linear one where a search starts, in usual torques."""


class StiffeningElasticity(Effect):
    """Tendon or belt that gets stiffer as it is pulled.

    tau = K d + cubic * d^3 with 1 / K = 1 / K_e + compliance, d = q_m - q.

    In data: odd harmonics; soft at small torques, stiff at large ones.
    Confused with: `elasticity` in motion of one amplitude; two preloads separate them.
    Source: Palli et al., tendon transmissions; Spong 1987 with a cubic spring.
    """

    name = "stiffening_elasticity"
    stage = Stage.DEFLECTION
    contains: ClassVar[Simpler] = {"elasticity": {"cubic": 0.0}}
    parameters = (
        Parameter("compliance", "rad/(N m)", 0.0, 0.0, 2.0, 0.1, "slack tendons: 2-20 N m/rad"),
        Parameter("cubic", "N m/rad^3", 0.0, 0.0, 1e12, 2000.0, "as large as the linear part at 0.1-50 mrad"),
    )

    forms = ({"compliance": 0.1, "cubic": 2e3},)

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return springs whose cubic part is as large as the linear one at the torques of `CUBIC`."""
        (form,) = cls.forms_at(scales)
        springs = (form["compliance"], STIFF * form["compliance"])
        return [
            {"compliance": soft, "cubic": 1.0 / (soft**3 * (part * scales.torque) ** 2)}
            for soft in springs
            for part in CUBIC
        ]

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the deflection q_m - q [rad]: the real root of cubic * d^3 + K d = tau (Cardano)."""
        torque = x[sig.TORQUE, j]
        deflection = x[sig.DEFLECTION, j] + p[0] * torque
        if p[1] <= 0.0 or torque * deflection <= 0.0:
            return deflection
        linear = torque / deflection / p[1]
        half_width = sqrt(linear / 3.0)
        return 2.0 * half_width * sinh(asinh(1.5 * torque / p[1] / (linear * half_width)) / 3.0)


class TransmissionError(Effect):
    """Position error that repeats with the turn of a gear.

    q_m += sine * sin(harmonic q) + cosine * cos(harmonic q).

    In data: a wave over the position, at any torque.
    Confused with: `cogging`, whose error depends on the stiffness of control.
    Source: Tuttle and Seering, A nonlinear model of a harmonic drive gear transmission, 1996.
    """

    name = "transmission_error"
    stage = Stage.POSITION_SENSOR
    parameters = (
        Parameter("sine", unit="rad", neutral=0.0, low=-0.02, high=0.02, typical=0.003, source="1 arcmin to 0.5 deg"),
        Parameter("cosine", unit="rad", neutral=0.0, low=-0.02, high=0.02, typical=0.0, source="1 arcmin to 0.5 deg"),
        harmonic(source="eccentric pulleys to teeth"),
    )

    forms = ({"sine": 0.003, "cosine": 0.0, "harmonic": 10.0},)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        angle = p[2] * x[sig.ANGLE, j]
        return x[sig.MOTOR_POSITION, j] + p[0] * sin(angle) + p[1] * cos(angle)


class PositionOffset(Effect):
    """Encoder whose zero is wrong by the same angle in every initialisation.

    q_m += offset.

    In data: a constant error of the position, and an error of the weight's torque like cos q.
    Confused with: the joint offset of an initialisation, `payload`, `torque_bias`.
    Source: Sievers et al., ICRA 2022: joint-angle offsets dominate the model error.
    """

    name = "position_offset"
    constant_reading = "offset"
    stage = Stage.POSITION_SENSOR
    parameters = (Parameter("offset", unit="rad", neutral=0.0, low=-0.3, high=0.3, typical=0.02, source="0.5-3 deg"),)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        return x[sig.MOTOR_POSITION, j] + p[0]


NEWTON_STEPS = 12
SHOWN = 0.5  # part of the link's motion that its sensor must show, or the link is free within its gap


def torque_behind_play(torque: Array, drop: Array, softness: Array) -> Array:
    """Return u softness with u softness + drop tanh(u) = torque: what is left when a smooth play has been crossed.

    Newton's method from below the root, where the curve bends away: it never oversteps. Numbers or arrays.
    """
    ratio, most = drop / softness, np.abs(torque) / softness
    u = np.maximum(most - ratio, most / (1.0 + ratio))
    for _ in range(NEWTON_STEPS):
        bent = np.tanh(u)
        u += (most - u - ratio * bent) / (1.0 + ratio * (1.0 - bent * bent))
    return np.sign(torque) * u * softness


def smooth_lead(torque: Array, smooth: Array | float, softness: Array | float) -> Array:
    """Return how far the motor leads in a smooth play under a torque [rad]."""
    return np.asarray(0.5 * smooth * np.tanh(torque / softness))


_torque_behind_play = compiled(torque_behind_play)


class Backlash(Effect):
    """Play between motor and link, in its three usual descriptions.

    - `play`: hysteresis of the reading. The motor encoder keeps its value until the link has moved through the gap.
    - `gap`: dead band of the spring. Within it the motor carries no torque and stands where its controller asks for
      none; on either flank it leads or lags by half a gap. Oil in the gap brings the motor 63 % of the way to that
      place in the time `crossing`, and pulls the link meanwhile.
    - `smooth`: the motor leads or lags by half of this angle as the torque changes its sign, softly over torques of
      `softness`. Seals or grease carry the motor through its gap.

    In data: a flat spot of fixed width in the position after each reversal, at any speed.
    Confused with: `elasticity` and `stribeck_friction` in motion of one amplitude; a preload removes backlash.
    Source: Nordin and Gutman, Controlling mechanical systems with backlash, 2002.
    """

    name = "backlash"
    stage = Stage.POSITION_SENSOR
    contains: ClassVar[Simpler] = {"elasticity": {"softness": inf}}
    parameters = (
        Parameter("play", unit="rad", neutral=0.0, low=0.0, high=0.15, typical=0.01, source="0.1-1 deg"),
        Parameter("gap", unit="rad", neutral=0.0, low=0.0, high=0.15, typical=0.0, source="0.1-1 deg"),
        Parameter("smooth", unit="rad", neutral=0.0, low=0.0, high=0.15, typical=0.0, source="0.1-1 deg"),
        Parameter("softness", unit="N m", neutral=0.01, low=1e-4, high=0.5, typical=0.01, source="torque of a seal"),
        Parameter("crossing", unit="s", neutral=0.0, low=0.0, high=0.2, typical=0.0, source="oil; ms", scale=0.005),
    )

    forms = ({"play": 0.01}, {"gap": 0.01}, {"gap": 0.01, "crossing": 0.02}, {"smooth": 0.01, "softness": 0.01})
    details = ("crossing",)

    @classmethod
    def details_at(cls, scales: Scales, values: Mapping[str, float]) -> tuple[str, ...]:
        """Return `crossing` where there is a gap to cross."""
        return cls.details if values["gap"] > 0.0 else ()

    state_size = 4  # offset within the play, first-call flag, last reading, offset within the gap

    @staticmethod
    def free_lead(lead: Array, p: Array, gain: Array) -> Array:
        """Return how far the motor runs ahead within its gap (..., n) [rad].

        Args:
            lead: (..., n) signal LEAD [rad].
            p: (..., n, 5) parameters.
            gain: (..., n) signal LOOP_GAIN [N m/rad].
        """
        half, softness = 0.5 * p[..., 2], np.where(p[..., 3] > 0.0, p[..., 3], 1.0)
        edge = np.where(p[..., 4] > 0.0, 0.0, 0.5 * p[..., 1])
        first = np.clip(lead, -edge, edge)
        with np.errstate(invalid="ignore"):  # of a simulation that ran away
            torque = torque_behind_play(gain * (lead - first), gain * half, softness)
        return np.asarray(first + smooth_lead(torque, p[..., 2], softness))

    @staticmethod
    def ahead_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor position [rad] without the drive's deflection and without the play."""
        half = 0.5 * p[1]
        reading = x[sig.MOTOR_POSITION, j]
        if half > 0.0:
            x[sig.LEAD, j] -= reading - x[sig.POSITION, j]
            lead = x[sig.LEAD, j] if p[4] <= 0.0 else x[sig.LEAD, j] + exp(-dt / p[4]) * (s[3] - x[sig.LEAD, j])
            s[3] = min(max(lead, -half), half)
            x[sig.GAP, j] = 1.0
            if abs(lead) < half:
                x[sig.GAP, j] = 2.0
                if p[4] <= 0.0:
                    x[sig.DAMPING, j] = 0.0
            reading += s[3]
        if p[2] > 0.0:
            gain, half = x[sig.LOOP_GAIN, j], 0.5 * p[2]
            loose = x[sig.LOOSE_TORQUE, j] - gain * (reading - x[sig.POSITION, j])
            side = tanh(_torque_behind_play(loose, gain * half, p[3]) / p[3])
            shown = 1.0 / (1.0 + gain * half * (1.0 - side * side) / p[3])
            x[sig.LEAD, j] = loose / gain + s[3]
            x[sig.DAMPING, j] *= shown
            x[sig.GAP, j] = 1.0 if shown > SHOWN else 2.0
            reading += half * side
        return reading

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        reading = x[sig.MOTOR_POSITION, j]
        if p[0] > 0.0:
            half = 0.5 * p[0]
            if s[1] == 0.0:
                s[0] = 0.0
                s[2] = reading
                s[1] = 1.0
            s[0] = min(max(s[0] - (reading - s[2]), -half), half)
            s[2] = reading
            reading += s[0]
        if p[2] > 0.0:
            reading += 0.5 * p[2] * tanh(x[sig.TORQUE, j] / p[3])
        return reading + s[3]
