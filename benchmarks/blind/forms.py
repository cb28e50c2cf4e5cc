"""Laws of the catalogue as other authors write them, at the sizes that hidden.py gives the usual forms.

Each maker belongs to a family, the catalogue's names for what it is, which are right answers where it is hidden.
Names were decided before any diagnosis of a form was run, but for `BESIDE`, which came with round 440000, after an
answer that was the same law in two words. The catalogue has had LuGre's form itself since.
"""

import numpy as np

from benchmarks.blind import plant as at
from benchmarks.blind.hidden import Maker, Scene, Truth, _put


def smooth_backlash(s: Scene, i: int) -> Truth:
    """The reading leads by half a gap with the sign of the torque, passing over within a few mN m."""
    width = _put(s.plant.smooth_backlash, i, np.deg2rad(s.size(0.3, 1.7)))
    return {"width": width, "torque": _put(s.plant.smooth_torque, i, s.size(0.002, 0.008) * s.scale(i))}


def damped_backlash(s: Scene, i: int) -> Truth:
    """A play that oil crosses: inside the gap the drive pulls as fast as it moves."""
    width = _put(s.plant.damped_backlash, i, np.deg2rad(s.size(0.3, 1.7)))
    time = float(s.rng.uniform(0.005, 0.03))
    return {"width": width, "damping": _put(s.plant.gap_damping, i, time * float(s.plant.kp[i]))}


def _bristled(s: Scene, i: int, kind: float) -> Truth:
    """Dry friction on bristles of one kind."""
    level = _put(s.plant.static_friction, i, float(s.rng.uniform(0.03, 0.07)) * s.scale(i))
    s.plant.bristles[i] = kind
    return {"friction": level, "range": _put(s.plant.presliding, i, s.size(0.002, 0.017))}


def lugre(s: Scene, i: int) -> Truth:
    """Bristles with micro-damping (de Wit and others 1995), their friction the same at every speed."""
    truth = _bristled(s, i, at.DAHL)
    critical = 2.0 * np.sqrt(truth["friction"] / truth["range"] * float(s.plant.reflected_inertia[i]))
    return {**truth, "micro_damping": _put(s.plant.micro_damping, i, float(critical * s.rng.uniform(0.5, 1.0)))}


def maxwell_slip(s: Scene, i: int) -> Truth:
    """Four springs in parallel, each of which slips at a limit of its own: hysteresis with memory."""
    return _bristled(s, i, at.MAXWELL)


def bouc_wen(s: Scene, i: int) -> Truth:
    """Hysteresis of second order, softer when loaded than when unloaded."""
    truth = _bristled(s, i, at.BOUC_WEN)
    return {**truth, "shape": _put(s.plant.bouc_wen_shape, i, float(s.rng.uniform(0.5, 0.8)))}


def _stribeck(s: Scene, i: int, exponent: float) -> Truth:
    velocity = _put(s.plant.stribeck_velocity, i, float(s.rng.uniform(0.05, 0.3)))
    excess = _put(s.plant.stribeck, i, s.size(0.02, 0.1) * s.scale(i))
    return {"excess": excess, "velocity": velocity, "exponent": _put(s.plant.stribeck_exponent, i, exponent)}


def tustin_friction(s: Scene, i: int) -> Truth:
    """Stribeck's curve falling as exp(-|v / vs|)."""
    return _stribeck(s, i, 1.0)


def heavy_tailed_stribeck(s: Scene, i: int) -> Truth:
    """Stribeck's curve falling as exp(-sqrt |v / vs|)."""
    return _stribeck(s, i, 0.5)


def jittered_delay(s: Scene, i: int) -> Truth:
    """A delay and, anew every 20 ms, up to as much again."""
    delay = _put(s.plant.delay, i, s.size(0.004, 0.03))
    return {"delay": delay, "jitter": _put(s.plant.jitter, i, delay * float(s.rng.uniform(0.3, 1.0)))}


def cogging_harmonics(s: Scene, i: int) -> Truth:
    """Cogging with second and third harmonics."""
    order = _put(s.plant.cogging_order, i, float(s.rng.integers(8, 20)))
    amplitude = _put(s.plant.cogging, i, s.size(0.01, 0.05) * s.scale(i))
    for phase in (s.plant.cogging_phase, s.plant.cogging_phase_2, s.plant.cogging_phase_3):
        phase[i] = s.rng.uniform(0, 6.28)
    second = _put(s.plant.cogging_2, i, amplitude * float(s.rng.uniform(0.3, 0.8)))
    third = _put(s.plant.cogging_3, i, amplitude * float(s.rng.uniform(0.1, 0.5)))
    return {"order": order, "amplitude": amplitude, "second": second, "third": third}


