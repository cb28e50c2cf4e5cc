"""Does recording.yaml agree with itself and with the URDF? Joints, couplings, gains, nominal values."""

from itertools import combinations
from pathlib import Path

import numpy as np

from tactile_cube.composition import suggestion
from tactile_cube.drivetrain.model_file import MAY_BE_INFINITE
from tactile_cube.errors import InputError
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.measurement.recordings.description import Description, TrialEntry, per_joint
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.rig import Rig
from tactile_cube.measurement.recordings.trial import Array, Gains

DEFAULTS = {"stiffness": np.inf}
DEFAULTS |= dict.fromkeys(("static_friction", "reflected_inertia", "friction_creep", "reading_delay"), 0.0)
"""Nominal constants of a drive, and their defaults."""
EFFECTS = {"viscous_friction": "damping"}  # effects that may be stated too, by the value of one parameter
SLOWER = 0.75  # share of the log's rate that rounding explains


def check_joints(description: Description, rig: Rig, file: Path) -> None:
    """Refuse joints that the URDF lacks, couplings to joints not actuated, a controller slower than the log."""
    named = [(joint, "joints") for joint in description.joints]
    named += [(joint, "coupled") for joint in description.coupled]
    named += [(coupling.joint, f"coupled.{joint}.joint") for joint, coupling in description.coupled.items()]
    for joint, key in named:
        if joint not in rig.joints:
            raise InputError(
                f"{file}: key '{key}': joint '{joint}' is not in {rig.path} (its movable joints: {list(rig.joints)})"
            )
    for joint, coupling in description.coupled.items():
        if coupling.joint not in description.joints:
            raise InputError(
                f"{file}: key 'coupled.{joint}.joint': '{coupling.joint}' is not among joints {description.joints}"
            )
        if joint in description.joints:
            raise InputError(f"{file}: key 'coupled.{joint}': the joint is actuated too (joints {description.joints})")
    own = description.controller.rate_hz
    if own is not None and own < SLOWER * description.rate_hz:
        raise InputError(
            f"{file}: key 'controller.rate_hz': received {own:g}, below the log's rate_hz {description.rate_hz:g}; "
            "a controller that skips rows is not simulated: log at its rate, or leave the key out"
        )


def check_coupling(description: Description, rig: Rig) -> list[str]:
    """Return the warnings where the URDF and recording.yaml disagree on which joint follows which."""
    mimics = {name: joint.mimics for name, joint in rig.joints.items() if joint.mimics is not None}
    warnings = [
        f"key 'coupled': the URDF lets '{name}' mimic '{mimics[name]}', recording.yaml says {said.joint}"
        for name, said in description.coupled.items()
        if mimics.get(name, said.joint) != said.joint
    ]
    free = [name for name in rig.joints if name not in {*description.joints, *description.coupled, *mimics}]
    if free:
        warnings.append(
            f"key 'joints': {free} of the URDF are in neither 'joints' nor 'coupled': they are held at zero"
        )
    return warnings


def gains_of(description: Description, entry: TrialEntry | None, key: str) -> Gains:
    """Return the gains of a trial, or without `entry` those of the recording; error messages name `key`.

    Raises:
        ValueError: gains with which no command could move a joint.
    """
    controller, joints = description.controller, tuple(description.joints)
    change = entry.controller.model_dump(exclude_none=True) if entry is not None and entry.controller else {}
    values = controller.model_dump() | change
    kp, kd, limit = (per_joint(values[name], joints, f"{key}.{name}") for name in ("kp", "kd", "torque_limit"))
    if controller.mode == "position":
        for name, gains in (("kp", kp), ("torque_limit", limit)):
            if not (gains > 0).all():
                wrong = int(np.argmin(gains > 0))
                raise ValueError(
                    f"key '{key}.{name}': received {gains[wrong]:g} for {joints[wrong]}: with it no command can "
                    "move the joint; give the gain of the controller that made the recording"
                )
        if not (kd >= 0).all() or not np.isfinite(kp).all() or not np.isfinite(kd).all():
            raise ValueError(
                f"key '{key}': received kp {kp.tolist()}, kd {kd.tolist()}; expected finite gains, kd >= 0"
            )
    return Gains(kp, kd, limit)


