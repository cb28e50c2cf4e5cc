"""A recording of the whole simulated hand that holds and twists known loads.

Hold: four fingertips squeeze a box of known weight, somebody lets go of it, and the grip loosens slowly until the box
slips out: sideways force over normal force is then the lateral friction. Twist: two opposing fingertips hold a box with
a weight on a lever, and the grip loosens until the box swings down: torque over normal force is the spinning friction.
Free motion of the empty hand, in the same initialisations, shows the drivetrain that holds the load.

Source: paper, section II-D: lateral and spinning friction from the torque needed to hold a known load.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.drivetrain.effects import parse_effect
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, grasp_angles
from tactile_cube.measurement.bench import KINDS as EXCITATIONS
from tactile_cube.measurement.recordings.description import Coupling, Description, Grasp, TrialEntry
from tactile_cube.measurement.recordings.rig import parse_rig
from tactile_cube.measurement.recordings.trial import Array
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable
from tactile_cube.measurement.replay.hand_replay import ContactModel, HandReplay, to_hand
from tactile_cube.measurement.replay.model import Model, terms_of
from tactile_cube.measurement.replay.simulator import Simulator
from tactile_cube.measurement.sources.simulated_rig import SimulatedSession, silent_trial, unmeasured
from tactile_cube.simulation.contact_effects import find_any_effect, is_contact_effect
from tactile_cube.simulation.engine import EngineName

CLEARANCE, RETRACTED = 3e-3, 2e-2  # [m] of open fingertips and of fingers that do not take part, off their faces
CLOSE, WAIT, CARRY = 0.6, 0.3, 0.3  # [s] to close, until the weight acts, and until the grip loosens
HOLDING = {"hold": (0, 1, 2, 3), "twist": (1, 3)}  # fingers; middle and thumb oppose each other


@dataclass(frozen=True)
class SimulatedGrasp(SimulatedSession):
    """Simulates the bench tests of friction."""

    kinds: Sequence[str] = ("hold", "twist")
    initialisations: int = 4
    duration: float = 8.0
    rate: float = 100.0
    step: float = 0.001
    size: float = 0.08
    weights: Sequence[float] = (0.15, 0.25)
    levers: Sequence[float] = (0.02, 0.06, 0.15)
    lever_weight: float = 0.1
    placing: float = 0.001
    squeeze: float = 0.02
    loosen: float = 2.0
    engine: EngineName = "bullet"

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """Simulate the recording, and a further initialisation under `validation`."""
        unknown = set(self.kinds) - set(HOLDING) - set(EXCITATIONS)
        if unknown:
            known = ", ".join([*HOLDING, *EXCITATIONS])
            raise InputError(f"source.kinds: unknown {sorted(unknown)}; choose from {known}")
        rng = np.random.default_rng(seed)
        gravity, urdf = DLR_HAND2.rotation.T @ [0.0, 0.0, -9.81], DLR_HAND2.urdf()
        coupled = {f"{finger.name}_q4": Coupling(joint=f"{finger.name}_q3") for finger in DLR_HAND2.fingers}
        held = {"size": self.size, "mass": next(iter(self.weights))}
        description = self.described(gravity.tolist(), list(DLR_HAND2.joint_names), coupled, object=held)
        session = self._session(description, urdf, rng)
        rig, joints = session.free.recording.rig, DLR_HAND2.joint_names
        free = [kind for kind in self.kinds if kind in EXCITATIONS]
        commands, fresh = ({kind: self.free_command(kind, rig, joints, rng) for kind in free} for _ in range(2))
        rounds = [session.initialisation(number, "trials/", commands) for number in range(self.initialisations)]
        result = {"": RecordingTables(description, urdf, [table for tables in rounds for table in tables])}
        if self.validation:
            last = session.initialisation(self.initialisations, "", fresh)
            result["validation"] = RecordingTables(description, urdf, last)
        session.loaded.close()
        session.free.close()
        return result

    def _session(self, description: Description, urdf: str, rng: np.random.Generator) -> _Session:
        joints = tuple(description.joints)
        constants = self.true_constants(joints, rng)
        hidden = [parse_effect(text, find_any_effect) for text in self.hidden]
        drive = terms_of([one for one in hidden if not is_contact_effect(one[0])], joints)
        contact = ContactModel({name: values for name, values in hidden if is_contact_effect(name)})
        true = Model(constants, drive, {})
        recording = unmeasured(description, parse_rig(urdf, Path("hand.urdf")), constants)
        free = Simulator(recording, [term.effect for term in drive], self.step)
        return _Session(self, free, HandReplay(recording, true, self.step, engine=self.engine), true, contact, rng)


@dataclass(frozen=True)
class _Session:
    settings: SimulatedGrasp
    free: Simulator
    loaded: HandReplay
    true: Model
    contact: ContactModel
    rng: np.random.Generator

    def initialisation(self, number: int, folder: str, commands: Mapping[str, Array]) -> list[TrialTable]:
        """Simulate every free motion and every load once, with the joint offsets of a new initialisation."""
        s = self.settings
        offset = self.rng.uniform(-s.offset, s.offset, len(DLR_HAND2.joint_names))
        tables = [
            s.played(
                TrialEntry(file=f"{folder}{kind}_{number}.parquet", initialisation=number, kind=kind),
                command, offset, self.free, self.true, self.rng,
            )
            for kind, command in commands.items()
        ]  # fmt: skip
        loads: list[tuple[str, dict[str, object]]] = []
        if "hold" in s.kinds:
            loads += [("hold", {"mass": weight}) for weight in s.weights]
        if "twist" in s.kinds:
            loads += [("twist", {"mass": s.lever_weight, "com": [0.0, lever, 0.0]}) for lever in s.levers]
        place, quaternion = to_hand(DLR_HAND2, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
        start = {"position": place.tolist(), "quaternion": quaternion.tolist(), "released": round(CLOSE + WAIT, 6)}
        for index, (kind, load) in enumerate(loads):
            grasp, file = Grasp.model_validate(start | load), f"{folder}{kind}_{number}_{index}.parquet"
            entry = TrialEntry(file=file, initialisation=number, kind=kind, object=grasp)
            tables.append(self._played(entry, grasp, offset))
        return tables

    def _played(self, entry: TrialEntry, grasp: Grasp, offset: Array) -> TrialTable:
        s, command, recording = self.settings, self._command(entry.kind), self.loaded.recording
        assert recording.description.object is not None
        placed = grasp.position + self.rng.uniform(-s.placing, s.placing, 3)
        load = grasp.of(recording.description.object).model_copy(update={"position": placed})
        trial = replace(silent_trial(command, recording, entry), torque=None, load=load)
        return s.logged(entry, command, self.loaded.simulate(trial, self.contact, offset), self.rng)

    def _command(self, kind: str) -> Array:
        """Return the commands (n, 12) [rad]: close, carry, loosen; fingers that take no part stay away."""
        s = self.settings
        size, centre, upright = [s.size] * 3, [0.0, 0.0, 0.0], Rotation.identity().as_quat()
        apart, pressed, away = (
            grasp_angles(DLR_HAND2, size, centre, upright, gap).reshape(-1, 3)
            for gap in (CLEARANCE, -s.squeeze, RETRACTED)
        )
        taking_part = np.isin(np.arange(len(away)), HOLDING[kind])[:, None]
        opened, squeezed = (np.where(taking_part, one, away).ravel() for one in (apart, pressed))
        corners = np.cumsum([0.0, CLOSE, WAIT + CARRY, s.loosen])
        time = np.arange(round(corners[-1] * s.rate)) / s.rate
        share = np.interp(time, corners, [0.0, 1.0, 1.0, 0.0])
        return np.asarray(opened + share[:, None] * (squeezed - opened))
