"""A recording of the whole simulated hand that holds and twists known loads.

Hold: four fingertips squeeze a box of known weight, somebody lets go of it, and the grip loosens slowly until the box
slips out: sideways force over normal force is then the lateral friction. Twist: two opposing fingertips hold a box with
a weight on a lever, and the grip loosens until the box swings down: torque over normal force is the spinning friction.
Free motion of the empty hand, in the same initialisations, shows the drivetrain that holds the load.

Source: paper, section II-D: lateral and spinning friction from the torque needed to hold a known load.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactile_cube.drivetrain.effects import parse_effect
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, grasp_angles
from tactile_cube.measurement.excitation import KINDS as EXCITATIONS
from tactile_cube.measurement.recordings.description import Coupling, Description, Grasp, TrialEntry
from tactile_cube.measurement.recordings.rig import parse_rig
from tactile_cube.measurement.recordings.trial import Trial, load_of
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable
from tactile_cube.measurement.replay.hand_replay import ContactModel, HandReplay, to_hand
from tactile_cube.measurement.replay.model import Model, terms_of
from tactile_cube.measurement.replay.simulator import Simulator
from tactile_cube.measurement.sources.session import FreeSession, free_command, logged, true_constants, unmeasured
from tactile_cube.measurement.sources.source import described
from tactile_cube.simulation.contact_effects import find_any_effect, is_contact_effect
from tactile_cube.simulation.options import EngineName

Array = NDArray[np.float64]
CLEARANCE, RETRACTED = 3e-3, 2e-2  # [m] of open fingertips and of fingers that do not take part, off their faces
CLOSE, WAIT, CARRY = 0.6, 0.3, 0.3  # [s] to close, until the weight acts, and until the grip loosens
HOLDING = {"hold": (0, 1, 2, 3), "twist": (1, 3)}  # fingers; middle and thumb oppose each other


@dataclass(frozen=True)
class SimulatedGrasp:
    """Simulates the bench tests of friction.

    Attributes:
        controller: kp [N m/rad], kd [N m s/rad], torque_limit [N m].
        nominal: what the owner is to believe: stiffness, static_friction, reflected_inertia.
        size: edge length of the box [m].
        weights: of the loads that are held [kg].
        levers: between the box's centre and the weight when it is twisted [m].
        lever_weight: of box and weight then [kg].
        true_spread: relative half width by which the true drivetrain differs from what is believed.
        hidden: effects that recording.yaml does not mention, of the contact (`lateral_friction: coefficient=0.6`) or of
            the drivetrain (`stribeck_friction@ring_q3`).
        kinds: `hold`, `twist`, and kinds of free motion (`ramps`, `holds`, `steps`, `multisine`, `policy`).
        initialisations: how often the robot is initialised anew.
        offset: half width of the joint offsets that an initialisation brings [rad].
        placing: half width of the error with which the box is put in its place [m].
        squeeze: how deep inside the faces the fingertips aim [m].
        loosen: how long the grip takes to loosen [s].
        duration: of a trial of free motion [s].
        reach: share of each joint's range that free motion uses.
        rate: samples per second [Hz].
        noise: standard deviation of the position [rad].
        resolution: of the position [rad].
        torque_noise: standard deviation of the torque [N m].
        step: simulation step [s]; finer than the reader's.
        engine: of the world in which loads are held: bullet or mujoco.
        validation: also record a further initialisation into `validation`.
    """

    controller: Mapping[str, float] = field(default_factory=dict)
    nominal: Mapping[str, float] = field(default_factory=dict)
    size: float = 0.08
    weights: Iterable[float] = (0.15, 0.25)
    levers: Iterable[float] = (0.02, 0.06, 0.15)
    lever_weight: float = 0.1
    true_spread: float = 0.1
    hidden: Iterable[str] = ()
    kinds: Iterable[str] = ("hold", "twist")
    initialisations: int = 4
    offset: float = 0.02
    placing: float = 0.001
    squeeze: float = 0.02
    loosen: float = 2.0
    duration: float = 8.0
    reach: float = 0.75
    rate: float = 100.0
    noise: float = 2e-4
    resolution: float = 1e-4
    torque_noise: float = 2e-3
    step: float = 0.001
    engine: EngineName = "bullet"
    validation: bool = True

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """The recording, and a further initialisation under `validation`."""
        unknown = set(self.kinds) - set(HOLDING) - set(EXCITATIONS)
        if unknown:
            known = ", ".join([*HOLDING, *EXCITATIONS])
            raise InputError(f"source.kinds: unknown {sorted(unknown)}; choose from {known}")
        rng = np.random.default_rng(seed)
        description, urdf = self._description(), DLR_HAND2.urdf()
        session = self._session(description, urdf, rng)
        commands, fresh = self._free_commands(session, rng), self._free_commands(session, rng)
        rounds = [session.initialisation(number, "trials/", commands) for number in range(self.initialisations)]
        result = {"": RecordingTables(description, urdf, [table for tables in rounds for table in tables])}
        if self.validation:
            last = session.initialisation(self.initialisations, "", fresh)
            result["validation"] = RecordingTables(description, urdf, last)
        session.close()
        return result

    def _free_commands(self, session: _Session, rng: np.random.Generator) -> dict[str, Array]:
        """Commands of each kind of free motion, the same in every initialisation."""
        rig, joints = session.free.simulator.recording.rig, list(DLR_HAND2.joint_names)
        return {
            kind: free_command(kind, rig, joints, self.reach, self.duration, self.rate, rng)
            for kind in self.kinds
            if kind in EXCITATIONS
        }

    def _description(self) -> Description:
        gravity = DLR_HAND2.rotation.T @ [0.0, 0.0, -9.81]
        coupled = {f"{finger.name}_q4": Coupling(joint=f"{finger.name}_q3") for finger in DLR_HAND2.fingers}
        return described(
            gravity=gravity.tolist(), rate_hz=self.rate, joints=list(DLR_HAND2.joint_names), coupled=coupled,
            controller=dict(self.controller), nominal=dict(self.nominal),
            sensors={"position_resolution": self.resolution},
            object={"size": self.size, "mass": next(iter(self.weights))},
        )  # fmt: skip

    def _session(self, description: Description, urdf: str, rng: np.random.Generator) -> _Session:
        joints = tuple(description.joints)
        stated = dict(self.controller) | dict(self.nominal)
        constants = true_constants(stated, joints, self.true_spread, rng)
        hidden = [parse_effect(text, find_any_effect) for text in self.hidden]
        drive = terms_of([one for one in hidden if not is_contact_effect(one[0])], joints)
        contact = ContactModel({name: values for name, values in hidden if is_contact_effect(name)})
        recording = unmeasured(description, parse_rig(urdf, Path("hand.urdf")), constants)
        rig = Simulator(recording, [term.effect for term in drive], self.step)
        free = FreeSession(self, rig, constants, drive, rng)
        simulator = HandReplay(recording, Model(constants, drive, {}), self.step, engine=self.engine)
        return _Session(self, simulator, contact, free, rng)


@dataclass(frozen=True)
class _Session:
    """One hand with its true constants, its sensors, and somebody who puts the box in its place."""

    settings: SimulatedGrasp
    simulator: HandReplay
    contact: ContactModel
    free: FreeSession
    rng: np.random.Generator

    def close(self) -> None:
        """End the simulations."""
        self.simulator.close()
        self.free.simulator.close()

    def initialisation(self, number: int, folder: str, commands: Mapping[str, Array]) -> list[TrialTable]:
        """Every free motion and every load once, with the joint offsets of a new initialisation."""
        s = self.settings
        offset = self.rng.uniform(-s.offset, s.offset, len(DLR_HAND2.joint_names))
        entries = [
            TrialEntry(file=f"{folder}{kind}_{number}.parquet", initialisation=number, kind=kind) for kind in commands
        ]
        tables = [self.free.play(entry, commands[entry.kind], offset) for entry in entries]
        loads: list[tuple[str, dict[str, object]]] = []
        if "hold" in s.kinds:
            loads += [("hold", {"mass": weight}) for weight in s.weights]
        if "twist" in s.kinds:
            loads += [("twist", {"mass": s.lever_weight, "com": [0.0, lever, 0.0]}) for lever in s.levers]
        place, quaternion = to_hand(DLR_HAND2, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
        for index, (kind, load) in enumerate(loads):
            grasp = Grasp.model_validate(
                {
                    "position": place.tolist(),
                    "quaternion": quaternion.tolist(),
                    "released": round(CLOSE + WAIT, 6),
                    **load,
                }
            )
            name = f"{folder}{kind}_{number}_{index}.parquet"
            tables.append(self._play(TrialEntry(file=name, initialisation=number, kind=kind, object=grasp), offset))
        return tables

    def _play(self, entry: TrialEntry, offset: Array) -> TrialTable:
        """Simulate one trial and log it as the sensors would."""
        s, command = self.settings, self._command(entry.kind)
        held, grasp = self.simulator.recording.description.object, entry.object
        assert held is not None
        assert grasp is not None
        load = load_of(held, grasp)
        load.position[:] += self.rng.uniform(-s.placing, s.placing, 3)
        time = np.arange(len(command)) / s.rate
        still = np.broadcast_to(command[0], command.shape)  # open fingers stand where they were told to
        gains = self.simulator.recording.gains
        trial = Trial(entry.kind, entry.file, entry.kind, entry.initialisation, time, command, still, None,
                      np.ones(len(command), dtype=bool), gains, load=load)  # fmt: skip
        result = self.simulator.simulate(trial, self.contact, offset)
        return logged(entry, command, result, s, self.rng)

    def _command(self, kind: str) -> Array:
        """Commands (n, 12) [rad]: close, carry, loosen; fingers that take no part stay away."""
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
