"""A recording of a simulated rig: commands, joint offsets, sensor noise, effects that the reader does not know of."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects import parse_effect
from tactile_cube.hand import DLR_HAND2
from tactile_cube.hand.urdf_hand import DESCRIPTIONS
from tactile_cube.measurement.bench import BENCH_KINDS, bench_trials
from tactile_cube.measurement.recordings.description import Coupling, Description, TrialEntry
from tactile_cube.measurement.recordings.rig import Rig, parse_rig, read_rig
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable
from tactile_cube.measurement.replay.model import Model, terms_of
from tactile_cube.measurement.replay.simulator import Simulator
from tactile_cube.measurement.sources.session import SimulatedSession, unmeasured

Array = NDArray[np.float64]
BUILT_IN = {"finger": lambda: DLR_HAND2.finger_urdf(0), "hand": DLR_HAND2.urdf}


@dataclass(frozen=True)
class SimulatedRig(SimulatedSession):
    """Simulates a bench session; `urdf` may also name a description that the package ships."""

    urdf: str = "finger"
    gravity: Sequence[float] = (0.0, 0.0, -9.81)
    joints: Sequence[str] | None = None

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """The recording, and fresh commands on the last initialisation under `validation`."""
        rng, rig = np.random.default_rng(seed), self.rig()
        description = self.description(rig)
        joints = tuple(description.joints)
        effects = terms_of([parse_effect(text) for text in self.hidden], joints)
        true = Model(self.true_constants(joints, rng), effects, {})
        offsets = rng.uniform(-self.offset, self.offset, (self.initialisations, len(joints)))
        free = [kind for kind in self.kinds if kind not in BENCH_KINDS]
        commands, fresh = ({kind: self.free_command(kind, rig, joints, rng) for kind in free} for _ in range(2))
        rig_only = unmeasured(description, rig, true.constants)
        simulator = Simulator(rig_only, [term.effect for term in effects], self.step)

        def played(trials: Iterable[tuple[TrialEntry, Array]]) -> list[TrialTable]:
            return [self.played(e, command, offsets[e.initialisation], simulator, true, rng) for e, command in trials]

        made = played(
            (TrialEntry(file=f"trials/{kind}_{number}.parquet", initialisation=number, kind=kind), command)
            for number in range(self.initialisations)
            for kind, command in commands.items()
        )
        made += played(bench_trials(rig_only, self.kinds, self.initialisations, rng))
        result = {"": RecordingTables(description, rig.text, made)}
        if self.validation:
            last = self.initialisations - 1
            checks = played(
                (TrialEntry(file=f"{kind}.parquet", initialisation=last, kind=kind), command)
                for kind, command in fresh.items()
            )
            result["validation"] = RecordingTables(description, rig.text, checks)
        simulator.close()
        return result

    def rig(self) -> Rig:
        """The mechanism.

        Raises:
            InputError: the URDF cannot be read.
        """
        if self.urdf in BUILT_IN:
            return parse_rig(BUILT_IN[self.urdf](), Path(f"{self.urdf}.urdf"))
        shipped = DESCRIPTIONS / self.urdf
        return read_rig(shipped if shipped.is_file() and not Path(self.urdf).is_file() else Path(self.urdf))

    def description(self, rig: Rig) -> Description:
        """What recording.yaml is to say; by default all joints that mimic no other are actuated."""
        followers = {name: joint.mimics for name, joint in rig.joints.items() if joint.mimics is not None}
        joints = [name for name in rig.joints if name not in followers] if self.joints is None else list(self.joints)
        coupled = {name: Coupling(joint=leader) for name, leader in followers.items() if leader in joints}
        return self.described(self.gravity, joints, coupled)
