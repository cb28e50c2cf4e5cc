"""Trials of a policy during training: without exploration, in worlds that stay the same throughout."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tactile_cube.agent.networks import Actor
from tactile_cube.errors import InputError
from tactile_cube.evaluation.evaluation import Evaluation
from tactile_cube.evaluation.policies import ActorPolicy
from tactile_cube.evaluation.protocol import Protocol
from tactile_cube.evaluation.summary import Summary
from tactile_cube.transforms import EnvConfig
from tactile_cube.visualization.episode_recording import write_film

ENGINES = ("bullet", "mujoco")
SEED = 20_264  # seed of the trials' worlds; final evaluations (conf/experiment) and trainings have others
SCORE = "score"  # mean over engines and episodes of the final angle [rad], 0 where the object is lost


def measured(summary: Summary) -> dict[str, float]:
    """Return an engine's log: sum of rewards, share held, final angle [rad], drift [mm/s], contact shares."""
    return {
        "return": sum(summary.reward_terms.values()),
        "held": summary.kept / summary.episodes,
        "angle": summary.mean_angle,
        "drift": 1e3 * summary.drift,
        "tips": summary.tip_support,
        "links": summary.link_contact,
        "link_force": summary.link_force_share,
    }


@dataclass(frozen=True)
class Trial:
    """Evaluates actors in the worlds of `config`, in both engines under its own conditions."""

    config: EnvConfig

    def __call__(self, actor: Actor, episodes: int, film: Path) -> dict[str, float]:
        """Return `SCORE`, and what is `measured` by `<engine>_<name>`; film the first episode."""
        result: dict[str, float] = {}
        scores = list[float]()
        protocol, policy = Protocol("trial", episodes=episodes, trace=False), ActorPolicy(actor)
        for engine in ENGINES:
            simulation: Any = replace(self.config.simulation, engine=engine)  # type: ignore[arg-type]
            evaluation = Evaluation(replace(self.config, simulation=simulation), policy, protocol, SEED)
            try:
                (variant,) = evaluation.run(lambda *_: None)
            except InputError as error:
                print(f"not tried in {engine}: {error}")
                continue
            if not scores:
                write_film(evaluation.record(variant.variant, variant.results[0]), film, hand=self.config.hand)
            scores.append(float(np.mean([one.final_angle * one.kept for one in variant.results])))
            result |= {f"{engine}_{name}": value for name, value in measured(variant.summary).items()}
        return result | {SCORE: float(np.mean(scores))} if scores else {}