def soft_saturation(s: Scene, i: int) -> Truth:
    """The controller's torque as limit tanh(torque / limit)."""
    share = s.rng.uniform(0.9, 1.2) * (1 - 0.5 * s.strength)
    return {"limit": _put(s.plant.soft_limit, i, float(s.peak_torque[i] * share))}


def concave_torque(s: Scene, i: int) -> Truth:
    """The motor's torque falls short of the command by the square of it, until it grows no more."""
    short = s.size(0.1, 0.35)
    return {"short_at_peak": short, "bend": _put(s.plant.torque_bend, i, float(short / s.peak_torque[i]))}


def directional_viscous_friction(s: Scene, i: int) -> Truth:
    """Viscous friction of another coefficient in each direction."""
    mean = _put(s.plant.viscous, i, s.size(0.03, 0.2) * s.scale(i))
    difference = s.sign() * mean * float(s.rng.uniform(0.5, 1.2))
    return {"mean": mean, "difference": _put(s.plant.viscous_difference, i, difference)}


def gear_efficiency(s: Scene, i: int) -> Truth:
    """Friction in proportion to the torque, several times as much where the load drives the motor."""
    driving = _put(s.plant.load_friction, i, s.size(0.03, 0.1))
    return {"driving": driving, "driven_more": _put(s.plant.backdriven_friction, i, s.size(0.1, 0.35))}


def second_order_velocity_filter(s: Scene, i: int) -> Truth:
    """Two low passes after one another."""
    return {"time": _put(s.plant.velocity_lag_2, i, s.size(0.003, 0.02))}


def quadratic_stop(s: Scene, i: int) -> Truth:
    """A rubber stop, whose force grows with the square of its depth."""
    share = 0.15 + 0.2 * s.strength
    growth = _put(s.plant.stop_growth, i, float(s.rng.uniform(15.0, 80.0)) * s.scale(i))
    if s.rng.uniform() < 0.5:
        angle = _put(s.plant.stop_upper, i, float(s.high[i] - share * (s.high[i] - s.low[i])))
    else:
        angle = _put(s.plant.stop_lower, i, float(s.low[i] + share * (s.high[i] - s.low[i])))
    return {"angle": angle, "growth": growth}


def two_slope_elasticity(s: Scene, i: int) -> Truth:
    """A soft spring up to a knee, several times as stiff beyond it."""
    soft = _put(s.plant.stiffness, i, float(s.plant.stiffness[i]) / s.size(2.0, 3.0))
    knee = _put(s.plant.knee, i, float(s.rng.uniform(0.15, 0.35) * s.peak_torque[i]) / soft)
    return {"stiffness": soft, "knee": knee, "beyond": _put(s.plant.knee_stiffness, i, soft * s.size(3.0, 8.0))}


def steady_warm_up(s: Scene, i: int) -> Truth:
    """Friction that falls in proportion to the time since the trial began."""
    level = _put(s.plant.static_friction, i, float(s.rng.uniform(0.04, 0.08)) * s.scale(i))
    return {"friction": level, "rate": _put(s.plant.drift_rate, i, -s.size(0.02, 0.06))}


def cubic_drag(s: Scene, i: int) -> Truth:
    """Drag that grows with the cube of the speed."""
    return {"coefficient": _put(s.plant.cubic_drag, i, s.size(0.005, 0.04) * s.scale(i))}


FAMILIES: dict[str, tuple[Maker, tuple[str, ...]]] = {
    f.__name__: (f, names)
    for f, names in (
        (smooth_backlash, ("backlash",)),
        (lugre, ("presliding_friction",)),
        (tustin_friction, ("stribeck_friction",)),
        (jittered_delay, ("command_delay",)),
        (cogging_harmonics, ("cogging",)),
        (soft_saturation, ("torque_saturation", "torque_curve")),
        (directional_viscous_friction, ("viscous_friction",)),
        (gear_efficiency, ("load_dependent_friction",)),
        (second_order_velocity_filter, ("velocity_filter_lag",)),
        (quadratic_stop, ("joint_stop",)),
        (damped_backlash, ("backlash",)),
        (maxwell_slip, ("presliding_friction",)),
        (heavy_tailed_stribeck, ("stribeck_friction",)),
        (concave_torque, ("torque_curve", "torque_saturation")),
        (two_slope_elasticity, ("stiffening_elasticity",)),
        (bouc_wen, ("presliding_friction",)),
        (steady_warm_up, ("friction_drift",)),
        (cubic_drag, ("nonlinear_drag",)),
    )
}
"""Each form, and the catalogue's names that are right for it."""
BESIDE = {"gear_efficiency": ("torque_gain",)}
"""Names that are right beside a form's own: friction c |torque| sign(speed) with another c where the load drives is the
mean of both and a part in proportion to the torque itself, which is a gain."""
