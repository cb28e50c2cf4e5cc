"""The impedance law of a joint behind the elasticity of its drive."""

from tactile_cube.compiled import compiled


@compiled
def impedance_torque(
    command: float, q: float, v: float, kp: float, kd: float, compliance: float, extra: float, limit: float
) -> float:
    """Torque tau = K_P (q_d - q_m) - K_D dq with q_m = q + compliance * tau + extra, solved for tau and limited.

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
        limit: largest torque [N m].
    """
    torque = (kp * (command - q - extra) - kd * v) / (1.0 + kp * compliance)
    return min(max(torque, -limit), limit)
