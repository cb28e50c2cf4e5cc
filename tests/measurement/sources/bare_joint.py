"""Logs of one joint whose mechanism nobody describes: time, goal and position, by the equation of motion alone."""

import numpy as np

MASS, LEVER, ROTOR, WEIGHT = 0.4, 0.12, 0.004, 0.4 * 9.81 * 0.12
INERTIA = MASS * LEVER**2 + ROTOR  # [kg m^2], of a slide [kg]
KP, KD = 6.0, 0.15
Log = dict[str, np.ndarray]


def played(
    robot: str,
    mode: str = "position",
    hangs_at: float = 0.0,
    friction: float = 0.0,
    seed: int = 0,
    noise: float = 1e-4,
    gains: tuple[float, float] = (KP, KD),
) -> Log:
    """Six seconds at 200 Hz, by semi-implicit Euler in 0.25 ms; a reading follows its command's period."""
    rng = np.random.default_rng(seed)
    time = np.arange(1200) / 200
    phases, amplitudes = rng.uniform(0, 2 * np.pi, 4), np.array([0.5, 0.3, 0.15, 0.05])
    goal = np.sum(amplitudes * np.sin(np.outer(time, [1.3, 4.0, 9.0, 22.0]) + phases), axis=1)
    goal = goal if mode != "torque" else 0.5 * goal
    q, v, step, positions = (1.0 if mode == "free" else goal[0]), 0.0, 2.5e-4, []
    for command in goal:
        for _ in range(20):
            drive = {"position": gains[0] * (command - q) - gains[1] * v, "torque": command}.get(mode, 0.0)
            pull = drive - WEIGHT * np.sin(q - hangs_at) * (robot == "pendulum") - 0.02 * v * (mode != "position")
            free = v + step * pull / INERTIA
            v = np.sign(free) * max(abs(free) - step * friction / INERTIA, 0.0)
            q += step * v
        positions.append(q)
    position = np.array(positions) + noise * rng.normal(size=len(time))
    return {"time": time, "goal": goal, "position": position}
