"""A rig of any size is a finger with its masses, lengths and times multiplied, and so is what is said of it."""

from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import catalogue, find_effect
from tactile_cube.identification.search.findings import Findings, find
from tactile_cube.identification.search.search import Search
from tactile_cube.measurement.comparing.noise_floor import sensor_noise
from tactile_cube.measurement.joint_scales import joint_scales
from tactile_cube.measurement.split import held_out_split
from tests.identification.rigs_of_any_size import EFFECTS, Size, simulated
from tests.identification.test_verdict import decide

VISCOUS = find_effect("viscous_friction")
FINGER = Size()
SIZES = {
    "a finger's finger": Size(mass=0.01, length=0.1, time=0.1),
    "an excavator": Size(mass=1e4, length=10.0, time=10.0),
    "a machine tool": Size(mass=450.0, length=0.25, slides=True),
}


def findings(folder: Path, size: Size) -> Findings:
    """What a search among a few effects finds of a rig that hides viscous friction."""
    recording = simulated(folder, size, VISCOUS, {"damping": 0.08 * size.damping})
    fitted, held_out = held_out_split(recording)
    return find(Search(fitted, held_out, sensor_noise(recording), EFFECTS, lambda line: None))


@pytest.mark.parametrize("name", SIZES)
def test_a_rig_of_any_size_is_diagnosed_alike(name: str, tmp_path: Path) -> None:
    verdict = decide(findings(tmp_path, SIZES[name]))
    assert verdict.kind == "missing_effect"
    assert [c.effect.name for c in verdict.chosen.effects] == ["viscous_friction"]
    assert verdict.chosen.error == pytest.approx(1.0, abs=0.1)
    (term,) = verdict.chosen.fit.model.terms
    # positions read a little earlier or later within their rows damp as well
    assert term.values["damping"] / SIZES[name].damping == pytest.approx(0.08, rel=0.2)


@pytest.mark.parametrize("name", ["a finger's finger", "an excavator"])
def test_every_number_of_an_effect_scales_with_the_rig(name: str, tmp_path: Path) -> None:
    size, (small, large) = SIZES[name], (tmp_path / "small", tmp_path / "large")
    small.mkdir(), large.mkdir()
    (finger,) = joint_scales(simulated(small, FINGER, VISCOUS, {"damping": 0.08}))
    (other,) = joint_scales(simulated(large, size, VISCOUS, {"damping": 0.08 * size.damping}))
    units = {"N m": size.torque, "rad": 1.0, "s": size.time, "kg m^2": size.inertia, "kg": size.mass, "m": size.length}
    units |= {"N m s/rad": size.damping, "rad/s": 1.0 / size.time, "N m/rad^3": size.torque, "1": 1.0, "1/rad": 1.0}
    for effect in catalogue().values():
        before, after = effect.parameters_at(finger), effect.parameters_at(other)
        for key, p in before.items():
            if p.unit in units:
                wanted = np.array([p.low, p.neutral, p.typical, p.high]) * units[p.unit]
                scaled = [after[key].low, after[key].neutral, after[key].typical, after[key].high]
                assert scaled == pytest.approx(wanted, rel=0.01), (effect.name, key)
