"""A recording on disk: recording.yaml, the rig's URDF and one table a trial, read and checked."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.plain_yaml import read_schema
from tactile_cube.errors import InputError
from tactile_cube.measurement.columns import pick_columns
from tactile_cube.measurement.description import Coupling, Description, TrialEntry, per_joint
from tactile_cube.measurement.plausibility import check_assignment, check_units
from tactile_cube.measurement.rig import Rig, read_rig
from tactile_cube.measurement.statics import swap_warning
from tactile_cube.measurement.tables import read_table
from tactile_cube.measurement.timing import check_time, on_grid
from tactile_cube.measurement.trial import Gains, Trial

Array = NDArray[np.float64]
DESCRIPTION = "recording.yaml"


@dataclass(frozen=True)
class Recording:
    """What was measured on a rig.

    Attributes:
        folder: where it lies.
        description: recording.yaml.
        rig: the mechanism.
        gains: the controller, each gain of shape (joints,).
        nominal: what the owner believes, key -> (joints,).
        trials: in the order of recording.yaml.
        warnings: what was odd but could be used, one line each.
    """

    folder: Path
    description: Description
    rig: Rig
    gains: Gains
    nominal: dict[str, Array]
    trials: tuple[Trial, ...]
    warnings: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The folder's name."""
        return self.folder.resolve().name

    @property
    def urdf(self) -> str:
        """Text of the URDF."""
        return self.rig.text

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints in column order."""
        return tuple(self.description.joints)

    @property
    def coupled(self) -> dict[str, Coupling]:
        """Joints that follow another one."""
        return self.description.coupled

    @property
    def gravity(self) -> Array:
        """Gravity in the base frame, shape (3,) [m/s^2]."""
        return np.asarray(self.description.gravity, dtype=np.float64)

    @property
    def rate(self) -> float:
        """Samples per second [Hz]."""
        return self.description.rate_hz

    @property
    def step(self) -> float:
        """Time between samples [s]."""
        return 1.0 / self.rate

    @property
    def read(self) -> Literal["after", "before"]:
        """Whether a row shows the state at the end of the period in which its command acted, or at its beginning."""
        return self.description.sensors.read

    @property
    def torque_controlled(self) -> bool:
        """Whether commands are torques [N m]."""
        return self.description.controller.mode == "torque"

    def stated(self, constant: str, joint: str) -> float | None:
        """What the owner states of a constant of one joint, or None."""
        values = getattr(self.gains, constant, self.nominal.get(constant))
        return None if values is None else float(values[self.joints.index(joint)])

    def with_trials(self, trials: list[Trial] | tuple[Trial, ...]) -> "Recording":
        """The same rig with these trials alone."""
        return replace(self, trials=tuple(trials))


def read_recording(folder: str | Path) -> Recording:
    """The recording in a folder, checked and on a uniform time grid.

    Raises:
        InputError: naming file, column, row and value of what cannot be used.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"recording={folder}: no such folder; a recording is a folder with {DESCRIPTION} in it")
    file = folder / DESCRIPTION
    description = read_schema(file, Description)
    rig = read_rig(_inside(folder, description.rig, "rig"))
    _check_joints(description, rig, file)
    try:
        recording = _assemble(folder, description, rig)
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"{file}: {error}") from None
    swapped = swap_warning(recording)
    return recording if swapped is None else replace(recording, warnings=(*recording.warnings, swapped))


def _assemble(folder: Path, description: Description, rig: Rig) -> Recording:
    joints = tuple(description.joints)
    nominal = {key: per_joint(value, joints, f"nominal.{key}") for key, value in description.nominal.items()}
    warnings = _check_nominal(nominal, joints)
    warnings += [f"{folder / DESCRIPTION}: {line}" for line in _check_coupling(description, rig)]
    trials, gains = [], _gains(description, None, "controller")
    if description.controller.mode != "torque" and (gains.kd == 0).any():
        warnings.append(
            f"{folder / DESCRIPTION}: key 'controller.kd': 0 for {_where(gains.kd == 0, joints)}: no damping"
        )
    for index, entry in enumerate(description.trials):
        trial = read_trial(folder, entry, description, rig, f"trials.{index}.controller")
        trials.append(trial)
        warnings += trial.warnings
    return Recording(folder, description, rig, gains, nominal, tuple(trials), tuple(warnings))


