"""How often does `monitor` raise a false alarm, and what does it find? Draws machines, records them twice, counts.

    python -m benchmarks.blind.monitor --draws 20

Every draw is a pendulum-like joint of its own with viscous friction of its own size, identified from a first
recording. A second one, with other commands, noise and joint offsets, is of the same machine (a null); a third of a
machine that has changed: in turn it has more of that friction, less torque, play or a delay. Writes monitor.json.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

import tactile_cube
from benchmarks.real_machines.single_joint_urdf import single_joint_urdf
from tactile_cube.api.monitoring import MonitorResult
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.sources.simulated_rig import SimulatedRig

CONTROLLER = {"kp": 3.69, "kd": 0.25, "torque_limit": 1.0}
NOMINAL = {"stiffness": 25.0, "static_friction": 0.02, "reflected_inertia": 0.003}
KNOWN = "viscous_friction"
MORE_FRICTION = "half as much viscous friction again"
CHANGES = (MORE_FRICTION, "torque_gain@j: error=-0.1", "backlash@j: play=0.02", "command_delay@j: delay=0.008")
"""A number of the model that grows, and effects that were not there."""


def quiet(line: str) -> None:
    """Takes lines of progress."""


def drawn(draw: int, seed: int, significance: float, folder: Path) -> dict[str, Any]:
    """What monitor says of an unchanged and of a changed machine."""
    rng = np.random.default_rng([seed, draw])
    urdf = folder / f"{draw}.urdf"
    urdf.write_text(single_joint_urdf("rig", "j", rng.uniform(0.05, 0.15), rng.uniform(0.03, 0.08), limit=1.2))
    damping, change = float(rng.uniform(0.02, 0.06)), CHANGES[draw % len(CHANGES)]

    def recorded(name: str, *hidden: str, friction: float = damping) -> Path:
        source = SimulatedRig(
            urdf=str(urdf), controller=CONTROLLER, nominal=NOMINAL, duration=6.0, true_spread=0.0,
            hidden=[f"{KNOWN}@j: damping={friction:.6g}", *hidden], kinds=["ramps", "multisine"], validation=False,
        )  # fmt: skip
        write_recording(folder / f"{draw}-{name}", source.recordings(int(rng.integers(2**31)))[""])
        return folder / f"{draw}-{name}"

    model = tactile_cube.identify(recorded("reference"), [f"{KNOWN}@j"], say=quiet).model
    altered = recorded("other", friction=1.5 * damping) if change == MORE_FRICTION else recorded("other", change)
    same, other = (
        tactile_cube.monitor(one, model, significance=significance, say=quiet) for one in (recorded("same"), altered)
    )
    return {"draw": draw, "change": change, "null": row(same), "changed": row(other)}


def row(result: MonitorResult) -> dict[str, Any]:
    """The answer in few words."""
    names = [one.name for one in result.changed]
    return {"alarm": result.alarm, "missing": result.missing, "changed": names, "errors": result.errors,
            "smallest_p": result.drifts[0].p_value}  # fmt: skip


def share(name: str, flags: list[bool]) -> str:
    """A count with the 95 % interval that so few draws leave (Clopper and Pearson)."""
    low, high = stats.binomtest(sum(flags), len(flags)).proportion_ci()
    return f"{name:<44}{sum(flags):>4} of {len(flags):<4}({100 * low:.0f} .. {100 * high:.0f} %)"


def summary(rows: list[dict[str, Any]]) -> str:
    """False alarms and alarms."""
    lines = [share("false alarms: unchanged machines", [one["null"]["alarm"] for one in rows])]
    lines.append(share("  of them: something new missing", [one["null"]["missing"] for one in rows]))
    for change in dict.fromkeys(one["change"] for one in rows):
        found = [one["changed"]["alarm"] for one in rows if one["change"] == change]
        lines.append(share(f"alarms: {change}", found))
    return "\n".join(lines)


def main() -> None:
    """All draws, then the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--significance", type=float, default=0.001, help="as of monitor")
    parser.add_argument("--out", type=Path, default=Path("outputs/monitor"))
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as folder:
        for draw in range(given.draws):
            rows.append(drawn(draw, given.seed, given.significance, Path(folder)))
            (given.out / "monitor.json").write_text(json.dumps(rows, indent=1), encoding="utf-8")
            print(f"{draw + 1} of {given.draws} draws: {rows[-1]}", flush=True)
    print(summary(rows))


if __name__ == "__main__":
    main()
