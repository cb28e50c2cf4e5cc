"""What can be hidden in a recording: every named effect, some outside any catalogue, each at its usual size.

A maker receives the scene (rig, plant, ranges of the motion) and a joint, changes plant or rig in place and returns
the true parameters. Sizes follow what is typical of geared and tendon-driven finger joints; torques scale with the
rig's controller stiffness.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.plant import Plant
from benchmarks.blind.rig import Rig

Array = NDArray[np.float64]
Truth = dict[str, Any]


@dataclass
class Scene:
    """A world before its effect is hidden, with the size of its plain motion."""

    rig: Rig
    plant: Plant
    low: Array
    high: Array
    peak_torque: Array
    peak_command_speed: Array
    rng: np.random.Generator
    strength: float
    """0..1, where in the effect's usual range its size is drawn."""
    torque_unit: Array | None = None
    """Torques of the joints in those of a finger; None: as the stiffness of their controllers."""
    time_unit: float = 1.0
    """How much slower than a finger's the commands are."""

    def size(self, low: float, high: float) -> float:
        """A size between the two, logarithmic, with a little chance in it."""
        share = min(max(self.strength + 0.1 * self.rng.normal(), 0.0), 1.0)
        return float(low * (high / low) ** share)

    def scale(self, i: int) -> float:
        """How much stronger than the finger's this joint's torques are."""
        return float(self.plant.kp[i] / 3.69 if self.torque_unit is None else self.torque_unit[i])

    def angle(self, i: int) -> float:
        """How much further than a finger's this joint moves."""
        return float(self.plant.angle_unit[i])

    def speed(self, i: int) -> float:
        """How much faster than a finger's."""
        return float(self.plant.speed_unit[i])

    def lag(self, i: int) -> float:
        """How much slower than a finger's its loop answers."""
        return float(self.plant.time_unit[i])

    def stiffness(self, i: int) -> float:
        """Of the drive; one that its owner calls rigid is soft against its hidden elasticity alone."""
        stiffness = float(self.plant.stiffness[i])
        return stiffness if np.isfinite(stiffness) else 20.0 * float(self.plant.kp[i])

    def other(self, i: int) -> int:
        """A neighbour of joint i."""
        n = len(self.plant.kp)
        return int(self.rng.choice([k for k in (i - 1, i + 1) if 0 <= k < n]))

    def beside(self, i: int, j: int) -> float:
        """A finger's damping between two joints, in that of joint i when j moves."""
        return 1.0 if self.torque_unit is None else self.scale(i) / self.speed(j)

    def sign(self) -> float:
        """Plus or minus one."""
        return float(self.rng.choice([-1.0, 1.0]))

    def inside(self, i: int) -> float:
        """An angle in the middle part of joint i's motion."""
        return float(self.low[i] + (self.high[i] - self.low[i]) * self.rng.uniform(0.3, 0.7))


def _put(array: Array, i: Any, value: float) -> float:
    array[i] = value
    return value


def coulomb_friction(s: Scene, i: int) -> Truth:
    s.plant.static_friction[i] += (more := s.size(0.03, 0.1) * s.scale(i))
    return {"more": more}


def viscous_friction(s: Scene, i: int) -> Truth:
    return {"coefficient": _put(s.plant.viscous, i, s.size(0.03, 0.3) * s.scale(i) / s.speed(i))}


def stribeck_friction(s: Scene, i: int) -> Truth:
    velocity = _put(s.plant.stribeck_velocity, i, float(s.rng.uniform(0.05, 0.3)) * s.speed(i))
    return {"excess": _put(s.plant.stribeck, i, s.size(0.02, 0.1) * s.scale(i)), "velocity": velocity}


def load_dependent_friction(s: Scene, i: int) -> Truth:
    return {"mu": _put(s.plant.load_friction, i, s.size(0.07, 0.3))}


def asymmetric_friction(s: Scene, i: int) -> Truth:
    level = _put(s.plant.static_friction, i, float(s.rng.uniform(0.03, 0.06)) * s.scale(i))
    return {"friction": level, "asymmetry": _put(s.plant.asymmetry, i, s.sign() * s.size(0.15, 0.5))}


def presliding_friction(s: Scene, i: int) -> Truth:
    level = _put(s.plant.static_friction, i, float(s.rng.uniform(0.03, 0.07)) * s.scale(i))
    return {"friction": level, "breakaway": _put(s.plant.presliding, i, s.size(0.001, 0.017) * s.angle(i))}


def friction_drift(s: Scene, i: int) -> Truth:
    level = _put(s.plant.static_friction, i, float(s.rng.uniform(0.04, 0.08)) * s.scale(i))
    time = _put(s.plant.drift_time, i, float(s.rng.uniform(2.0, 6.0)) * s.time_unit)
    return {"friction": level, "drift": _put(s.plant.drift, i, -s.size(0.3, 0.7)), "time": time}


def backlash(s: Scene, i: int) -> Truth:
    return {"width": _put(s.plant.backlash, i, np.deg2rad(s.size(0.2, 1.0)) * s.angle(i))}