def read_trial(folder: Path, entry: TrialEntry, description: Description, rig: Rig, key: str) -> Trial:
    """One trial, checked and on the uniform grid of the recording's rate."""
    path = _inside(folder, entry.file, "trials.file")
    joints = tuple(description.joints)
    gains = _gains(description, entry, key)
    columns, warnings = pick_columns(read_table(path), joints, path)
    columns, time_warnings = check_time(columns, description.rate_hz, path)
    limits = [rig.joints[joint] for joint in joints]
    if description.controller.mode == "position":
        warnings += check_units(columns, limits, gains, path)
        warnings += check_assignment(columns, limits, path)
    grid, valid = on_grid(columns, description.rate_hz)
    return Trial(
        path.stem,
        entry.file,
        entry.kind,
        entry.initialisation,
        grid.time,
        grid.command,
        grid.position,
        grid.torque,
        valid,
        gains,
        entry.force,
        entry.clamped,
        entry.touch,
        tuple(warnings + time_warnings),
    )


def _inside(folder: Path, name: str, key: str) -> Path:
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise InputError(f"{folder / DESCRIPTION}: key '{key}': '{name}' lies outside the recording's folder")
    return path


def _check_joints(description: Description, rig: Rig, file: Path) -> None:
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


def _check_coupling(description: Description, rig: Rig) -> list[str]:
    mimics = {name: joint.mimics for name, joint in rig.joints.items() if joint.mimics is not None}
    warnings = []
    for name, leader in mimics.items():
        said = description.coupled.get(name)
        if name in description.joints or (said is not None and said.joint == leader):
            continue
        warnings.append(
            f"key 'coupled': the URDF lets '{name}' mimic '{leader}', recording.yaml says "
            f"{said.joint if said else 'nothing of it'}"
        )
    free = [name for name in rig.joints if name not in {*description.joints, *description.coupled, *mimics}]
    if free:
        warnings.append(
            f"key 'joints': {free} of the URDF are in neither 'joints' nor 'coupled': they are held at zero"
        )
    return warnings


def _gains(description: Description, entry: TrialEntry | None, key: str) -> Gains:
    controller, joints = description.controller, tuple(description.joints)
    change = entry.controller if entry is not None else None
    values = {}
    for name in ("kp", "kd", "torque_limit"):
        own = getattr(change, name) if change is not None else None
        values[name] = per_joint(getattr(controller, name) if own is None else own, joints, f"{key}.{name}")
    gains = Gains(**values)
    if controller.mode == "position":
        _require_gains(gains, joints, key)
    return gains


def _require_gains(gains: Gains, joints: tuple[str, ...], key: str) -> None:
    for name, values in (("kp", gains.kp), ("torque_limit", gains.torque_limit)):
        if not (values > 0).all():
            wrong = int(np.argmin(values > 0))
            raise ValueError(
                f"key '{key}.{name}': received {values[wrong]:g} for {joints[wrong]}: with it no command can "
                "move the joint; give the gain of the controller that made the recording"
            )
    if not (gains.kd >= 0).all() or not np.isfinite(gains.kp).all() or not np.isfinite(gains.kd).all():
        raise ValueError(
            f"key '{key}': received kp {gains.kp.tolist()}, kd {gains.kd.tolist()}; expected finite gains, kd >= 0"
        )


def _check_nominal(nominal: dict[str, Array], joints: tuple[str, ...]) -> list[str]:
    for key, values in nominal.items():
        if np.isnan(values).any() or (values < 0).any():
            raise ValueError(
                f"key 'nominal.{key}': received {values.tolist()}; expected numbers >= 0 for {list(joints)}"
            )
    if (nominal.get("stiffness", np.ones(1)) == 0).any():
        raise ValueError("key 'nominal.stiffness': received 0: the drive would transmit nothing; .inf means rigid")
    return []


def _where(mask: NDArray[np.bool_], joints: tuple[str, ...]) -> str:
    return ", ".join(joint for joint, wrong in zip(joints, mask, strict=True) if wrong)
