"""Scales of a recording's joints, from which bounds, typical sizes and start values follow."""

import numpy as np

from tactile_cube.drivetrain.effects.effect import FINGER, Array, Scales
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.measurement.recordings.recording import Recording

OFTEN, USUAL, SELDOM = 0.5, 0.9, 0.999  # quantiles of the torques that a recording asks for
OUTSIDE = 0.002  # share of the positions beyond either end of the range
FAST = 0.995  # quantile of the speeds
CROSSING = 0.11  # [s] in which the usual torque moves a finger's joint through its range
COARSE, FASTER = 10, 3.0  # rows between which a motion is no noise; its usual speed over the mean one
VELOCITY_WINDOW = 0.03  # [s] of a finger
IDLE = 0.1  # of the torque that the motion takes: a drive that gives less does not set the joint's sizes
SMALL = 1e-9  # part of another size that stands for nothing at all


def joint_scales(recording: Recording) -> tuple[Scales, ...]:
    """Compute the scales of each joint of a recording."""
    tree = recording.rigid_body()
    positions = np.concatenate([trial.position for trial in recording.trials])
    low, high = np.quantile(positions, [OUTSIDE, 1.0 - OUTSIDE], axis=0)
    spans = np.maximum(high - low, SMALL * np.maximum(np.abs(high), 1.0))
    links = tree.actuated_mass_matrix(positions.mean(axis=0)).diagonal()
    inertia = links + recording.nominal.get("reflected_inertia", np.zeros(len(spans)))
    time = unit_of_time(recording, inertia, spans)
    speeds = _quantile([np.abs(trial.velocity(VELOCITY_WINDOW * time)) for trial in recording.trials], FAST)
    speeds = np.maximum(speeds, SMALL * spans / time)
    torques = _torques(recording, VELOCITY_WINDOW * time)
    accelerating = inertia * speeds**2 / spans  # by gravity, or somebody's hand, where the drive does nothing
    often, usual, seldom = (np.maximum(_quantile(torques, q), IDLE * accelerating) for q in (OFTEN, USUAL, SELDOM))
    commanded = [np.abs(np.diff(trial.command, axis=0)) / trial.step for trial in recording.trials]
    command_speed = speeds if recording.torque_controlled else _quantile(commanded, FAST)
    masses, leaders = _moved_masses(tree), {coupling.joint for coupling in recording.description.coupled.values()}
    own = [tree.dof_names.index(name) for name in tree.joint_names]
    slides = tree.prismatic[own]
    limits = np.full(len(own), np.inf) if recording.torque_controlled else recording.gains.torque_limit
    levers = np.where(slides, spans, np.sqrt(links / masses))
    columns = {"torque": usual, "often": often, "seldom": seldom, "low": low, "high": low + spans, "speed": speeds}
    columns |= {"command_speed": command_speed, "inertia": inertia, "mass": masses, "lever": levers}
    columns |= {"torque_limit": limits, "lower": tree.lower[own], "upper": tree.upper[own]}
    return tuple(
        Scales(
            **{key: float(values[j]) for key, values in columns.items()},
            time=time,
            slides=bool(slides[j]),
            neighbours=len(spans) - 1,
            leads=joint in leaders,
            first=j == 0,
            lasts=max(trial.begun + trial.duration for trial in recording.trials),
        )
        for j, joint in enumerate(recording.joints)
    )


def unit_of_time(recording: Recording, inertia: Array, spans: Array) -> float:
    """Return the time that corresponds to one second of a finger [s], rounded to a power of ten.

    It is derived from the time in which the fastest joint would cross its range, driven by its usual torque or as
    fast as it mostly moves. CROSSING is the logarithmic centre of the values of blind rigs of a finger's size, 0.06 to
    0.2 s, so that all of them, and a finger whose drive is several times weaker or stronger, lie within one decade.
    """
    moved = np.concatenate([np.abs(np.diff(trial.position[::COARSE], axis=0)) for trial in recording.trials])
    coasting = spans / np.maximum(FASTER * moved.mean(axis=0) / (COARSE * recording.step), SMALL * spans)
    usual = np.maximum(_quantile(_torques(recording, 0.0), USUAL), inertia * spans / coasting**2)
    crossing = float(np.sqrt(inertia * spans / usual).min())
    return float(10.0 ** np.round(np.log10(crossing / CROSSING))) * FINGER.time


def _quantile(rows: list[Array], share: float) -> Array:
    return np.asarray(np.quantile(np.concatenate(rows), share, axis=0))


def _torques(recording: Recording, window: float) -> list[Array]:
    """Return the size of the controller's torques (T, n) in each trial; a window of zero leaves damping out."""
    if recording.torque_controlled:
        return [np.abs(trial.command) for trial in recording.trials]
    kp, kd, limit = recording.gains.kp, recording.gains.kd, recording.gains.torque_limit
    return [
        np.minimum(np.abs(kp * (t.command - t.position) - (kd * t.velocity(window) if window else 0.0)), limit)
        for t in recording.trials
    ]


def _moved_masses(tree: RigidBodyTree) -> Array:
    """Return the mass (n,) of all links beyond each actuated joint [kg]."""
    beyond = tree.mass.copy()
    for link in range(tree.dofs - 1, -1, -1):
        if tree.parent[link] >= 0:
            beyond[tree.parent[link]] += beyond[link]
    own = [tree.dof_names.index(name) for name in tree.joint_names]
    return np.maximum(beyond[own], SMALL * max(float(tree.mass.sum()), SMALL))
