"""Recordings of a simulated rig: commands, joint offsets, sensor noise, effects that the reader does not know of."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from tactile_cube.drivetrain.effects import parse_effect
from tactile_cube.hand import DLR_HAND2
from tactile_cube.hand.urdf_hand import DESCRIPTIONS
from tactile_cube.measurement.bench import BENCH_KINDS, bench_trials, excitation, safe_range
from tactile_cube.measurement.recordings.description import Coupling, Description, TrialEntry, per_joint
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.rig import Rig, parse_rig, read_rig
from tactile_cube.measurement.recordings.trial import Array, Gains, Trial
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable
from tactile_cube.measurement.replay.model import Model, terms_of
from tactile_cube.measurement.replay.simulator import Simulated, Simulator
from tactile_cube.measurement.sources.source import described

BUILT_IN = {"finger": lambda: DLR_HAND2.finger_urdf(0), "hand": DLR_HAND2.urdf}
OBSTACLE = 500.0  # [N m/rad] stiffness of what a link touches
SETTLING = 1.0  # [s] at the first command before a trial is logged


@dataclass(frozen=True)
class SimulatedSession:
    """Settings of every simulated bench session; conf/source/finger.yaml and grasp.yaml say what each of them means."""

    controller: Mapping[str, float] = field(default_factory=dict)
    nominal: Mapping[str, float] = field(default_factory=dict)
    true_spread: float = 0.1
    hidden: Sequence[str] = ()
    kinds: Sequence[str] = ("ramps", "multisine", "policy", "holds")
    initialisations: int = 3
    offset: float = 0.02
    duration: float = 12.0
    reach: float = 0.75
    rate: float = 500.0
    noise: float = 2e-4
    resolution: float = 1e-4
    torque_noise: float = 2e-3
    step: float = 2.5e-4
    validation: bool = True

    def described(
        self, gravity: Iterable[float], joints: list[str], coupled: Mapping[str, Coupling], **more: object
    ) -> Description:
        """Build the content of recording.yaml for a rig with these joints."""
        return described(
            gravity=list(gravity), rate_hz=self.rate, joints=joints, coupled=coupled,
            controller=dict(self.controller), nominal=dict(self.nominal),
            sensors={"position_resolution": self.resolution}, **more,
        )  # fmt: skip

    def true_constants(self, joints: tuple[str, ...], rng: np.random.Generator) -> dict[str, Array]:
        """Return gains as stated, and damping, friction and inertia off by up to `true_spread`, joint by joint."""
        stated = {**self.controller, **self.nominal}
        constants = {key: per_joint(value, joints, key) for key, value in stated.items()}
        for key in ("kd", "static_friction", "reflected_inertia"):
            factor = rng.uniform(1 - self.true_spread, 1 + self.true_spread, len(joints))
            constants[key] = constants[key] * factor
        return constants

    def free_command(self, kind: str, rig: Rig, joints: Iterable[str], rng: np.random.Generator) -> Array:
        """Return commands (duration * rate, joints) [rad] of free motion, the middle `reach` of each range."""
        low, high = np.array([safe_range(rig.joints[joint], self.reach) for joint in joints]).T
        return excitation(kind, low, high, self.duration, self.rate, rng)

    def played(
        self, entry: TrialEntry, command: Array, offset: Array, rig: Simulator, true: Model, rng: np.random.Generator
    ) -> TrialTable:
        """Log commands (n, joints) [rad] to a `rig` that holds nothing, with joint offsets (joints,) [rad]."""
        settle = round(SETTLING * self.rate)
        trial = silent_trial(np.pad(command, ((settle, 0), (0, 0)), mode="edge"), rig.recording, entry)
        terms = true.terms
        if entry.touch is not None:  # the obstacle is a hard stop
            stop = {"upper": entry.touch.angle, "stiffness": OBSTACLE, "damping": 0.5}
            terms = (*terms, *terms_of([(f"joint_stop@{entry.touch.joint}", stop)], rig.recording.joints))
        model = Model(true.constants, terms, {trial.initialisation: -offset})
        ((result,),) = rig.free_runs([model], [trial])
        if entry.force is not None:  # a force pulls at the configuration that it leads to
            ((result,),) = rig.free_runs([model], [replace(trial, position=result.position)])
        return self.logged(entry, command, Simulated(result.position[settle:], result.torque[settle:]), rng)

    def logged(self, entry: TrialEntry, command: Array, result: Simulated, rng: np.random.Generator) -> TrialTable:
        """Return a simulated trial, (n, joints) each, as the sensors log it."""
        position = result.position + rng.normal(0, self.noise, command.shape)
        if self.resolution > 0:
            position = np.round(position / self.resolution) * self.resolution
        torque = result.torque + rng.normal(0, self.torque_noise, command.shape)
        return TrialTable(entry, np.arange(len(command)) / self.rate, command, position, torque)


def unmeasured(description: Description, rig: Rig, constants: Mapping[str, Array]) -> Recording:
    """Return the rig as a recording without trials, as the simulators require it."""
    gains = Gains(constants["kp"], constants["kd"], constants["torque_limit"])
    return Recording(Path(), description, rig, gains, {}, ())


def silent_trial(command: Array, rig: Recording, entry: TrialEntry) -> Trial:
    """Return a trial that starts at rest at its first command (joints,) [rad]."""
    time = np.arange(len(command)) / rig.rate
    still = np.broadcast_to(command[0], command.shape)
    signals, valid = (time, command, still, np.zeros_like(command)), np.ones(len(command), dtype=bool)
    said = {key: getattr(entry, key) for key in ("file", "kind", "initialisation", "force", "clamped")}
    return Trial(*signals, name=entry.kind, valid=valid, gains=rig.gains, **said)


@dataclass(frozen=True)
class SimulatedRig(SimulatedSession):
    """Simulates a bench session; `urdf` may also name a description that the package ships."""

    urdf: str = "finger"
    gravity: Sequence[float] = (0.0, 0.0, -9.81)
    joints: Sequence[str] | None = None

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """Simulate the recording, and fresh commands on the last initialisation under `validation`."""
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
        """Read the mechanism; raise an `InputError` if the URDF cannot be read."""
        if self.urdf in BUILT_IN:
            return parse_rig(BUILT_IN[self.urdf](), Path(f"{self.urdf}.urdf"))
        shipped = DESCRIPTIONS / self.urdf
        return read_rig(shipped if shipped.is_file() and not Path(self.urdf).is_file() else Path(self.urdf))

    def description(self, rig: Rig) -> Description:
        """Build the content of recording.yaml; by default all joints that mimic no other are actuated."""
        followers = {name: joint.mimics for name, joint in rig.joints.items() if joint.mimics is not None}
        joints = [name for name in rig.joints if name not in followers] if self.joints is None else list(self.joints)
        coupled = {name: Coupling(joint=leader) for name, leader in followers.items() if leader in joints}
        return self.described(self.gravity, joints, coupled)
