"""A recording of one joint with a hidden Stribeck effect, for tests that need a workbench."""

from pathlib import Path
from typing import Any

from tactile_cube.drivetrain.effects import JOINT_TORQUE, VELOCITY, Effect, Parameter, Stage, find_effect
from tactile_cube.measurement.recordings.recording import Recording
from tests.identification.rigs_of_any_size import Size, simulated

HIDDEN = {"excess": 0.3, "velocity": 0.5}
STRIBECK = "stribeck_friction@a"


def stribeck_recording(folder: Path) -> Recording:
    """Four trials of 3 s, two of each of two kinds."""
    return simulated(folder, Size(), find_effect("stribeck_friction"), HIDDEN)


OWN = "tests.workbench.small_bench.OwnDrag"


class OwnDrag(Effect):
    """A user's own effect."""

    name, stage = "own_drag", Stage.JOINT_TORQUE
    parameters = (Parameter("damping", "N m s/rad", 0.0, 0.0, 1.0, 0.01, "a test"),)

    @staticmethod
    def law(x: Any, j: Any, p: Any, s: Any, dt: Any) -> Any:
        return x[JOINT_TORQUE, j] - p[0] * x[VELOCITY, j]
