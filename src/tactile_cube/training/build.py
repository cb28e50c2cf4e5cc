"""Build a training run, or restore it from its checkpoint."""

import contextlib
import ctypes
import os
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import torch
from filelock import BaseFileLock, FileLock, Timeout
from torch import Tensor
from torchrl.data import ReplayBuffer, TensorDictReplayBuffer

from tactile_cube.agent.agent import Agent
from tactile_cube.agent.networks import Actor, Sizes
from tactile_cube.agent.policy_file import load_actor, require_sizes
from tactile_cube.env import OUTCOMES, Conditions
from tactile_cube.env.rotation import OBJECT
from tactile_cube.errors import InputError
from tactile_cube.randomization import Learnability
from tactile_cube.training.checkpoint import FILE, Checkpoints, load_checkpoint, require_same_settings
from tactile_cube.training.collection import MakeEnv, MultiSyncCollection, SingleCollection
from tactile_cube.training.ledger import LEDGER, Ledger
from tactile_cube.training.loggers import MetricsTable, open_logger
from tactile_cube.training.loop import Learner
from tactile_cube.training.replay import Replay
from tactile_cube.training.run import BEST_POLICY, FILM, POLICY, Run
from tactile_cube.training.run import FILE as FINISHED
from tactile_cube.training.settings import CollectorSettings, TrainingSettings
from tactile_cube.training.transitions import EpisodeStatistics
from tactile_cube.training.trial import Trial
from tactile_cube.transforms import EnvConfig, make_env

POLICY_SUFFIX = ".safetensors"
FROZEN = 3000  # updates that leave the actor of a policy file as it is, unless training.actor_frozen says otherwise
TRIM_THRESHOLD, TOP_PAD, MMAP_THRESHOLD = -1, -2, -3  # numbers of glibc's mallopt


@dataclass(frozen=True)
class Environment:
    """A family of equal worlds.

    Attributes:
        make: makes a batch of worlds, in whichever process.
        sizes: widths of observation, privileged state and action.
        terms: names of the reward terms, in the order of "reward_terms".
        reward_weights: weights of the terms (terms,) under the conditions in force.
        outcomes: names of the codes in the key "outcome".
        learnability: makes what keeps account of the worlds; None: nothing does.
        trial: tries an actor in so many episodes an engine and films one, see `Trial`; None: nothing does.
        approximations: what its worlds compute less well than they could, in words.
    """

    make: MakeEnv
    sizes: Sizes
    terms: tuple[str, ...]
    reward_weights: Callable[[Conditions], Tensor]
    outcomes: tuple[str, ...] = ()
    learnability: Callable[[], Learnability] | None = None
    trial: Callable[[Actor, int, Path], dict[str, float]] | None = None
    approximations: tuple[str, ...] = ()


def rotation_environment(config: EnvConfig) -> Environment:
    """Make the environment of the rotation task as configured."""
    joints = config.hand.joints
    return Environment(
        make=partial(make_env, config),
        sizes=Sizes(2 * joints * config.stack, OBJECT + joints, joints),
        terms=config.reward.terms,
        reward_weights=lambda conditions: torch.from_numpy(config.reward.weights(conditions.penalty_scale)),
        outcomes=OUTCOMES,
        learnability=partial(config.randomization.learnability, config.constants),
        trial=Trial(config),
        approximations=tuple(config.approximations()),
    )


def as_environment(made: Any) -> Environment:
    """Return `env` of the configuration if it is an environment, else the rotation task made from it."""
    return made if isinstance(made, Environment) else rotation_environment(made)


