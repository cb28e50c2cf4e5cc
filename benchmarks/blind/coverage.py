"""How often do 95 % intervals hold the truth? Draws recordings, fits the true effect, counts.

    python -m benchmarks.blind.coverage --draws 20

Every draw is a pendulum-like joint of its own, recorded in three initialisations with one hidden effect of known size;
`identify` is told the effect's name and not its size; details of a law stay at their standard values. Counted are the
effect's parameters and the constants fitted beside it. Writes coverage.json with every interval and its truth. With
`--step 0.002` the recorded world takes the model's own steps: what is missed even then is the intervals' fault, what is
missed in the finer world alone is the time step's. `--told` states that world's rate as controller.rate_hz, and the fit
follows it. `--beside cogging@j` hides another effect, which nobody tells: the model is wrong then, and not its numbers
alone.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import yaml
from scipy import stats

import tactile_cube
from benchmarks.real_machines.single_joint_urdf import single_joint_urdf
from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.sources.simulated_rig import SimulatedRig

EFFECTS = ("viscous_friction", "stribeck_friction", "command_delay", "payload", "torque_gain", "coulomb_friction")
CONTROLLER = {"kp": 3.69, "kd": 0.25, "torque_limit": 1.0}
NOMINAL = {"stiffness": 25.0, "static_friction": 0.02, "reflected_inertia": 0.003}
SIZE = (0.7, 1.3)  # of an effect's typical values


@dataclass(frozen=True)
class Interval:
    """One fitted number beside its truth."""

    draw: int
    name: str
    truth: float
    value: float
    low: float
    high: float

    @property
    def holds(self) -> bool:
        """Whether the interval holds the truth."""
        return self.low <= self.truth <= self.high


def drawn(draw: int, seed: int, step: float, told: bool, beside: list[str], folder: Path) -> list[Interval]:
    """The intervals of one draw, recorded in simulation steps of `step` [s], and `told` as the controller's rate.

    `beside`: effects that are hidden as well, and not told.
    """
    rng = np.random.default_rng([seed, draw])
    effect = find_effect(EFFECTS[draw % len(EFFECTS)])
    standard = [one for one in effect.parameters if one.name not in effect.details]
    truth = {one.name: float(one.typical * rng.uniform(*SIZE)) for one in standard}
    urdf = folder / f"{draw}.urdf"
    urdf.write_text(single_joint_urdf("rig", "j", rng.uniform(0.05, 0.15), rng.uniform(0.03, 0.08), limit=1.2))
    hidden = f"{effect.name}@j: " + ", ".join(f"{name}={value:.6g}" for name, value in truth.items())
    source = SimulatedRig(
        urdf=str(urdf), controller=CONTROLLER, nominal=NOMINAL, hidden=[hidden, *beside], duration=6.0, true_spread=0.0,
        step=step, kinds=["ramps", "multisine", "policy"], validation=False,
    )  # fmt: skip
    write_recording(folder / str(draw), source.recordings(int(rng.integers(2**31)))[""])
    if told:
        _tell(folder / str(draw) / "recording.yaml", 1 / step)
    fitted = tactile_cube.identify(folder / str(draw), [f"{effect.name}@j"], say=lambda line: None).model
    known = CONTROLLER | NOMINAL
    constants = [(key, known[key], one["j"]) for key, one in fitted.values.items() if key in known and "j" in one]
    parameters = [
        (f"{effect.name}.{name}", truth[name], one)
        for name, one in fitted.effects[0].parameters.items()
        if name in truth
    ]
    return [
        Interval(draw, name, value, one.value, one.low, one.high)
        for name, value, one in [*constants, *parameters]
        if one.high > one.low
    ]


def _tell(file: Path, rate: float) -> None:
    """State in recording.yaml how often the controller computed its torque [Hz]."""
    said = yaml.safe_load(file.read_text())
    said["controller"]["rate_hz"] = rate
    file.write_text(yaml.safe_dump(said))


def summary(intervals: list[Interval]) -> str:
    """Counts by parameter and over all, with the 95 % interval that so few draws leave (Clopper and Pearson)."""
    lines = []
    for name in [*dict.fromkeys(one.name for one in intervals), "all"]:
        chosen = [one for one in intervals if name in ("all", one.name)]
        held, count = sum(one.holds for one in chosen), len(chosen)
        low, high = stats.binomtest(held, count).proportion_ci() if count else (0.0, 1.0)
        lines.append(
            f"{name:<36}{held:>4} of {count:<4} {100 * held / count:>5.0f} %  ({100 * low:.0f} .. {100 * high:.0f})"
        )
    return "\n".join(lines)


def main() -> None:
    """All draws, then the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--step", type=float, default=2.5e-4, help="of the recorded world [s]; the model takes 0.002")
    parser.add_argument("--told", action="store_true", help="recording.yaml states the rate of the world's controller")
    parser.add_argument("--beside", action="append", default=[], help="an effect that is hidden as well and not told")
    parser.add_argument("--out", type=Path, default=Path("outputs/coverage"))
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    intervals: list[Interval] = []
    with tempfile.TemporaryDirectory() as folder:
        for draw in range(given.draws):
            intervals += drawn(draw, given.seed, given.step, given.told, given.beside, Path(folder))
            rows = [asdict(one) | {"holds": one.holds} for one in intervals]
            (given.out / "coverage.json").write_text(json.dumps(rows, indent=1), encoding="utf-8")
            print(f"{draw + 1} of {given.draws} draws\n{summary(intervals)}", flush=True)


if __name__ == "__main__":
    main()
