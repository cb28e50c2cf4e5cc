"""Reward terms per radian of a gait under the published reward, in other worlds and by other readings of the text.

python -m benchmarks.paper.budget  # docs/results/data/paper_budget.json, and the table on the screen
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import tactile_cube
from tactile_cube.agent.policy_file import current_commit
from tactile_cube.env.task import CubePose, cube_pose
from tactile_cube.evaluation.episode_record import EpisodeRecord

Array = NDArray[np.float64]
DATA = Path(__file__).parents[2] / "docs" / "results" / "data" / "paper_budget.json"
POLICIES = ("hold", "published", "fingertips", "default")
TERMS = ("spin", "height", "plane", "tilt", "proximal")
RADIAN = ("tilt", "plane", "height")
FIRST = 10  # policy steps in which the hand closes: 1 s
WORLDS: dict[str, dict[str, Any]] = {
    "as evaluated": {},
    "MuJoCo": {"engine": "mujoco"},
    "1 kHz": {"+env.simulation.dt": 1e-3, "+env.simulation.substeps": 100},
    "0.5 ms, 150 iterations": {
        "+env.simulation.dt": 5e-4,
        "+env.simulation.substeps": 200,
        "+env.simulation.solver_iterations": 150,
    },
    "soft tips, 0.1 mm/N": {"+env.constants.tip_compliance": 1e-4},
    "spinning friction 3 mm": {"+env.constants.tip_spinning_friction": 0.003},
    "spinning friction 30 mm": {"+env.constants.tip_spinning_friction": 0.03},
    "K_e as printed": {"+env.constants.elasticity_sign": -1},
    "T_s 0.08 s (cut-off 2 Hz)": {"+task.filter_time": 0.08},
    "5 % of the weight": {"+task.gravity_scale": 0.05},
}
"""Settings of evaluate."""


def budget(policy: str, world: str, episodes: int, seconds: float) -> dict[str, Any]:
    """Return the reward terms of a policy in a world, the mean over its episodes.

    Returns:
        "turned" [rad], "return", the weighted terms by name, "first" (their sum in the first second), and "path": plane
        and tilt if each physics step's motion were paid instead of the net change over a policy step.
    """
    short = {"protocol.episodes": episodes, "protocol.seconds": seconds, "+env.simulation.trace": True}
    values = {"protocol": "paper", "reward": "paper", **short, **WORLDS[world]}
    played = tactile_cube.evaluate(policy, seed=5, values=values, say=lambda *_: None)
    records = [played.episode(number) for number in range(episodes)]
    rows = [_row(record) for record in records]
    return {"policy": policy, "world": world} | {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}


def _row(record: EpisodeRecord) -> dict[str, float]:
    terms = {name: np.asarray(record.reward_terms[name]) for name in TERMS}
    poses = poses_of(record.trace["cube_position"], record.trace["cube_quaternion"])
    plane = np.hypot(*np.diff(poses[:, :2], axis=0).T).sum()
    tilt = np.abs(np.diff(poses[:, 2:], axis=0)).sum()
    return {
        "turned": float(record.theta[-1]),
        "held": float(record.ending == "time_limit"),
        "return": float(record.reward.sum()),
        **{name: float(values.sum()) for name, values in terms.items()},
        "first": float(sum(values[:FIRST].sum() for values in terms.values())),
        "plane_path": float(-300.0 * plane),
        "tilt_path": float(-50.0 * tilt),
    }


def poses_of(positions: Array, quaternions: Array) -> Array:
    """x, y [m], phi, psi [rad] of each sample (n, 4)."""
    poses: list[CubePose] = [cube_pose(p, q) for p, q in zip(positions.tolist(), quaternions.tolist(), strict=True)]
    return np.array([(pose.x, pose.y, pose.phi, pose.psi) for pose in poses])


def read_budget() -> list[dict[str, Any]]:
    """The rows as last written; none where it was not run."""
    return json.loads(DATA.read_text(encoding="utf-8"))["rows"] if DATA.is_file() else []


def table(rows: list[dict[str, Any]]) -> str:
    """Return the rows as Markdown: reward terms of 10 s, and per radian."""
    head = "| policy | world | rad | return | q1 | first second | a radian: spin | tilt | plane | height |"
    lines = [head, "|---" * head.count(" |") + "|"]
    for row in rows:
        total = " | ".join(f"{row[key]:.0f}" for key in ("return", "proximal", "first"))
        each = [f"{row[key] / row['turned']:.1f}" if row["turned"] > 1.0 else "-" for key in TERMS[:1] + RADIAN]
        lines.append(f"| {row['policy']} | {row['world']} | {row['turned']:.1f} | {total} | {' | '.join(each)} |")
    return "\n".join(lines)


def section() -> list[str]:
    """The budget for the page: two engines, and the range over all worlds."""
    rows = read_budget()
    if not rows:
        return []
    held = [row for row in rows if row["turned"] > 1.0 and row["held"] == 1.0]
    tilt = [-row["tilt"] / row["turned"] for row in held]
    path = [row["tilt_path"] / row["tilt"] for row in held]
    first = -min(row["first"] for row in held)
    words = (
        "Three episodes of 10 s under the published weights (`python -m benchmarks.paper.budget`). No policy was "
        f"trained under them. A radian earns at most 16, and tilting alone costs {min(tilt):.0f} to {max(tilt):.0f}, "
        "in all worlds in which no cube is lost (two engines; other time steps, compliances, frictions, weights and "
        f"signs of K_e). The first second costs at most {first:.0f}. The gait is the cause, not noise of the contact: "
        f"charged for every 2 ms instead of a step's net change, tilting would cost {min(path):.2f} to "
        f"{max(path):.2f} times as much. With a filter of 0.08 s, the other reading of its cut-off, every gait loses "
        "cubes."
    )
    return ["## What a gait earns and pays", words, table([row for row in rows if row["world"] in tuple(WORLDS)[:2]])]


def main() -> None:
    """Play every policy in every world, write the numbers, print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--policies", nargs="+", default=list(POLICIES))
    parser.add_argument("--episodes", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=10.0)
    given = parser.parse_args()
    rows = [budget(policy, world, given.episodes, given.seconds) for policy in given.policies for world in WORLDS]
    written = {"command": "python -m benchmarks.paper.budget", "commit": current_commit(), "rows": rows}
    DATA.write_text(json.dumps(written, indent=1) + "\n", encoding="utf-8")
    print(table(rows))


if __name__ == "__main__":
    main()
