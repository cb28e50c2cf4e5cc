"""A servo that turns a pendulum: its runs, and what its data sheet states, as recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from benchmarks.real_machines.single_joint_urdf import single_joint_urdf
from tactile_cube.measurement.recordings.description import ControllerChange, TrialEntry
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable
from tactile_cube.measurement.sources.source import described

Array = NDArray[np.float64]
Load = tuple[float, float]
"""Mass [kg] at the arm's end and its length [m]."""
LIFT_AND_DROP, LIFT, DROP = "lift_and_drop", "lift", "drop"
OFF = 1e-6  # part of the gains that stays with the torque off: none, but for a division by it


@dataclass(frozen=True)
class Run:
    """A run that is driven throughout, or falls with the torque off.

    Attributes:
        name: unique.
        kind: trajectory; `drop` with the torque off.
        gain: P gain of the firmware.
        load: of the pendulum.
        fitted: whether models of ours are fitted to it.
        time: (n,) [s] from its start.
        command: (n,) [rad].
        position: (n,) [rad].
    """

    name: str
    kind: str
    gain: int
    load: Load
    fitted: bool
    time: Array = field(repr=False)
    command: Array = field(repr=False)
    position: Array = field(repr=False)

    @property
    def driven(self) -> bool:
        """Whether the torque is on."""
        return self.kind != DROP


@dataclass(frozen=True)
class Servo:
    """A servo, what is stated of it, and its runs.

    Attributes:
        name: of the servo.
        runs: all of them.
        volts: of the supply [V].
        duty: of the PWM for one firmware gain at an error of one radian [1/rad].
        most_duty: largest duty [1].
        stall: torque at standstill by the data sheet [N m].
        no_load: speed without torque by the data sheet [rad/s].
        usual_gain: P gain of the firmware from which others are changes.
        static_friction: [N m].
        reflected_inertia: [kg m^2].
        rod: mass of the pendulum's arm [kg].
        rate: of the log [Hz].
        source: of data and constants.
    """

    name: str
    runs: Sequence[Run] = field(repr=False)
    volts: float
    duty: float
    most_duty: float
    stall: float
    no_load: float
    usual_gain: int
    static_friction: float
    reflected_inertia: float
    rod: float
    rate: float
    source: str

    def kp(self, gain: int) -> float:
        """Stiffness [N m/rad] that the data sheet promises of a firmware gain."""
        return gain * self.duty * self.stall

    def recording(self, runs: Sequence[Run]) -> RecordingTables:
        """Runs with one load; gains and rotor are to be identified, as of any hobby servo."""
        mass, length = runs[0].load
        total = mass + self.rod
        middle = (mass + self.rod / 2) * length / total
        inertia = max((mass + self.rod / 3) * length**2 - total * middle**2, 1e-7)  # about the common centre
        description = described(
            gravity=[0.0, 0.0, -9.80665], rate_hz=self.rate, joints=["servo"],
            controller={"kp": self.kp(self.usual_gain), "kd": self.stall / self.no_load},
            nominal={"static_friction": self.static_friction, "reflected_inertia": self.reflected_inertia},
            sensors={"read": "before", "position_resolution": 2 * np.pi / 4096},
            unknown=["kp", "kd", "reflected_inertia"], source=self.source,
        )  # fmt: skip
        urdf = single_joint_urdf(self.name, "servo", total, middle, inertia)
        return RecordingTables(description, urdf, [self._trial(run) for run in runs])

    def _trial(self, run: Run) -> TrialTable:
        share = 1.0 if run.driven else OFF
        controller = ControllerChange(kp=share * self.kp(run.gain), kd=share * self.stall / self.no_load)
        entry = TrialEntry(file=f"trials/{run.name}.parquet", kind=f"{run.kind}_{run.gain}", controller=controller)
        return TrialTable(entry, run.time, run.command[:, None], run.position[:, None])


def pieces(name: str, kind: str, gain: int, load: Load, fitted: bool, columns: Sequence[Array]) -> list[Run]:
    """A run of time, command, position and torque_enable, cut where the torque goes off."""
    time, command, position, on = columns
    end = int(np.argmax(on < 0.5)) if (on < 0.5).any() else len(on)
    parts = [(LIFT if kind == LIFT_AND_DROP else kind, slice(0, end)), (DROP, slice(end, None))]
    return [
        Run(f"{name}_{part}", part, gain, load, fitted, time[rows] - time[rows][0], command[rows], position[rows])
        for part, rows in parts
        if len(time[rows]) > 1
    ]