def elasticity(s: Scene, i: int) -> Truth:
    return {"stiffness": _put(s.plant.stiffness, i, s.stiffness(i) / s.size(2.0, 4.0))}


def stiffening_elasticity(s: Scene, i: int) -> Truth:
    deflection = s.peak_torque[i] / s.stiffness(i)
    soft = _put(s.plant.stiffness, i, 0.5 * s.stiffness(i))
    return {
        "stiffness": soft,
        "cubic": _put(s.plant.cubic_stiffness, i, float(soft * s.size(1.0, 8.0) / deflection**2)),
    }


def transmission_error(s: Scene, i: int) -> Truth:
    order = _put(s.plant.transmission_order, i, float(s.rng.integers(4, 30)) / s.angle(i))
    s.plant.transmission_phase[i] = s.rng.uniform(0, 6.28)
    return {"order": order, "amplitude": _put(s.plant.transmission, i, np.deg2rad(s.size(0.1, 0.5)) * s.angle(i))}


def cogging(s: Scene, i: int) -> Truth:
    order = _put(s.plant.cogging_order, i, float(s.rng.integers(10, 40)) / s.angle(i))
    s.plant.cogging_phase[i] = s.rng.uniform(0, 6.28)
    return {"order": order, "amplitude": _put(s.plant.cogging, i, s.size(0.008, 0.05) * s.scale(i))}


def command_delay(s: Scene, i: int) -> Truth:
    return {"delay": _put(s.plant.delay, i, s.size(0.004, 0.04) * s.lag(i))}


def actuator_lag(s: Scene, i: int) -> Truth:
    return {"time": _put(s.plant.lag, i, s.size(0.06, 0.5) * float(s.plant.kd[i] / s.plant.kp[i]))}


def velocity_filter_lag(s: Scene, i: int) -> Truth:
    return {"time": _put(s.plant.velocity_lag, i, s.size(0.005, 0.04) * s.lag(i))}


def reflected_inertia(s: Scene, i: int) -> Truth:
    return {"inertia": _put(s.plant.reflected_inertia, i, float(s.plant.reflected_inertia[i]) * s.size(1.6, 3.0))}


def payload(s: Scene, i: int) -> Truth:
    s.rig.tip_mass = s.rig.links[-1].mass * s.size(0.05, 0.25)
    return {"mass": s.rig.tip_mass}


def torque_gain(s: Scene, i: int) -> Truth:
    return {"gain": _put(s.plant.gain, i, 1.0 + s.sign() * s.size(0.04, 0.15))}


def torque_bias(s: Scene, i: int) -> Truth:
    return {"bias": _put(s.plant.bias, i, s.sign() * s.size(0.003, 0.015) * s.scale(i))}


def torque_crosstalk(s: Scene, i: int) -> Truth:
    j = s.other(i)
    return {"from": s.rig.actuated[j], "gain": _put(s.plant.crosstalk, (i, j), s.sign() * s.size(0.05, 0.25))}


def position_offset(s: Scene, i: int) -> Truth:
    s.plant.offset[i] += (more := s.sign() * np.deg2rad(s.size(2.0, 5.0)) * s.angle(i))
    return {"more": more}


def coupling_error(s: Scene, i: int) -> Truth:
    s.rig.coupling_ratio = 1.0 + s.sign() * s.size(0.05, 0.25)
    s.rig.coupling_offset = s.sign() * np.deg2rad(s.size(1.0, 6.0))
    return {"ratio": s.rig.coupling_ratio, "offset": s.rig.coupling_offset}


def joint_coupling(s: Scene, i: int) -> Truth:
    j = s.other(i)
    if s.rng.uniform() < 0.5:
        return {
            "from": s.rig.actuated[j],
            "viscous": _put(s.plant.viscous_coupling, (i, j), s.sign() * s.size(0.01, 0.08) * s.beside(i, j)),
        }
    return {
        "from": s.rig.actuated[j],
        "dry": _put(s.plant.dry_coupling, (i, j), s.sign() * s.size(0.01, 0.04) * s.scale(i)),
    }


def torque_saturation(s: Scene, i: int) -> Truth:
    return {
        "limit": _put(s.plant.saturation, i, float(s.peak_torque[i] * s.rng.uniform(0.7, 0.8) * (1 - 0.5 * s.strength)))
    }


def command_dead_zone(s: Scene, i: int) -> Truth:
    if s.rng.uniform() < 0.5:
        return {"error": _put(s.plant.error_dead_zone, i, s.size(0.002, 0.01) * s.angle(i))}
    return {"torque": _put(s.plant.torque_dead_zone, i, s.size(0.008, 0.04) * s.scale(i))}


def rate_limit(s: Scene, i: int) -> Truth:
    return {
        "rate": _put(
            s.plant.rate_limit, i, float(s.peak_command_speed[i] * s.rng.uniform(0.6, 0.7) * (1 - 0.5 * s.strength))
        )
    }


