"""From the policy's desired angles at 10 Hz to a joint's target and torque at the rate of the physics."""

from math import exp

from tactile_cube.compiled import compiled


@compiled
def low_pass(filtered: float, goal: float, time_constant: float, dt: float) -> float:
    """One exact step of the first-order low-pass T_s q_f' = q_n - q_f; T_s = 0 lets the goal through.

    Source: Sievers, Pitz, Bauml (ICRA 2022), section II-B ("cut-off 1/T_s").
    """
    if time_constant <= 0.0:
        return goal
    return goal + exp(-dt / time_constant) * (filtered - goal)


@compiled
def limit_rate(previous: float, target: float, rate: float, dt: float) -> float:
    """The target, at most `rate` [rad/s] away from where it was one step before."""
    return min(max(target, previous - rate * dt), previous + rate * dt)


@compiled
def limit_torque(target: float, q_m: float, v: float, kp: float, kd: float, limit: float) -> float:
    """The target nearest to the wanted one for which K_P (q_d - q_m) - K_D dq stays within `limit` [N m].

    The controller is inverted approximately: with q_m as last measured.
    """
    if kp <= 0.0:
        return target
    return min(max(target, q_m + (kd * v - limit) / kp), q_m + (kd * v + limit) / kp)


@compiled
def impedance_torque(
    command: float, q: float, v: float, kp: float, kd: float, compliance: float, extra: float
) -> float:
    """Torque tau = K_P (q_d - q_m) - K_D dq [N m] with q_m = q + compliance * tau + extra, solved for tau.

    The loop is algebraic: iterating it would add a delay of one step, the closed form does not.
    Source: Sievers, Pitz, Bauml (ICRA 2022), eq. (1) and (2).

    Args:
        command: q_d [rad].
        q: link-side position [rad].
        v: speed that the controller sees [rad/s].
        kp: K_P [N m/rad].
        kd: K_D [N m s/rad].
        compliance: 1 / K_e, negative for the printed sign [rad/(N m)].
        extra: what other effects add to the measured position [rad].
    """
    return (kp * (command - q - extra) - kd * v) / (1.0 + kp * compliance)