def check_nominal(nominal: dict[str, Array], joints: tuple[str, ...]) -> None:
    """Refuse nominal values of what no drive has, or that are no physical constants."""
    for key, values in nominal.items():
        if key not in (every := (*DEFAULTS, *EFFECTS)):
            raise ValueError(f"key 'nominal.{key}': unknown; known are {', '.join(every)}{suggestion(key, every)}")
        if (values < 0).any() or (np.isinf(values).any() and key not in MAY_BE_INFINITE):
            raise ValueError(
                f"key 'nominal.{key}': received {values.tolist()}; expected numbers >= 0 for {list(joints)}"
            )
    if (nominal.get("stiffness", np.ones(1)) == 0).any():
        raise ValueError("key 'nominal.stiffness': received 0: the drive would transmit nothing; .inf means rigid")


def check_inertia(recording: Recording) -> None:
    """Refuse a joint that has nothing to move. Raises InputError: neither its links nor its rotor have inertia."""
    tree, middle = recording.rigid_body(), np.mean([trial.position.mean(axis=0) for trial in recording.trials], axis=0)
    moved = tree.actuated_mass_matrix(middle).diagonal() + recording.nominal.get("reflected_inertia", 0.0)
    if not (moved > 0.0).all():
        raise InputError(
            f"{recording.rig.path}: joint '{recording.joints[int(np.argmin(moved > 0.0))]}' moves no inertia: give the "
            "links after it an <inertial>, or state nominal.reflected_inertia"
        )


SLOW = 0.1  # [rad/s] below which a torque holds weight and friction alone
MOST_SAMPLES = 200  # configurations change slowly
FEWEST = 30
BETTER = 0.72  # a swap must leave less than this share of the missing torque
NEGLIGIBLE = 0.01  # [N m] of missing torque that friction explains


def swap_warning(recording: Recording) -> list[str]:
    """Return a warning if the torques fit the weight of the links far better with two joints swapped."""
    trials = [trial for trial in recording.trials if trial.torque is not None and not trial.is_bench]
    if recording.torque_controlled or len(recording.joints) < 2 or not trials:
        return []
    slow = [(np.abs(trial.velocity()) < SLOW).all(axis=1) & trial.valid for trial in trials]
    position = np.concatenate([trial.position[still] for trial, still in zip(trials, slow, strict=True)])
    torque = np.concatenate([t.torque[still] for t, still in zip(trials, slow, strict=True) if t.torque is not None])
    if len(position) < FEWEST:
        return []
    stride = max(1, len(position) // MOST_SAMPLES)
    position, torque = position[::stride], torque[::stride]
    tree, named = recording.rigid_body(), list(range(len(recording.joints)))
    as_named = _missing(tree, recording.gravity, position, torque)
    best, swap = as_named, (0, 0)
    for first, second in combinations(named, 2):
        order = named.copy()
        order[first], order[second] = second, first
        missing = _missing(tree, recording.gravity, position[:, order], torque[:, order])
        if missing < best:
            best, swap = missing, (first, second)
    if best > BETTER * as_named or as_named - best < NEGLIGIBLE:
        return []
    one, two = (recording.joints[index] for index in swap)
    return [
        f"{recording.folder}: columns '{one}.torque' and '{two}.torque' miss the weight of the links by "
        f"{as_named:.3f} N m, and by {best:.3f} N m with the two joints exchanged: are they swapped?"
    ]


def _missing(tree: RigidBodyTree, gravity: Array, position: Array, torque: Array) -> float:
    still = np.zeros(tree.dofs)
    weight = np.stack([tree.coupling.T @ tree.equations(tree.expand(q), still, gravity)[1] for q in position])
    return float(np.sqrt(np.mean((torque - weight) ** 2)))