def position_torque(s: Scene, i: int) -> Truth:
    if s.rng.uniform() < 0.5:
        centre = _put(s.plant.spring_centre, i, s.inside(i))
        return {"centre": centre, "stiffness": _put(s.plant.spring, i, s.size(0.03, 0.3) * s.scale(i) / s.angle(i))}
    centre = _put(s.plant.detent_centre, i, s.inside(i))
    width = _put(s.plant.detent_width, i, float(s.rng.uniform(0.08, 0.2) * (s.high[i] - s.low[i])))
    return {"centre": centre, "width": width, "peak": _put(s.plant.detent, i, s.size(0.015, 0.06) * s.scale(i))}


def nonlinear_drag(s: Scene, i: int) -> Truth:
    return {"coefficient": _put(s.plant.drag, i, s.size(0.01, 0.08) * s.scale(i) / s.speed(i) ** 2)}


def joint_stop(s: Scene, i: int) -> Truth:
    share = 0.15 + 0.2 * s.strength
    stiffness = _put(s.plant.stop_stiffness, i, float(s.rng.uniform(3.0, 20.0)) * s.scale(i) / s.angle(i))
    if s.rng.uniform() < 0.5:
        angle = _put(s.plant.stop_upper, i, float(s.high[i] - share * (s.high[i] - s.low[i])))
    else:
        angle = _put(s.plant.stop_lower, i, float(s.low[i] + share * (s.high[i] - s.low[i])))
    return {"angle": angle, "stiffness": stiffness}


def position_velocity_product(s: Scene, i: int) -> Truth:
    reach = max(abs(s.low[i]), abs(s.high[i]))
    return {
        "coefficient": _put(
            s.plant.position_velocity, i, s.sign() * s.size(0.06, 0.2) * s.scale(i) / s.speed(i) / float(reach)
        )
    }


def periodic_disturbance(s: Scene, i: int) -> Truth:
    frequency = _put(s.plant.disturbance_frequency, i, float(s.rng.uniform(0.4, 4.0)) / s.time_unit)
    s.plant.disturbance_phase[i] = s.rng.uniform(0, 6.28)
    return {"frequency": frequency, "amplitude": _put(s.plant.disturbance, i, s.size(0.01, 0.05) * s.scale(i))}


def acceleration_friction(s: Scene, i: int) -> Truth:
    return {
        "coefficient": _put(
            s.plant.acceleration_friction, i, s.size(0.0008, 0.003) * s.scale(i) * s.time_unit / s.speed(i)
        )
    }


def position_relay(s: Scene, i: int) -> Truth:
    centre, width = s.inside(i), 0.3 * (s.high[i] - s.low[i])
    s.plant.relay_centre[i], s.plant.relay_width[i] = centre, width
    return {"centre": centre, "width": float(width), "torque": _put(s.plant.relay, i, s.size(0.01, 0.05) * s.scale(i))}


def neighbour_friction(s: Scene, i: int) -> Truth:
    j = s.other(i)
    return {
        "from": s.rig.actuated[j],
        "friction": _put(s.plant.neighbour_friction, (i, j), s.size(0.02, 0.06) * s.scale(i)),
    }


def even_drag(s: Scene, i: int) -> Truth:
    return {"coefficient": _put(s.plant.even_drag, i, s.sign() * s.size(0.01, 0.06) * s.scale(i) / s.speed(i) ** 2)}


Maker = Callable[[Scene, int], Truth]
NAMED: dict[str, Maker] = {
    f.__name__: f
    for f in (
        coulomb_friction, viscous_friction, stribeck_friction, load_dependent_friction, asymmetric_friction,
        presliding_friction, friction_drift, backlash, elasticity, stiffening_elasticity, transmission_error, cogging,
        command_delay, actuator_lag, velocity_filter_lag, reflected_inertia, payload, torque_gain, torque_bias,
        torque_crosstalk, position_offset, coupling_error, joint_coupling, torque_saturation, command_dead_zone,
        rate_limit, position_torque, nonlinear_drag, joint_stop,
    )
}  # fmt: skip
UNNAMED: dict[str, Maker] = {
    f.__name__: f
    for f in (
        position_velocity_product, periodic_disturbance, acceleration_friction, position_relay, neighbour_friction,
        even_drag,
    )
}  # fmt: skip
ABSORBED = ("coulomb_friction", "viscous_friction", "elasticity", "reflected_inertia", "position_offset")
"""Effects that a user's plain model already has a constant for: refitting that constant is a right answer too."""
NEEDS_NEIGHBOUR = ("torque_crosstalk", "joint_coupling", "neighbour_friction")
NEEDS_SWING = ("payload", "torque_gain", "torque_bias", "position_offset")
"""Effects that other constants imitate exactly unless gravity pulls differently in every posture."""
WHOLE_RIG = ("payload", "coupling_error")
"""Effects of the mechanism, whose joint is a matter of taste."""
ALONE = ("backlash", "actuator_lag")
"""Effects whose physics here does not combine with another in the same drive."""
