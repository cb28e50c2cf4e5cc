"""The free finger against a second physics engine with known constants (recordings beside the repository)."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects import MOTOR_POSITION
from tactile_cube.hand.rigid_body import RigidBodyTree

FOLDER = Path(__file__).parents[3] / "shared" / "recordings" / "finger_plain"
TRUE = DrivetrainConstants(
    kp=3.69,
    kd=(0.23595, 0.22932, 0.22615),
    stiffness=25.0,
    static_friction=(0.02432, 0.02429, 0.01524),
    reflected_inertia=(0.00281, 0.00315, 0.00318),
)
ROW = 0.002  # [s]

pytestmark = pytest.mark.skipif(not FOLDER.exists(), reason="the recordings are not beside the repository")


def columns(trial: pl.DataFrame, what: str) -> np.ndarray:
    return np.ascontiguousarray(trial.select([f"q{k}.{what}" for k in (1, 2, 3)]).to_numpy().astype(float))


@pytest.mark.parametrize(("substeps", "bound"), [(4, 1.0), (1, 1.5)])
def test_every_trial_is_followed_to_a_milliradian(substeps: int, bound: float) -> None:
    plant = Plant([RigidBodyTree.from_urdf((FOLDER / "rig.urdf").read_text())], dt=ROW / substeps)
    memory = plant.memory(TRUE, gravity=(0.0, 0.0, -9.81))
    trials = sorted((FOLDER / "trials").glob("*.parquet"))
    for path in trials:
        trial = pl.read_parquet(path)
        command, measured, torque = (columns(trial, what) for what in ("command", "position", "torque"))
        plant.reset(memory, measured[0] - torque[0] / 25.0)
        out = np.zeros((len(command), 1, 3))
        plant.kernel.rollout(command, 0, substeps, memory, np.array([MOTOR_POSITION]), out)
        error = out[:, 0] - measured
        error -= error.mean(axis=0)  # the joint offset of the trial's initialisation
        rms = 1e3 * np.sqrt(np.mean(error**2, axis=0))
        assert np.all(rms <= bound), f"{path.name}: {rms} mrad"
    assert len(trials) == 12
