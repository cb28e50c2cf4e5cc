"""One recording for all tests of the workbench."""

import pytest

from tactile_cube.measurement.recordings.recording import Recording
from tests.workbench.small_bench import stribeck_recording


@pytest.fixture(scope="session")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return stribeck_recording(tmp_path_factory.mktemp("stribeck"))
