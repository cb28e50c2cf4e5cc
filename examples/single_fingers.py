"""Where a policy rests, would a move of a single finger do any good?

    python examples/single_fingers.py outputs/train/alone-seed0/policy.safetensors

An episode goes on for 3.5 s as the policy acts; then one finger holds a random target for 0.2 to 0.7 s, as in
`exploration=single_fingers`, and the policy goes on to the end. What the cube turns more than without that move, and
whether the discounted return of what follows is larger, tells how often exploration meets a move worth learning.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

import tactile_cube
from tactile_cube.evaluation.policies import find_policy

STEPS, MOVED_AT, SHORTEST, LONGEST = 100, 35, 2, 7
"""Policy steps of an episode, the one at which the finger moves, and how many it holds its target."""
GAMMA = 0.95
"""Discount of the recipe."""


@dataclass(frozen=True)
class Move:
    """One finger's target from a step on.

    Attributes:
        joints: of the finger.
        target: its action (joints per finger,) in [-1, 1].
        steps: how long it is held.
    """

    joints: slice
    target: NDArray[np.float64]
    steps: int


def episode(env: Any, policy: Any, seed: int, move: Move | None = None) -> tuple[NDArray[np.float64], float]:
    """The turned angle after each step [rad], and the discounted return from `MOVED_AT` on."""
    env.set_seed(seed)
    now, angles, value = env.reset(), [], 0.0
    for step in range(STEPS):
        action = torch.as_tensor(policy.act(now["observation"][0].numpy(), step), dtype=torch.float32)[None]
        if move is not None and MOVED_AT <= step < MOVED_AT + move.steps:
            action[0, move.joints] = torch.as_tensor(move.target, dtype=torch.float32)
        now = env.step(now.set("action", action))["next"]
        angles.append(float(now["theta"]))
        value += GAMMA ** (step - MOVED_AT) * float(now["reward"]) if step >= MOVED_AT else 0.0
        if bool(now["done"]):
            break
    return np.array(angles), value


def main() -> None:
    """Count moves, and say what they gain."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("policy", help="a policy file, a run's folder or a shipped policy")
    parser.add_argument("--starts", type=int, default=4)
    parser.add_argument("--moves", type=int, default=32, help="from each start, the fingers in turn")
    parser.add_argument("--seed", type=int, default=100)
    given = parser.parse_args()
    config = tactile_cube.env_config(
        experiment="alone", task="float", exploration="none", values={"task.filter_time": 0.1}
    )
    env, policy = tactile_cube.make_env(config), find_policy(given.policy).policy
    draws, per_finger = np.random.default_rng(given.seed), 3
    gains, better, lost = [], 0, 0
    for start in range(given.starts):
        angles, value = episode(env, policy, given.seed + start)
        then = angles[min(MOVED_AT, len(angles)) - 1]
        print(f"start {start}: {then:.2f} rad when a finger moves, {angles[-1]:.2f} without", flush=True)
        for k in range(given.moves):
            finger = k % 4
            joints = slice(per_finger * finger, per_finger * (finger + 1))
            move = Move(joints, draws.uniform(-1.0, 1.0, per_finger), int(draws.integers(SHORTEST, LONGEST + 1)))
            moved, other = episode(env, policy, given.seed + start, move)
            better += other > value
            lost += len(moved) < len(angles)
            gains.append(moved[-1] - angles[-1] if len(moved) == len(angles) else np.nan)
    count, kept = len(gains), np.array(gains)[~np.isnan(gains)]
    quarter, twentieth = np.quantile(kept, [0.75, 0.95])
    print(
        f"{count} moves: {100 * lost / count:.0f} % lose the cube, {100 * better / count:.0f} % have a larger return; "
        f"of those that keep it a quarter turns it {quarter:.2f} rad further or more, a twentieth {twentieth:.2f}"
    )


if __name__ == "__main__":
    main()
