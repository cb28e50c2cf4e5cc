"""How well a model follows a recording, and where it fails."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.measurement.comparing import error, regimes
from tactile_cube.measurement.comparing.error import ErrorSummary, FailingInterval, summarise_errors
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor, noise_floor, sensor_noise
from tactile_cube.measurement.comparing.regimes import CrossCorrelation, Regime, Whiteness
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Array
from tactile_cube.measurement.replay.model import Model, draw_model, nominal_model, require_same_joints
from tactile_cube.measurement.replay.simulator import Simulated, Simulator, free_run

COVER = 0.95  # of the simulations lie in the band


@dataclass(frozen=True)
class Band:
    """The middle 95 % of randomised simulations, widened by the sensor's noise."""

    simulations: int
    low: list[Array]  # (n, joints) of each trial [rad]
    high: list[Array]  # likewise
    inside: float  # share of all measured samples in the band
    joints: dict[str, float]  # the same by joint


def simulate_band(
    recording: Recording, model: ModelFile | None, simulations: int, spread: Mapping[str, float], step: float, seed: int
) -> Band:
    """Draw `simulations` sets of constants and simulate every trial with each."""
    rng = np.random.default_rng(seed)
    draws = [draw_model(recording, model, spread, rng) for _ in range(simulations)]
    simulator = Simulator(recording, [term.effect for term in draws[0].terms], step)
    noise = 1.96 * sensor_noise(recording)
    low, high, inside = [], [], []
    for trial in recording.trials:
        ensemble = np.stack([run[0].position for run in simulator.free_runs(draws, [trial])])
        bottom, top = np.quantile(ensemble, [(1 - COVER) / 2, (1 + COVER) / 2], axis=0)
        low.append(bottom - noise)
        high.append(top + noise)
        inside.append(((trial.position >= low[-1]) & (trial.position <= high[-1]))[trial.valid])
    shares = np.concatenate(inside).mean(axis=0)
    by_joint = dict(zip(recording.joints, map(float, shares), strict=True))
    return Band(simulations, low, high, float(shares.mean()), by_joint)


AT_THE_FLOOR = 1.3  # error over floor and time step up to which a model is as good as they can tell
USUAL_STEP = 0.002  # [s] that of the world that training uses
FINER = 8  # times smaller than the simulation's step, to see the error of the step itself
FAR = 1e6  # [rad] beyond which a simulation has diverged, wherever it is
HIDDEN = 0.5  # of the sensor noise: an error of the step that adds an eighth to what a perfect model leaves


@dataclass(frozen=True)
class Comparison:
    """A model beside a recording; every error in rad, residual = measured - simulated, joint offsets removed."""

    recording: Recording
    model: ModelFile | None  # None for what the rig's owner believes
    simulated: list[Simulated]  # one entry a trial
    residuals: list[Array]  # (n, joints) of each trial, nan where a dropped sample was bridged
    errors: ErrorSummary
    trials: list[ErrorSummary]
    raw: list[ErrorSummary]  # RMS from the first state, nothing removed: of all trials together, then of each
    fit: dict[str, float]  # joint -> normalised fit of the free run [%], nothing removed
    floor: NoiseFloor  # what a perfect model would leave
    regimes: list[Regime]
    sentences: list[str]  # the regimes in words
    whiteness: list[Whiteness]
    failing_intervals: list[FailingInterval]
    band: Band | None
    step: float  # of the simulation, at most [s]

    @cached_property
    def cross_correlations(self) -> list[CrossCorrelation]:
        """Signals that correlate with the residuals, the strongest first."""
        return regimes.cross_correlations(self.recording.trials, self.residuals, self.recording.joints)

    @property
    def ratio(self) -> float:
        """Error over noise floor."""
        return self.errors.overall / self.floor.overall

    @property
    def diverged(self) -> bool:
        """Whether the simulation's own time step changes it by more than the joints move, so that it tells nothing."""
        moved = np.concatenate([trial.position for trial in self.recording.trials]).std(axis=0)
        return not self.floor.reachable < float(np.sqrt(np.mean(moved**2)))

    @property
    def at_the_floor(self) -> bool:
        """Whether the model is as good as this recording and this simulator can tell."""
        return not self.diverged and self.errors.overall <= AT_THE_FLOOR * self.floor.reachable


