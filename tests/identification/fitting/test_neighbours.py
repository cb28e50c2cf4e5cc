"""A model that follows another one's path moves the reading as it does on a way of its own."""

from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects.catalogue import catalogue
from tactile_cube.identification.fitting.problem import Shooting
from tactile_cube.identification.search.candidates import candidates
from tactile_cube.identification.search.search import some
from tactile_cube.measurement.comparing.noise_floor import noise_with_links
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.replay.model import nominal_model

SHARED = Path(__file__).parents[4] / "shared" / "recordings" / "finger_friction"

ALIKE = 0.97
STARTS = 1.0  # sensor noise that an effect makes at least, to be seen at all


@pytest.mark.skipif(not SHARED.is_dir(), reason="the shared recordings are not here")
def test_each_law_moves_the_reading_along_a_path_as_by_itself() -> None:
    recording = read_recording(SHARED)
    effects = tuple(catalogue().values())
    shooting, model = Shooting(recording, effects), nominal_model(recording)
    windows = some(shooting.cut(recording, noise_with_links(recording)), 11)
    path = shooting.path(model, windows)
    assert np.array_equal(path.position, shooting.positions([model], windows)[0]), "noting a path changes nothing"
    tried = [one for one in candidates(shooting.sizes, effects) if one.joints == ("q2",)]
    models = [one.added_to(model)[0] for one in tried]
    exact, near = shooting.positions(models, windows), shooting.positions(models, windows, path)
    for one, own, along in zip(tried, (exact - path.position) * windows.weight, near - path.position, strict=True):
        if np.sqrt(np.mean(own**2)) > STARTS:
            along = along * windows.weight
            alike = np.sum(own * along) / np.sqrt(np.sum(own**2) * np.sum(along**2))
            assert alike > ALIKE, one.label
            assert np.sum(along**2) / np.sum(own**2) == pytest.approx(1.0, abs=0.3), one.label
