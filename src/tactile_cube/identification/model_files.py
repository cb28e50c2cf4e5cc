"""The model file of an identification, and the changes between two of them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version

import numpy as np
from scipy import stats

from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelErrors, ModelFile, Provenance
from tactile_cube.identification.fitting.resolution import NORMAL_95, Fitted, bounds
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import CONTROLLER, Term, nominal_model
from tactile_cube.measurement.units import TURNS, of_joint

UNITS = {
    "kp": "N m/rad",
    "kd": "N m s/rad",
    "torque_limit": "N m",
    "stiffness": "N m/rad",
    "static_friction": "N m",
    "reflected_inertia": "kg m^2",
    "friction_creep": "rad/s per N m",
    "reading_delay": "s",
}
Known = Mapping[tuple[str, str, int, int], tuple[float, float, float]]


def model_file(
    recording: Recording, fitted: Fitted, errors: ModelErrors, held_out: list[str], command: str, seed: int
) -> ModelFile:
    """Return the model file of an identification; an offset is measured minus true, over all initialisations."""
    known, model, offsets = bounds(fitted), fitted.model, dict[str, Estimate]()
    for j, joint in enumerate(recording.joints):
        found = [-float(one[j]) for one in model.offsets.values()]
        offsets[joint] = Estimate(
            value=float(np.mean(found)), low=min(found), high=max(found), unit=recording.units[joint]
        )
    return ModelFile(
        rig=recording.name,
        joints=list(recording.joints),
        values={
            key: {
                joint: _estimate(
                    float(model.constants[key][j]),
                    known.get(("constant", key, j, 0)),
                    of_joint(unit, recording.units[joint]),
                )
                for j, joint in enumerate(recording.joints)
            }
            for key, unit in UNITS.items()
        },
        effects=[effect_estimate(term, place, known, recording.units) for place, term in enumerate(model.terms)],
        offsets=offsets,
        provenance=_provenance(recording, held_out, command, seed),
        errors=errors,
    )


def stated_model(recording: Recording, command: str, seed: int) -> ModelFile:
    """Return the drivetrain that recording.yaml states as a model without intervals; omit unstated constants."""
    every = nominal_model(recording).constants
    values = {
        key: {joint: _estimate(float(v), None, "") for joint, v in zip(recording.joints, row, strict=True)}
        for key, row in every.items()
        if key in (*CONTROLLER, *recording.nominal)
    }
    provenance = _provenance(recording, [], command, seed)
    return ModelFile(rig=recording.name, joints=list(recording.joints), values=values, provenance=provenance)


def _provenance(recording: Recording, held_out: list[str], command: str, seed: int) -> Provenance:
    return Provenance(
        recording=str(recording.folder),
        command=command,
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        version=version("tactile-cube"),
        seed=seed,
        trials=[trial.name for trial in recording.trials if trial.name not in held_out],
        held_out=held_out,
    )


def effect_estimate(term: Term, place: int, known: Known, joints: Mapping[str, str] | None = None) -> EffectEstimate:
    """Return an effect with every parameter; those not fitted have an interval of zero width.

    `joints`: the unit of each joint's position; where none is given, it turns.
    """
    turns_or_slides = (joints or {}).get(term.joint, TURNS)
    units = {p.name: of_joint(p.unit, turns_or_slides) for p in term.effect.parameters}
    parameters = {
        key: _estimate(value, known.get(("effect", key, place, 0)), units[key]) for key, value in term.values.items()
    }
    return EffectEstimate(effect=term.label, parameters=parameters)


def _estimate(value: float, interval: tuple[float, float, float] | None, unit: str) -> Estimate:
    low, high = interval[1:] if interval else (value, value)
    return Estimate(value=value, low=low, high=high, unit=unit)


@dataclass(frozen=True)
class Drift:
    """One number of a model, before and now.

    Attributes:
        name: `PARAMETER@JOINT`, or `EFFECT@JOINT: PARAMETER`.
        before: of the reference.
        now: of the newest recording.
    """

    name: str
    before: Estimate
    now: Estimate

    @property
    def difference(self) -> float:
        """Now less before, in the parameter's unit."""
        return self.now.value - self.before.value

    @property
    def half_width(self) -> float:
        """Of the 95 % interval of the difference: two recordings err independently."""
        halves = [0.5 * (one.high - one.low) for one in (self.before, self.now)]
        return float(np.hypot(halves[0], halves[1]))

    @property
    def p_value(self) -> float:
        """Probability of a difference as large if nothing has changed."""
        return float(2.0 * stats.norm.sf(NORMAL_95 * abs(self.difference) / self.half_width))


def drifts(before: ModelFile, now: ModelFile) -> list[Drift]:
    """Return the change of each parameter with an interval in both models, smallest p-value first.

    Joint offsets are left out: they change at each initialisation of a robot.
    """
    known, found = ({name: one for name, one in _estimates(model) if one.high > one.low} for model in (before, now))
    pairs = [Drift(name, known[name], one) for name, one in found.items() if name in known]
    return sorted(pairs, key=lambda one: one.p_value)


def changed(found: list[Drift], significance: float) -> list[Drift]:
    """Return the significant changes; `significance` holds for all of them together (Bonferroni)."""
    return [one for one in found if one.p_value * len(found) < significance]


def _estimates(model: ModelFile) -> Iterator[tuple[str, Estimate]]:
    for key, joints in model.values.items():
        yield from ((f"{key}@{joint}", one) for joint, one in joints.items())
    for effect in model.drive_effects:
        yield from ((f"{effect.effect}: {key}", one) for key, one in effect.parameters.items())
