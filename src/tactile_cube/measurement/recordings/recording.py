"""What was measured on a rig: its description, the mechanism, the controller and the trials."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError
from tactile_cube.hand import rigid_body
from tactile_cube.measurement.recordings.description import Description
from tactile_cube.measurement.recordings.rig import Rig
from tactile_cube.measurement.recordings.trial import Array, Gains, Trial
from tactile_cube.measurement.units import SLIDES, TURNS


@dataclass(frozen=True)
class Recording:
    """What was measured on a rig."""

    folder: Path  # where it lies
    description: Description  # recording.yaml
    rig: Rig  # the mechanism
    gains: Gains  # of the controller, each of shape (joints,)
    nominal: dict[str, Array]  # what the owner believes, key -> (joints,)
    trials: tuple[Trial, ...]  # in the order of recording.yaml
    warnings: tuple[str, ...] = ()  # what was odd but could be used, one line each

    @property
    def name(self) -> str:
        """The folder's name."""
        return self.folder.resolve().name

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints in column order."""
        return tuple(self.description.joints)

    @property
    def linked(self) -> NDArray[np.int64]:
        """Joints with a sensor on their link in any trial."""
        return np.unique(np.concatenate([trial.linked for trial in self.trials]))

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

    def substeps(self, longest: float) -> int:
        """Return the simulation steps a sample: none longer than `longest` [s], nor than the controller's period."""
        control = self.description.controller.rate_hz or self.rate
        return max(1, math.ceil(self.step / longest - 1e-6), round(control / self.rate))

    @property
    def urdf(self) -> str:
        """Text of the URDF."""
        return self.rig.text

    def with_controller_rate(self, rate: float) -> Self:
        """Return the recording with a controller that computes its torque at `rate` [Hz]."""
        controller = self.description.controller.model_copy(update={"rate_hz": rate})
        return replace(self, description=self.description.model_copy(update={"controller": controller}))

    @property
    def torque_controlled(self) -> bool:
        """Whether commands are torques [N m], of a motor's voltage too."""
        return self.description.controller.mode != "position"

    @property
    def units(self) -> dict[str, str]:
        """Joint -> unit of its position: `rad` where it turns, `m` where it slides; torques are N m or N likewise."""
        return {joint: SLIDES if self.rig.joints[joint].prismatic else TURNS for joint in self.joints}

    @property
    def shown(self) -> dict[str, str]:
        """Joint -> unit in which people read its position: `deg` where its log has degrees, else as `units`."""
        said = self.description.shown_in
        return {joint: said.get(joint, unit) if unit == TURNS else unit for joint, unit in self.units.items()}

    def stated(self, constant: str, joint: str) -> float | None:
        """Return the owner's value of a constant of one joint, or None if the owner states none."""
        values: Array | None = getattr(self.gains, constant, self.nominal.get(constant))
        if values is None or constant in self.description.unknown:
            return None
        return float(values[self.joints.index(joint)])

    def rigid_body(self) -> rigid_body.RigidBodyTree:
        """Build the mechanism. Raises InputError: the URDF and the joints of recording.yaml define no mechanism."""
        coupled = {name: rigid_body.Mimic(c.joint, c.ratio, c.offset) for name, c in self.description.coupled.items()}
        try:
            return rigid_body.RigidBodyTree.from_urdf(self.rig.text, self.joints, coupled)
        except InputError as error:
            raise InputError(f"{self.rig.path}: {error}") from None

    def with_trials(self, trials: list[Trial] | tuple[Trial, ...]) -> Self:
        """Return the recording with only these trials."""
        return replace(self, trials=tuple(trials))
