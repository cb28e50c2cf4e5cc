"""A recording of a simulated rig: commands, joint offsets, sensor noise, effects that the reader does not know of."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects import parse_effect
from tactile_cube.hand import DLR_HAND2
from tactile_cube.hand.urdf_hand import DESCRIPTIONS
from tactile_cube.measurement.bench import BENCH_KINDS, Bench, bench_trials
from tactile_cube.measurement.recordings.description import Coupling, Description, TrialEntry
from tactile_cube.measurement.recordings.rig import Rig, parse_rig, read_rig
from tactile_cube.measurement.recordings.writing import RecordingTables
from tactile_cube.measurement.replay.model import terms_of
from tactile_cube.measurement.replay.simulator import Engine, Simulator
from tactile_cube.measurement.sources.session import FreeSession, free_command, true_constants, unmeasured
from tactile_cube.measurement.sources.source import described

Array = NDArray[np.float64]
BUILT_IN = {"finger": lambda: DLR_HAND2.finger_urdf(0), "hand": DLR_HAND2.urdf}


@dataclass(frozen=True)
class SimulatedRig:
    """Simulates a bench session.

    Attributes:
        urdf: `finger`, `hand` (of the DLR-Hand II), the path of a URDF, or the name of one that the package ships.
        gravity: (3,) in the base frame [m/s^2].
        controller: kp [N m/rad], kd [N m s/rad], torque_limit [N m].
        nominal: what the owner is to believe: stiffness, static_friction, reflected_inertia.
        true_spread: relative half width by which the true constants differ from what is believed.
        hidden: effects, `NAME@JOINT` or `NAME@JOINT: parameter=value, ...`, that recording.yaml does not mention.
        kinds: kinds of trial, in this order in every initialisation.
        initialisations: how often the robot is initialised anew.
        offset: half width of the joint offsets that an initialisation brings [rad].
        duration: of a trial [s].
        rate: samples per second [Hz].
        reach: share of each joint's range that is used.
        noise: standard deviation of the position [rad].
        resolution: of the position [rad].
        torque_noise: standard deviation of the torque [N m].
        step: simulation step [s]; finer than the one that the reader's model takes.
        engine: `fast` or `pybullet`.
        validation: also write fresh commands into `validation`.
        joints: actuated joints; by default all that mimic no other.
    """

    urdf: str = "finger"
    gravity: Iterable[float] = (0.0, 0.0, -9.81)
    controller: Mapping[str, float] = field(default_factory=dict)
    nominal: Mapping[str, float] = field(default_factory=dict)
    true_spread: float = 0.1
    hidden: Iterable[str] = ()
    kinds: Iterable[str] = ("ramps", "multisine", "policy", "holds")
    initialisations: int = 3
    offset: float = 0.02
    duration: float = 12.0
    rate: float = 500.0
    reach: float = 0.75
    noise: float = 2e-4
    resolution: float = 1e-4
    torque_noise: float = 2e-3
    step: float = 2.5e-4
    engine: Engine = "fast"
    validation: bool = True
    joints: Iterable[str] | None = None

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """The recording, and fresh commands on the last initialisation under `validation`."""
        rng = np.random.default_rng(seed)
        rig = self._rig()
        description = self._description(rig)
        effects = terms_of([parse_effect(text) for text in self.hidden], tuple(description.joints))
        stated = dict(self.controller) | dict(self.nominal)
        constants = true_constants(stated, tuple(description.joints), self.true_spread, rng)
        offsets = rng.uniform(-self.offset, self.offset, (self.initialisations, len(description.joints)))
        commands = {kind: self._command(kind, rig, description, rng) for kind in self.kinds if kind not in BENCH_KINDS}
        fresh = {kind: self._command(kind, rig, description, rng) for kind in commands}
        rig_only = unmeasured(description, rig, constants)
        simulator = Simulator(rig_only, [term.effect for term in effects], self.step, self.engine)
        session = FreeSession(self, simulator, constants, effects, rng)
        last = self.initialisations - 1
        repeated = [
            session.play(TrialEntry(file=f"trials/{kind}_{n}.parquet", initialisation=n, kind=kind), command, offset)
            for n, offset in enumerate(offsets)
            for kind, command in commands.items()
        ]
        bench = bench_trials(Bench(rig, description, rng), self.kinds, self.initialisations)
        benched = [session.play(entry, command, offsets[entry.initialisation]) for entry, command in bench]
        result = {"": RecordingTables(description, rig.text, repeated + benched)}
        if self.validation:
            entries = [TrialEntry(file=f"{kind}.parquet", initialisation=last, kind=kind) for kind in fresh]
            played = [session.play(entry, fresh[entry.kind], offsets[last]) for entry in entries]
            result["validation"] = RecordingTables(description, rig.text, played)
        simulator.close()
        return result

    def _rig(self) -> Rig:
        if self.urdf in BUILT_IN:
            return parse_rig(BUILT_IN[self.urdf](), Path(f"{self.urdf}.urdf"))
        shipped = DESCRIPTIONS / self.urdf
        return read_rig(shipped if shipped.is_file() and not Path(self.urdf).is_file() else Path(self.urdf))

    def _description(self, rig: Rig) -> Description:
        followers = {name: joint.mimics for name, joint in rig.joints.items() if joint.mimics is not None}
        joints = (
            list(self.joints) if self.joints is not None else [name for name in rig.joints if name not in followers]
        )
        coupled = {name: Coupling(joint=leader) for name, leader in followers.items() if leader in joints}
        return described(
            gravity=list(self.gravity), rate_hz=self.rate, joints=joints, coupled=coupled,
            controller=dict(self.controller), nominal=dict(self.nominal),
            sensors={"position_resolution": self.resolution},
        )  # fmt: skip

    def _command(self, kind: str, rig: Rig, description: Description, rng: np.random.Generator) -> Array:
        return free_command(kind, rig, description.joints, self.reach, self.duration, self.rate, rng)
