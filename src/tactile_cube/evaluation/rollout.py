"""Run one episode and record everything that happens in it."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tensordict import TensorDictBase
from torchrl.envs import TransformedEnv

from tactile_cube.env import OUTCOMES, RotationEnv
from tactile_cube.evaluation.episode_record import Array, ContactTable, EpisodeRecord
from tactile_cube.evaluation.policies import Policy
from tactile_cube.simulation import EpisodeConstants
from tactile_cube.transforms import JointOffset

Interference = Callable[[RotationEnv, int], None]
"""Callback that may change the world before each policy step, given the step's number."""
NO_NUMBERS = ("effects", "joints", "object_shape")
WORLD_SIGNALS = ("q", "q_f", "cube_position", "cube_quaternion")
CONTACT_KINDS: dict[str, Any] = {"step": np.int64, "finger": np.int64, "tip": np.bool_}


def run_episode(
    env: TransformedEnv, policy: Policy, seed: int, interference: Interference | None = None
) -> EpisodeRecord:
    """Run one episode in an environment with one world.

    Args:
        env: what `make_env(config, 1, seed)` gave.
        policy: what decides.
        seed: start, randomisation, noise and sticky actions are drawn from it; equal seeds give equal episodes.
        interference: disturbs the world, e.g. pulls at a finger.
    """
    env.set_seed(seed)
    state = env.reset()
    task: RotationEnv = env.base_env.tasks[0]
    policy.start(task, seed)
    recorder = Recorder(env)
    finished, step = False, 0
    while not finished:
        if interference is not None:
            interference(task, step)
        observation = state["observation"][0].numpy()
        action = policy.act(observation, step)
        recorder.decided(observation, action)
        state["action"] = state["observation"].new_tensor(action)[None]
        state = env.step(state)["next"]
        recorder.add(state)
        finished, step = bool(state["done"][0, 0]), step + 1
    return recorder.record(seed)


class Recorder:
    """Gathers the samples of an episode as it runs in an environment with one world; made after its reset."""

    def __init__(self, env: TransformedEnv) -> None:
        task: RotationEnv = env.base_env.tasks[0]
        offset = next(part.offset for part in env.transform if isinstance(part, JointOffset))
        self._task, self._joint_offset = task, np.broadcast_to(offset.double().numpy(), (1, task.hand.joints))[0]
        self._fingers = tuple(finger.name for finger in task.hand.fingers)
        self._samples = dict[str, list[Any]](theta=[0.0], **{name: [] for name in WORLD_SIGNALS})
        self._steps: dict[str, list[Any]] = {"reward": [], "terms": [], "target": []}
        self._policy: dict[str, list[Array]] = {}
        self._contacts: list[dict[str, Any]] = []
        self._trace: list[dict[str, Any]] = []
        self._outcome = 0
        self._sample()

    def decided(self, observation: NDArray[np.float32], action: Array) -> None:
        """Record the policy's input, a stack of readings, and its action `(joints,)`."""
        q_m, e_q = np.array(observation[-2 * self._task.hand.joints :], dtype=np.float64).reshape(2, -1)
        for name, value in {"q_m": q_m, "e_q": e_q, "action": np.array(action, dtype=np.float64)}.items():
            self._policy.setdefault(name, []).append(value)

    def add(self, state: TensorDictBase) -> None:
        """Record the policy step that has just been made."""
        self._samples["theta"].append(float(state["theta"][0, 0]))
        self._steps["reward"].append(float(state["reward"][0, 0]))
        self._steps["terms"].append(state["reward_terms"][0].double().numpy())
        self._steps["target"].append(self._task.target + self._joint_offset)
        self._outcome = int(state["outcome"][0, 0])
        if self._task.world.options.trace:
            self._trace.append({name: np.array(values) for name, values in self._task.world.trace.items()})
        self._sample()

    def _sample(self) -> None:
        world, sample = self._task.world, len(self._samples["theta"]) - 1
        for name in WORLD_SIGNALS:
            self._samples[name].append(np.array(getattr(world, name)))
        tips = {finger.name: finger.links[-1] for finger in self._task.hand.fingers}
        self._contacts += [
            {
                "step": sample,
                "finger": self._fingers.index(one.finger),
                "tip": one.link == tips[one.finger],
                "position": one.position,
                "force": one.force * one.normal + one.friction,
                "normal_force": one.force,
                "distance": one.distance,
            }
            for one in world.contacts()
            if one.other == "cube" and one.finger in tips
        ]

    def record(self, seed: int) -> EpisodeRecord:
        """Return the episode so far."""
        task, samples = self._task, {name: np.array(rows) for name, rows in self._samples.items()}
        weights = task.reward.weights(task.conditions.penalty_scale)
        terms: Array = np.array(self._steps["terms"]).reshape(-1, len(weights)) * weights
        table: dict[str, Any] = {field.name: [] for field in dataclasses.fields(ContactTable)}
        for name in table:
            column = np.array([one[name] for one in self._contacts], dtype=CONTACT_KINDS.get(name, np.float64))
            table[name] = column.reshape(-1, 3) if name in ("position", "force") else column
        return EpisodeRecord(
            time=np.arange(len(samples["theta"]), dtype=np.float64) * task.world.options.policy_dt,
            theta=samples["theta"],
            joint_position=samples["q"],
            filtered_target=samples["q_f"],
            target=np.array(self._steps["target"]).reshape(-1, task.hand.joints),
            cube_position=samples["cube_position"],
            cube_quaternion=samples["cube_quaternion"],
            reward=np.array(self._steps["reward"]),
            reward_terms={name: terms[:, index] for index, name in enumerate(task.reward.terms)},
            contacts=ContactTable(**table),
            ending=OUTCOMES[self._outcome],
            direction=task.task.direction,
            cube_size=np.array(task.constants.cube_size),
            constants={
                "seed": float(seed),
                **_numbers(task.constants),
                **({"palm_contact": 1.0} if task.hand.palm_contact else {}),
            },
            fingers=self._fingers,
            object_shape=task.constants.object_shape,
            axis=tuple(task.task.axis_vector().tolist()),
            trace={name: np.concatenate([one[name] for one in self._trace]) for name in (self._trace or [{}])[0]},
            policy={name: np.array(rows) for name, rows in self._policy.items()},
        )


def _numbers(constants: EpisodeConstants) -> dict[str, float | str]:
    """Return the scalar constants of the episode for its label; vectors over the joints by their mean."""
    fields = (field.name for field in dataclasses.fields(constants) if field.name not in NO_NUMBERS)
    values = {name: getattr(constants, name) for name in fields}
    return {name: float(np.mean(value)) for name, value in values.items() if value is not None}
