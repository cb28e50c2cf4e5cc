"""Every constant of the blind world, and where each stands in the arrays that its compiled laws read."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Plant(NamedTuple):
    """Every constant of the world; one number per actuated joint, or a square matrix between joints.

    New ones go last: compiled laws in a cache remember where each stood.
    """

    # what a user's model has as well
    kp: Array
    kd: Array
    torque_limit: Array
    stiffness: Array
    static_friction: Array
    reflected_inertia: Array
    offset: Array
    # command
    delay: Array
    rate_limit: Array
    error_dead_zone: Array
    torque_dead_zone: Array
    # motor and transmission
    saturation: Array
    lag: Array
    velocity_lag: Array
    gain: Array
    bias: Array
    crosstalk: Array
    backlash: Array
    cubic_stiffness: Array
    transmission: Array
    transmission_order: Array
    transmission_phase: Array
    # friction
    viscous: Array
    stribeck: Array
    stribeck_velocity: Array
    load_friction: Array
    asymmetry: Array
    presliding: Array
    drift: Array
    drift_time: Array
    # joint torques
    drag: Array
    cogging: Array
    cogging_order: Array
    cogging_phase: Array
    spring: Array
    spring_centre: Array
    detent: Array
    detent_centre: Array
    detent_width: Array
    stop_lower: Array
    stop_upper: Array
    stop_stiffness: Array
    viscous_coupling: Array
    dry_coupling: Array
    # in no catalogue
    position_velocity: Array
    disturbance: Array
    disturbance_frequency: Array
    disturbance_phase: Array
    acceleration_friction: Array
    relay: Array
    relay_centre: Array
    relay_width: Array
    neighbour_friction: Array
    even_drag: Array
    # how far, how fast it moves and how slowly its loop answers, in a finger's
    angle_unit: Array
    speed_unit: Array
    time_unit: Array
    # laws of the catalogue as other authors write them
    smooth_backlash: Array
    smooth_torque: Array
    damped_backlash: Array
    gap_damping: Array
    bristles: Array
    micro_damping: Array
    bouc_wen_shape: Array
    stribeck_exponent: Array
    jitter: Array
    cogging_2: Array
    cogging_phase_2: Array
    cogging_3: Array
    cogging_phase_3: Array
    soft_limit: Array
    torque_bend: Array
    viscous_difference: Array
    backdriven_friction: Array
    velocity_lag_2: Array
    stop_growth: Array
    knee: Array
    knee_stiffness: Array
    drift_rate: Array
    cubic_drag: Array
    # somebody's hand
    push: Array
    push_start: Array
    push_seconds: Array
    # parts of a controller and of a motor that an owner does not state, and when the log reads
    integral: Array
    integral_limit: Array
    feedforward: Array
    compensation: Array
    stall: Array
    no_load: Array
    early: Array


MATRICES = ("crosstalk", "viscous_coupling", "dry_coupling", "neighbour_friction")
INFINITE = (
    "soft_limit", "knee", "rate_limit", "saturation", "stop_upper", "torque_limit", "stiffness", "integral_limit",
    "stall",
)  # fmt: skip
ONES = (
    "gain", "stribeck_velocity", "transmission_order", "cogging_order", "detent_width", "drift_time", "angle_unit",
    "speed_unit", "time_unit", "smooth_torque", "knee_stiffness", "no_load",
)  # fmt: skip


DAHL, MAXWELL, BOUC_WEN = 0.0, 1.0, 2.0
"""Kinds of bristles."""
VECTORS = tuple(name for name in Plant._fields if name not in MATRICES)
(
    KP, KD, TORQUE_LIMIT, STIFFNESS, STATIC_FRICTION, REFLECTED_INERTIA, OFFSET, DELAY, RATE_LIMIT, ERROR_DEAD_ZONE,
    TORQUE_DEAD_ZONE, SATURATION, LAG, VELOCITY_LAG, GAIN, BIAS, BACKLASH, CUBIC_STIFFNESS, TRANSMISSION,
    TRANSMISSION_ORDER, TRANSMISSION_PHASE, VISCOUS, STRIBECK, STRIBECK_VELOCITY, LOAD_FRICTION, ASYMMETRY,
    PRESLIDING, DRIFT, DRIFT_TIME, DRAG, COGGING, COGGING_ORDER, COGGING_PHASE, SPRING, SPRING_CENTRE, DETENT,
    DETENT_CENTRE, DETENT_WIDTH, STOP_LOWER, STOP_UPPER, STOP_STIFFNESS, POSITION_VELOCITY, DISTURBANCE,
    DISTURBANCE_FREQUENCY, DISTURBANCE_PHASE, ACCELERATION_FRICTION, RELAY, RELAY_CENTRE, RELAY_WIDTH, EVEN_DRAG,
    ANGLE_UNIT, SPEED_UNIT, TIME_UNIT, SMOOTH_BACKLASH, SMOOTH_TORQUE, DAMPED_BACKLASH, GAP_DAMPING, BRISTLES,
    MICRO_DAMPING, BOUC_WEN_SHAPE, STRIBECK_EXPONENT, JITTER, COGGING_2, COGGING_PHASE_2, COGGING_3,
    COGGING_PHASE_3, SOFT_LIMIT, TORQUE_BEND, VISCOUS_DIFFERENCE, BACKDRIVEN_FRICTION, VELOCITY_LAG_2, STOP_GROWTH,
    KNEE, KNEE_STIFFNESS, DRIFT_RATE, CUBIC_DRAG, PUSH, PUSH_START, PUSH_SECONDS, INTEGRAL, INTEGRAL_LIMIT,
    FEEDFORWARD, COMPENSATION, STALL, NO_LOAD, EARLY,
) = range(len(VECTORS))  # fmt: skip
CROSSTALK, VISCOUS_COUPLING, DRY_COUPLING, NEIGHBOUR_FRICTION = range(len(MATRICES))


def neutral(joints: int) -> Plant:
    """A plant in which every effect is off (and every controller gain zero)."""
    values = {}
    for name in Plant._fields:
        shape = (joints, joints) if name in MATRICES else (joints,)
        fill = np.inf if name in INFINITE else 1.0 if name in ONES else 0.0
        values[name] = np.full(shape, fill)
    values["stribeck_exponent"] = np.full(joints, 2.0)
    values["stop_lower"] = np.full(joints, -np.inf)
    return Plant(**values)