def build_run(
    folder: Path,
    seed: int,
    environment: Environment,
    make_agent: Callable[[Sizes], Agent],
    collector: CollectorSettings,
    training: TrainingSettings,
    config: dict[str, Any],
    logger: Mapping[str, Any] | None = None,
    make_replay: Callable[..., ReplayBuffer] = TensorDictReplayBuffer,
) -> Run:
    """Build a run in `folder`: resumed from its checkpoint, or new.

    Args:
        folder: run folder; made if need be.
        seed: of everything random.
        environment: the worlds.
        make_agent: builds the agent for the environment's sizes.
        collector: how worlds are spread over processes.
        training: schedule.
        config: the resolved configuration, as plain data.
        logger: settings of `open_logger`.
        make_replay: makes the buffer of transitions, see `Replay`.

    Raises:
        InputError: another process trains in the folder, a checkpoint that is damaged or made with other settings, an
            unusable `init_from`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with contextlib.ExitStack() as held:
        lock = lock_folder(folder)
        held.callback(lock.release)
        keep_freed_memory()
        torch.set_num_threads(training.threads)
        torch.manual_seed(seed)
        checkpoints = Checkpoints(folder)
        saved = None if training.resume == "never" else checkpoints.load()
        if saved is not None:
            require_same_settings(folder / FILE, saved["config"], config)
        agent = make_agent(environment.sizes)
        if saved is None and training.init_from:
            training = _warm_start(agent, Path(training.init_from), training)
        kind = SingleCollection if collector.kind == "single" else MultiSyncCollection
        collection = kind(environment.make, agent.policy(), collector, training.steps_per_iteration)
        held.callback(collection.close)  # worker processes would keep the program from ending
        learner = Learner(
            agent=agent,
            replay=Replay(training.replay_size, environment.sizes, len(environment.terms), seed, make_replay),
            collection=collection,
            episodes=EpisodeStatistics(
                environment.outcomes, environment.terms, environment.learnability and environment.learnability()
            ),
            settings=training,
            reward_weights=environment.reward_weights,
            seed=seed,
        )
        if saved is not None:
            _fit("the run's checkpoint", lambda: learner.load_state_dict(saved["learner"]))
        elif training.init_replay:
            learner.replay.load_state_dict(_replay_of(training.init_from))
        if training.resume == "never":  # all checks have passed
            _clear(folder, checkpoints)
        ledger = Ledger(folder / LEDGER, collection.cpu_seconds, in_process=collector.kind == "single")
        known = {key: saved[key] for key in ("best_angle", "best_score", "tried") if key in saved} if saved else {}
        run = Run(
            learner=learner,
            folder=folder,
            config=config,
            table=MetricsTable(folder, learner.steps),
            logger=open_logger(folder, learner.steps, config, **logger or {}),
            ledger=ledger,
            lock=lock,
            checkpoints=checkpoints,
            iteration_steps=collector.worlds * training.steps_per_iteration,
            approximations=[*environment.approximations, *agent.approximations()],
            trial=environment.trial,
            **known,
        )
        held.pop_all()  # the run closes it from here on
    return run


def _clear(folder: Path, checkpoints: Checkpoints) -> None:
    """Delete what an earlier run has left, so that nothing of it is taken for this one's."""
    checkpoints.clear()
    policies = (folder / POLICY, folder / BEST_POLICY, *folder.glob(f"policy_[0-9]*{POLICY_SUFFIX}"))
    for path in (folder / LEDGER, folder / FINISHED, folder / FILM, *policies):
        path.unlink(missing_ok=True)
    for backend in ("tensorboard", "csv"):
        shutil.rmtree(folder / backend, ignore_errors=True)


def lock_folder(folder: Path) -> BaseFileLock:
    """Take the folder's lock; the system gives it back when the process ends, however it ends.

    Raises:
        InputError: another process has it: two of them would overwrite each other's checkpoints.
    """
    lock = FileLock(folder / ".lock")
    try:
        lock.acquire(blocking=False)
    except Timeout:
        raise InputError(
            f"{folder}: another process trains in this folder; wait for its end (seconds after Ctrl-C), or "
            "give this run another name=... or seed=..."
        ) from None
    return lock


def keep_freed_memory() -> None:
    """Tell glibc not to give memory back after each update (2 to 20 % of its time); does nothing elsewhere."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if os.name == "posix" else None
    if mallopt is not None:
        for number, size in ((TRIM_THRESHOLD, 10**9), (MMAP_THRESHOLD, 10**9), (TOP_PAD, 2 * 10**8)):
            mallopt(number, size)


def _warm_start(agent: Agent, path: Path, training: TrainingSettings) -> TrainingSettings:
    """Begin from the networks of a checkpoint, or from a policy file's actor; gives the schedule for it.

    A policy file holds the actor alone, which gradients of ignorant critics would lead astray (docs/match.md): it waits
    until fresh ones have learned its value.
    """
    if path.suffix != POLICY_SUFFIX:
        state = load_checkpoint(path)
        _fit(f"training.init_from={path}", lambda: agent.load_networks(state["learner"]["agent"]))
        return training
    actor, info = load_actor(path)
    require_sizes(path, info, agent.sizes.observation, agent.sizes.action)
    if info.hidden != agent.settings.hidden:
        raise InputError(
            f"training.init_from={path}: networks of other shape than agent.* asks for (hidden layers "
            f"{list(info.hidden)}, agent.hidden is {list(agent.settings.hidden)})"
        )
    agent.load_actor(actor)
    return training.model_copy(update={"actor_frozen": training.actor_frozen or FROZEN})


def _replay_of(init_from: str | None) -> dict[str, Any]:
    """Return the replay buffer's state in a run's newest checkpoint."""
    folder = Path(init_from).parent if init_from and Path(init_from).suffix != POLICY_SUFFIX else None
    saved = Checkpoints(folder).load() if folder else None
    if saved is None:
        raise InputError(
            f"training.init_replay=true: training.init_from is {init_from}, which has no experience; "
            "name the folder of a run with a checkpoint"
        )
    replay: dict[str, Any] = saved["learner"]["replay"]
    return replay


def _fit(where: str, load: Callable[[], None]) -> None:
    try:
        load()
    except InputError:
        raise
    except (AttributeError, KeyError, RuntimeError, TypeError, ValueError) as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"{where}: networks of other shape than agent.* asks for ({reason})") from error
