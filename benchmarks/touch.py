"""Regress the state of the world on the policy's readings: R^2 on held-out episodes, as a table.

python -m benchmarks.touch                                    # every shipped policy, in wide worlds; five CPU minutes
python -m benchmarks.touch --policies default --episodes 24
"""

import argparse
import time

import numpy as np
import torch
from numpy.typing import NDArray

from tactile_cube.agent.policy_file import load_actor
from tactile_cube.api.job import worded_job
from tactile_cube.evaluation.policies import environment, find_policy
from tactile_cube.evaluation.policy_path import SHIPPED, policy_path
from tactile_cube.transforms import EnvConfig, make_env

Array = NDArray[np.float32]
WORLDS, STEPS, SETTLED, SEED = 12, 80, 10, 20_265
"""Worlds side by side; policy steps of an episode; those at its start that are left out; seed."""
FOLDS = 4
WINDOWS = {"0.5 s": 5, "2 s": 20}
"""Readings that a prediction sees: the policy's own stack, and four times as many."""
TARGETS = ("x", "y", "height", "size", "torque limit", "mass", "tip friction")


def recorded(policy: str, episodes: int) -> tuple[Array, Array, NDArray[np.int64]]:
    """Readings (rows, 20, 2 joints), targets (rows, 7) and each row's episode (rows,), in worlds drawn by `wide`."""
    job = worded_job("evaluate", [f"policy={policy}", "protocol=many", "randomization=wide"])
    config: EnvConfig = environment(job.config, find_policy(policy), job.choices)
    actor, _ = load_actor(policy_path(policy))
    env = make_env(config, WORLDS, SEED, evaluation=True)
    width, longest = 2 * config.hand.joints, max(WINDOWS.values())
    rows: list[tuple[Array, Array, int]] = []
    for batch in range(-(-episodes // WORLDS)):
        env.set_seed(SEED + batch)
        state, running = env.reset(), np.ones(WORLDS, dtype=bool)
        history = [state["observation"][:, -width:].numpy()] * longest
        for step in range(STEPS):
            with torch.no_grad():
                state["action"] = actor.deterministic(state["observation"])
            state = env.step(state)["next"]
            history = [*history[1:], state["observation"][:, -width:].numpy()]
            running &= ~state["done"][:, 0].numpy()
            for world in np.flatnonzero(running) if step >= SETTLED else ():
                task = env.base_env.tasks[world]
                known = task.constants
                constants = (np.mean(known.cube_size), np.mean(known.torque_limit), known.cube_mass, known.tip_friction)
                targets = np.array([*task.world.cube_position, *constants], dtype=np.float32)
                rows.append((np.stack([one[world] for one in history]), targets, WORLDS * batch + int(world)))
    env.close()
    readings, wanted, episode = zip(*rows, strict=True)
    return np.stack(readings), np.stack(wanted), np.array(episode)


def ridge(x: Array, y: Array, inner: NDArray[np.bool_], unseen: Array) -> tuple[Array, Array]:
    """Linear regression, of each target with the penalty that is best on the `inner` rows: error there, prediction."""
    square, product = x[~inner].T @ x[~inner], x[~inner].T @ y[~inner]
    models = [np.linalg.solve(square + penalty * np.eye(len(square)), product) for penalty in (1e1, 1e2, 1e3, 1e4)]
    errors = np.stack([((x[inner] @ model - y[inner]) ** 2).mean(0) for model in models])
    best = errors.argmin(0)
    return errors.min(0), np.stack([unseen @ models[k][:, column] for column, k in enumerate(best)], -1)


def network(x: Array, y: Array, inner: NDArray[np.bool_], unseen: Array) -> tuple[Array, Array]:
    """Two layers of 64, of the epoch, target by target, that is best on the `inner` rows: error there, prediction."""
    torch.manual_seed(0)
    layers = [torch.nn.Dropout(0.1), torch.nn.Linear(x.shape[1], 64), torch.nn.ReLU()]
    layers += [torch.nn.Dropout(0.1), torch.nn.Linear(64, 64), torch.nn.ReLU(), torch.nn.Linear(64, y.shape[1])]
    model = torch.nn.Sequential(*layers)
    optimizer = torch.optim.AdamW(model.parameters(), lr=1e-3, weight_decay=1e-2)
    seen, wanted, tried = torch.from_numpy(x[~inner]), torch.from_numpy(y[~inner]), torch.from_numpy(x[inner])
    best, found = (np.zeros((rows, y.shape[1]), dtype=np.float32) for rows in (1, len(unseen)))
    best = best[0] + np.inf
    for _ in range(15):
        model.train()
        for rows in torch.split(torch.randperm(len(seen)), 256):
            optimizer.zero_grad()
            (model(seen[rows]) - wanted[rows]).square().mean().backward()
            optimizer.step()
        model.eval()
        with torch.no_grad():
            errors, now = ((model(tried).numpy() - y[inner]) ** 2).mean(0), model(torch.from_numpy(unseen)).numpy()
        better = errors < best
        best[better], found[:, better] = errors[better], now[:, better]
    return best, found


def explained(inputs: Array, targets: Array, episode: NDArray[np.int64]) -> Array:
    """R^2 (targets,) on held-out episodes, each target by the regression that is better on inner episodes."""
    wanted = (targets - targets.mean(0)) / targets.std(0)
    part = np.random.default_rng(0).permutation(episode.max() + 1)[episode]
    predicted = np.zeros_like(wanted)
    for fold in range(FOLDS):
        unseen = part % FOLDS == fold
        x = (inputs - inputs[~unseen].mean(0)) / inputs[~unseen].std(0)
        inner = (part // FOLDS % 5 == 0)[~unseen]
        one, other = (method(x[~unseen], wanted[~unseen], inner, x[unseen]) for method in (ridge, network))
        predicted[unseen] = np.where(one[0] < other[0], one[1], other[1])
    return np.asarray(1.0 - ((predicted - wanted) ** 2).mean(0))


def main() -> None:
    """Print the table."""
    shipped = sorted(file.stem for file in SHIPPED.glob("*.safetensors"))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--policies", nargs="*", default=shipped, help="shipped policies, files or run folders")
    parser.add_argument("--episodes", type=int, default=120, help="of each policy")
    given = parser.parse_args()
    torch.set_num_threads(1)
    print(f"| policy | {' | '.join(TARGETS)} |\n{'|---' * (len(TARGETS) + 1)}|")
    for policy in given.policies:
        readings, targets, episode = recorded(policy, given.episodes)
        found = [explained(readings[:, -n:].reshape(len(targets), -1), targets, episode) for n in WINDOWS.values()]
        cells = (", ".join(f"{max(one[k], 0.0):.2f}" for one in found) for k in range(len(TARGETS)))
        print(f"| `{policy}` | {' | '.join(cells)} |", flush=True)
    print(f"\nfrom {', from '.join(WINDOWS)} of readings; {time.process_time() / 60:.1f} CPU minutes")


if __name__ == "__main__":
    main()