def compare_recording(
    recording: Recording,
    model: ModelFile | None = None,
    step: float | None = None,
    simulations: int = 0,
    spread: Mapping[str, float] | None = None,
    seed: int = 0,
    floor: NoiseFloor | None = None,
) -> Comparison:
    """Simulate every trial freely from its start and describe the residuals.

    A model is simulated with the joint offsets of each initialisation that suit it best; None: the values in
    recording.yaml and no offsets. Steps last `step` [s] at most; None: the usual one, or an eighth of it where the
    sensors would show its error. So many randomised simulations make the band; `spread` has relative half widths of
    constants without an interval, `offset` in rad. The floor is found unless it is known.
    """
    if model is not None:
        require_same_joints(recording, model)
    used = USUAL_STEP if step is None else step

    def simulated_at(step: float) -> tuple[list[Simulated], Model]:
        used = nominal_model(recording, model)
        if model is not None:
            used = error.with_fitted_offsets(Simulator(recording, [term.effect for term in used.terms], step), used)
        return bounded(free_run(recording, used, step)), used

    simulated, fitted = simulated_at(used)
    band = simulate_band(recording, model, simulations, spread or {}, used, seed) if simulations else None
    if floor is None or step is None:
        fine = bounded(free_run(recording, fitted, used / FINER))
        differences = [a.position - b.position for a, b in zip(simulated, fine, strict=True)]
        left = summarise_errors(differences, recording.joints).joints
        noise = dict(zip(recording.joints, sensor_noise(recording), strict=True))
        if step is None and any(left[joint] > HIDDEN * noise[joint] for joint in noise):
            used /= FINER
            finer = 1.0 / (FINER - 1)  # errors of the step are of first order
            left = {joint: finer * size for joint, size in left.items()}
            simulated, _ = simulated_at(used)
        floor = floor or noise_floor(recording, left)
    return describe_comparison(recording, model, simulated, floor, band, used)


def bounded(simulated: Sequence[Simulated]) -> list[Simulated]:
    """Clip simulated values to +-FAR and set nan to FAR, so that a diverging simulation stays finite."""

    def finite(values: Array) -> Array:
        return np.nan_to_num(np.clip(values, -FAR, FAR), nan=FAR)

    return [Simulated(finite(one.position), finite(one.torque)) for one in simulated]


def describe_comparison(
    recording: Recording,
    model: ModelFile | None,
    simulated: list[Simulated],
    floor: NoiseFloor,
    band: Band | None,
    step: float,
) -> Comparison:
    """Compare each trial with its simulation: the residuals, and where they are large."""
    trials, joints, positions = recording.trials, recording.joints, [one.position for one in simulated]
    errors, raw = error.residuals(trials, positions), error.raw_residuals(trials, positions)
    summary = summarise_errors(errors, joints)
    table = regimes.regimes(trials, errors, joints)
    return Comparison(
        recording=recording,
        model=model,
        simulated=simulated,
        residuals=errors,
        errors=summary,
        trials=[summarise_errors([one], joints) for one in errors],
        raw=[summarise_errors(raw, joints), *(summarise_errors([one], joints) for one in raw)],
        fit=error.normalised_fit(trials, raw, joints),
        floor=floor,
        regimes=table,
        sentences=[
            *regimes.where_it_fails(table, summary.joints, floor, recording.shown),
            *(one.sentence(recording.shown[one.joint]) for one in floor.drift),
        ],
        whiteness=regimes.whiteness(trials, errors, joints),
        failing_intervals=[
            interval
            for trial, one in zip(trials, errors, strict=True)
            for k, joint in enumerate(joints)
            for interval in error.failing_intervals(trial.name, joint, trial.time, one[:, k], floor.joints[joint])
        ],
        band=band,
        step=step,
    )


def comparison_json(comparison: Comparison) -> dict[str, Any]:
    """Return the content of comparison.json: plain numbers, errors [rad], times [s]."""
    recording, floor, band = comparison.recording, comparison.floor, comparison.band
    return {
        "recording": str(recording.folder),
        "units": recording.units,
        "error": asdict(comparison.errors),
        "raw_error": asdict(comparison.raw[0]),
        "normalised_fit_percent": comparison.fit,
        "noise_floor": asdict(floor) | ({} if floor.source == "repeats" else {"source": "guess"}),  # scripts know two
        "step": comparison.step,
        "regimes": [asdict(one) for one in comparison.regimes],
        "trials": [
            {"name": trial.name, "file": trial.file, "kind": trial.kind, "initialisation": trial.initialisation}
            | {"error": asdict(errors), "raw_error": asdict(raw)}
            for trial, errors, raw in zip(recording.trials, comparison.trials, comparison.raw[1:], strict=True)
        ],
        "where": comparison.sentences,
        "failing_intervals": [asdict(one) for one in comparison.failing_intervals],
        "whiteness": [asdict(one) for one in comparison.whiteness],
        "cross_correlations": [asdict(one) for one in comparison.cross_correlations],
        "band": band and {"simulations": band.simulations, "inside": band.inside, "joints": band.joints},
        "warnings": list(recording.warnings),
    }
