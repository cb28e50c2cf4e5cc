"""A load held and twisted in MuJoCo, recorded once, replayed in both engines of today.

The recording: `python -m tactile_cube.record source=grasp out=tests/simulation/recordings/mujoco_grasp
source.engine=mujoco source.weights=[0.15] source.levers=[0.04] source.initialisations=1 source.loosen=1.0
source.rate=50 source.validation=false source.noise=0 source.resolution=0 source.torque_noise=0 source.placing=0
source.offset=0 source.true_spread=0`
"""

from pathlib import Path

import numpy as np
import pytest

from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.hand_replay import ContactModel, HandReplay
from tactile_cube.measurement.replay.model import nominal_model

FOLDER = Path(__file__).parent / "recordings" / "mujoco_grasp"
AS_RECORDED = ContactModel({"spinning_friction": {"radius": 3e-3}})
STICKIER = ContactModel({"spinning_friction": {"radius": 2e-2}})
CLOSED, LOOSE = 5, 60  # rows: after the start, before anything slips


@pytest.fixture(scope="module")
def recording() -> Recording:
    return read_recording(FOLDER)


@pytest.fixture(scope="module", params=["bullet", "mujoco"])
def replay(request: pytest.FixtureRequest, recording: Recording) -> HandReplay:
    return HandReplay(recording, nominal_model(recording), engine=request.param)


def deviation(replay: HandReplay, recording: Recording, kind: str, contact: ContactModel) -> float:
    """Largest deviation of a joint while the load is held [mrad]."""
    (trial,) = [trial for trial in recording.trials if trial.kind == kind]
    simulated = replay.simulate(trial, contact, np.zeros(12)).position
    return 1e3 * float(np.abs(simulated - trial.position)[CLOSED:LOOSE].max())


def test_a_held_load_is_held_alike_and_other_friction_is_told_apart(replay: HandReplay, recording: Recording) -> None:
    engine = replay._world.options.engine
    alike = deviation(replay, recording, "hold", AS_RECORDED)
    assert alike < {"bullet": 4.0, "mujoco": 1.0}[engine]
    assert deviation(replay, recording, "hold", STICKIER) > 3 * alike


def test_a_load_on_a_lever_turns_alike(replay: HandReplay, recording: Recording) -> None:
    alike = deviation(replay, recording, "twist", AS_RECORDED)
    assert alike < 10.0
    assert deviation(replay, recording, "twist", STICKIER) > 1.5 * alike
