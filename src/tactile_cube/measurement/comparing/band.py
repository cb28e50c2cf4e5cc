"""N randomised simulations and the share of what was measured that lies among them (figure 4 of the paper)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.measurement.comparing.noise_floor import sensor_noise
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.nominal import draw_model
from tactile_cube.measurement.replay.simulator import Simulator

Array = NDArray[np.float64]
COVER = 0.95  # of the simulations lie in the band


@dataclass(frozen=True)
class Band:
    """The middle 95 % of randomised simulations, widened by the sensor's noise.

    Attributes:
        simulations: how many.
        low: (n, joints) of each trial [rad].
        high: (n, joints) of each trial [rad].
        inside: share of all measured samples in the band.
        joints: the same by joint.
    """

    simulations: int
    low: list[Array]
    high: list[Array]
    inside: float
    joints: dict[str, float]


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
