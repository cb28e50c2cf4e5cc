"""Trials in which the whole hand holds an object, simulated in the world that training uses."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.measurement.recordings.reading import DESCRIPTION
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Array, Trial
from tactile_cube.measurement.replay.model import Model
from tactile_cube.measurement.replay.simulator import Simulated
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, Start, World
from tactile_cube.simulation.contact_effects import contact_catalogue
from tactile_cube.simulation.engine import EngineName

NO_FILTER = 1e-6  # [s] a recording's commands are what reaches the controller, already filtered
RIGID = 1e6  # [N m/rad] of a drive without a stated elasticity
LEAST_INERTIA = 5e-4  # [kg m^2] below which the torque loop is unstable; the world's own value is taken instead
START = 3  # first samples, whose mean is the start


@dataclass(frozen=True)
class ContactModel:
    """Values of contact effects, effect -> parameter -> value; what is left out is neutral."""

    values: Mapping[str, Mapping[str, float]]

    def apply(self, constants: EpisodeConstants) -> EpisodeConstants:
        """Return the constants of an episode with these effects."""
        for name, values in self.values.items():
            constants = contact_catalogue()[name].apply(constants, values)
        return constants

    def without_neutral(self) -> frozenset[tuple[str, str, float]]:
        """Return (effect, parameter, value) of all that differs from the world of the paper."""
        neutral = {(name, p.name): p.neutral for name in self.values for p in contact_catalogue()[name].parameters}
        every = [(name, key, value) for name, values in self.values.items() for key, value in values.items()]
        return frozenset(one for one in every if one[2] != neutral[one[:2]])


def contact_of(model: ModelFile | None) -> ContactModel:
    """Return the contact model of a model file: its effects on fingertips and object."""
    effects = model.object_effects if model is not None else []
    return ContactModel({one.name: {key: e.value for key, e in one.parameters.items()} for one in effects})


class HandReplay:
    """One world for all trials with an object of a recording.

    Attributes:
        finger_of: which finger each joint of the recording belongs to (joints,).
    """

    def __init__(
        self,
        recording: Recording,
        model: Model,
        step: float = 0.002,
        hand: Hand = DLR_HAND2,
        engine: EngineName = "bullet",
    ) -> None:
        """Build the world of a recording of the whole hand; the model's joint offsets are not used.

        Physics steps last `step` [s] at most.

        Raises:
            InputError: the recording is of another mechanism, or its commands are torques.
        """
        _require_hand(recording, hand)
        self.recording, self.hand = recording, hand
        self._order = [recording.joints.index(name) for name in hand.joint_names]
        self._back = np.argsort(self._order)
        self.finger_of = self._back // hand.joints_per_finger
        self._model = model
        substeps = max(1, int(np.ceil(recording.step / step - 1e-6)))
        options = SimulationOptions(engine, recording.step / substeps, substeps)
        self._world = World(hand, options, [term.effect(term.joint, **term.values) for term in model.terms])
        self._nominal = self._constants()

    def close(self) -> None:
        """End the physics server."""
        self._world.close()

    def simulate(self, trial: Trial, contact: ContactModel, offset: Array, until: float = np.inf) -> Simulated:
        """Simulate one trial with an object from its measured start, to `until` [s] at least.

        The sensors' readings are too large by `offset` (joints,) [rad].
        """
        load = trial.load
        assert load is not None, "only trials with an object are simulated here"
        held: dict[str, Any] = {"cube_size": load.size, "cube_mass": load.mass, "cube_com": load.com}
        held |= {"gravity_onset": round(load.released * self.recording.rate), "joint_offset": offset[self._order]}
        constants = contact.apply(replace(self._nominal, **held))
        measured = trial.position[:START].mean(axis=0)
        twist = (trial.gains.kp * (trial.command[0] - measured))[self._order] / np.asarray(constants.stiffness)
        angles = (measured - offset)[self._order] - twist
        place = to_world(self.hand, np.asarray(load.position), np.asarray(load.quaternion))
        self._world.reset(constants, Start(angles, *place, target=trial.command[0, self._order]))
        rows = min(len(trial.time), round(min(until, trial.duration + trial.step) * self.recording.rate))
        position, torque = np.zeros((2, rows, len(self._order)))
        before = self.recording.description.sensors.read == "before"
        for k, command in enumerate(trial.command[:rows, self._order]):
            if not before:
                self._world.step(command)
            position[k], torque[k] = self._world.q_m, self._world.torque
            if before:
                self._world.step(command)
        return Simulated(position[:, self._back], torque[:, self._back])

    def _constants(self) -> EpisodeConstants:
        own = {key: value[self._order] for key, value in self._model.constants.items()}
        inertia, default = own["reflected_inertia"], EpisodeConstants().reflected_inertia
        gravity = self.hand.rotation @ self.recording.gravity
        strength = float(np.linalg.norm(gravity))
        return EpisodeConstants(
            gravity=strength or 1e-9,
            gravity_direction=gravity / strength if strength else (0.0, 0.0, -1.0),
            filter_time=NO_FILTER,
            torque_limit=float(own["torque_limit"].min()),
            kp=own["kp"],
            kd=own["kd"],
            stiffness=np.minimum(own["stiffness"], RIGID),
            static_friction=own["static_friction"],
            reflected_inertia=np.where(inertia < LEAST_INERTIA, default, inertia),
        )


def _require_hand(recording: Recording, hand: Hand) -> None:
    file = recording.folder / DESCRIPTION
    if sorted(recording.joints) != sorted(hand.joint_names):
        raise InputError(
            f"{file}: key 'joints': received {list(recording.joints)}; trials with an object are simulated with the "
            f"whole hand and need its joints {list(hand.joint_names)} and its rig.urdf "
            "(python -m tactile_cube.record source=grasp writes them)"
        )
    if recording.torque_controlled:
        raise InputError(f"{file}: key 'controller.mode': received torque; trials with an object need mode position")


def to_world(hand: Hand, position: Array, quaternion: Array) -> tuple[Array, Array]:
    """Return the position (3,) [m] and quaternion xyzw (4,) in the world of a pose given in the hand's frame."""
    turned = Rotation.from_matrix(hand.rotation) * Rotation.from_quat(np.array(quaternion))
    return hand.position + hand.rotation @ position, np.asarray(turned.as_quat())


def to_hand(hand: Hand, position: Array, quaternion: Array) -> tuple[Array, Array]:
    """Return the position (3,) [m] and quaternion xyzw (4,) in the hand's frame of a pose given in the world."""
    turned = Rotation.from_matrix(hand.rotation.T) * Rotation.from_quat(np.array(quaternion))
    return hand.rotation.T @ (position - hand.position), np.asarray(turned.as_quat())
