"""Export a policy, and run its control loop on a hand, from a program."""

import tempfile
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from hydra.utils import instantiate
from omegaconf import OmegaConf

from tactile_cube.api.job import Job, PathLike, Say, as_input_errors, called_job
from tactile_cube.deployment.control_loop import ControlLoop, open_angles
from tactile_cube.deployment.controller import Network, PlayedTargets, PolicyController, excited_targets, read_network
from tactile_cube.deployment.export import export_policy
from tactile_cube.deployment.robot import JointLimits, Robot
from tactile_cube.deployment.run_loop import LoopLog, LoopRun, Rows, run_loop, write_runs
from tactile_cube.deployment.simulated_hand import SimulatedHand
from tactile_cube.deployment.training_setting import TrainingSetting, training_setting
from tactile_cube.errors import InputError
from tactile_cube.evaluation.policy_path import policy_path
from tactile_cube.hand import Hand
from tactile_cube.simulation import constants_of


@as_input_errors
def load_policy(policy: PathLike | None = None) -> Network:
    """Load a trained policy in numpy: call it with observations `(..., 120)` for actions `(..., 12)` in [-1, 1].

    Args:
        policy: a policy file, a training run's folder, or a policy that ships with the package; None: the shipped one.

    Raises:
        InputError: there is no such policy, or its file is damaged.

    Example:
        >>> action = tactile_cube.load_policy("table")(observation)
    """
    return read_network(policy_path(None if policy is None else str(policy)))


@as_input_errors
def export(
    policy: PathLike | None,
    output: PathLike,
    *,
    hand: str | None = None,
    object: str | None = None,
    values: Mapping[str, Any] | None = None,
) -> Path:
    """Write a policy as plain arrays (.npz) or ONNX (.onnx), with its interface contract beside it.

    Args:
        policy: as in `load_policy`.
        output: file to write.
        hand: option of conf/hand, for a policy of a hand whose URDF is yours; None: the policy's.
        object: option of conf/object; None: the policy's.
        values: keys of these, e.g. {"object.file": "bar.stl"}.

    Returns:
        Path of the contract.

    Raises:
        InputError: unknown ending, or ONNX is not installed.
    """
    return run_export(called_job("export", locals()))[1]


def run_export(job: Job) -> tuple[Path, Path]:
    """Write the files of an export; return the paths of the network and of the contract."""
    config, source = job.config, policy_path(job.config.policy)
    output = Path(config.output or f"{source.stem}.npz")
    network = load_policy(source)
    return output, export_policy(network, output, _setting(config, network))


def _setting(config: Any, network: Network, trained: bool = True) -> TrainingSetting:
    hand: Hand | None = instantiate(config.hand, _convert_="all") if config.get("hand") else None
    if hand is not None and not trained:
        return TrainingSetting.of(hand)
    object_: Any = OmegaConf.to_container(config.object, resolve=True) if config.get("object") else None
    setting = training_setting(network.info, hand, object_, network.label)
    if hand is None and setting.hand.drive and config.get("robot", {}).get("_target_") != SIMULATED:
        name = setting.hand.name
        raise InputError(
            f"{network.label}: what the drives of hand '{name}' bear, which limits every command, would be known from "
            f"the policy's file alone; name the hand: hand={name}"
        )
    return setting


SIMULATED = f"{SimulatedHand.__module__}.{SimulatedHand.__qualname__}"


@dataclass(frozen=True)
class DeploymentResult:
    """Result of the control loop.

    Attributes:
        runs: how each run ended and its tick times.
        logs: of the time in which the policy decided, one a run, on disk; see `Rows`.
        turned: how far the simulated hand turned the object the wanted way in each run [rad]; empty on another hand.
        hand: the one that the policy was trained on.
    """

    runs: list[LoopRun]
    logs: list[Rows]
    turned: list[float]
    limits: JointLimits
    job: Job
    hand: Hand

    @property
    def text(self) -> str:
        """Why each run ended, what the simulated hand turned, and how long a tick took."""
        lines = [f"run {number}: {run.reason}" for number, run in enumerate(self.runs)]
        if self.turned:
            lines = [f"{line}; cube turned {a:.2f} rad" for line, a in zip(lines, self.turned, strict=True)]
        shown = ", ".join(f"{name} {1e6 * value:.0f} us" for name, value in self.runs[-1].tick_times.items())
        return "\n".join([*lines, f"computing time of a tick: {shown}; a period lasts {1e6 / self.rate:.0f} us"])

    @property
    def rate(self) -> float:
        """Rate of the fast loop [Hz]."""
        return float(self.job.config.robot.rate)

    def write(self, folder: PathLike) -> Path | None:
        """Write the log of every run in which the policy decided as one recording; None if there is none."""
        logs = [log for log in self.logs if len(log)]
        resolution = float(self.job.config.robot.get("resolution", 0.0))
        return write_runs(logs, Path(folder), self.limits, self.rate, resolution, self.hand) if logs else None


@as_input_errors
def deploy(
    policy: PathLike | None = None,
    *,
    robot: str | None = None,
    hand: str | None = None,
    object: str | None = None,
    motion: str | None = None,
    reach: float | None = None,
    seconds: float | None = None,
    runs: int | None = None,
    filter_time: float | None = None,
    rate_limit: float | None = None,
    record: bool | None = None,
    seed: int | None = None,
    values: Mapping[str, Any] | None = None,
    say: Say = print,
) -> DeploymentResult:
    """Run the control loop of a policy on a hand: by default a dry run on the simulated one.

    Args:
        policy: a policy file, a training run's folder, or a policy that ships with the package; None: the shipped one.
        robot: option of conf/robot.
        hand: option of conf/hand; None: the policy's.
        object: option of conf/object; None: the policy's.
        motion: `policy`, or an excitation in its place: `ramps`, `holds`, `steps`, `multisine`.
        reach: half width of an excitation [rad].
        seconds: how long the policy decides in each run.
        runs: one after the other, each from homing.
        filter_time: T_s [s]; None: what the policy was last trained with.
        rate_limit: largest change of a desired angle [rad/s].
        record: keep the loop's log.
        seed: of the simulated hand.
        values: other keys of conf/deploy.yaml, e.g. {"robot.cube": False, "stop.margin": 0.05}.
        say: takes a line at each change of mode.

    Raises:
        InputError: a policy without a filter time, a hand that is not there.
    """
    return run_deployment(called_job("deploy", locals()), say)


def run_deployment(job: Job, say: Say, folder: Path | None = None) -> DeploymentResult:
    """Home, run and stop as often as the job says; every run has a new loop.

    Args:
        job: what to do.
        say: takes a line at each change of mode.
        folder: where the logs grow; they stay there if a run fails. None: a temporary one.
    """
    with tempfile.TemporaryDirectory(prefix="tactile_cube-") if folder is None else nullcontext(folder) as place:
        return _run_all(job, say, Path(place))


def _run_all(job: Job, say: Say, folder: Path) -> DeploymentResult:
    config, network = job.config, load_policy(job.config.policy)
    setting = _setting(config, network, config.motion == "policy")
    limits = robot_limits(setting, config.rate_limit)
    target, simulated = str(config.robot._target_), config.robot._target_ == SIMULATED
    own = {"setting": setting} if simulated else {"hand": setting.hand} if target.startswith("tactile_cube.") else {}
    runs, logs, turned = [], [], []
    for number in range(config.runs):
        seed = {"seed": config.seed + number} if simulated else {}
        loop = _control_loop(config, network, setting, limits)
        # partial: hydra would make a dictionary of a hand that it is given
        robot: Robot = instantiate(config.robot, _partial_=True, **seed)(**own)
        with LoopLog(folder / f"run_{number}.npy", setting.hand.joints) if config.record else nullcontext() as log:
            runs.append(run_loop(loop, robot, say, log))
        logs += [log.rows] if log is not None else []
        if isinstance(robot, SimulatedHand) and robot.cube:
            turned.append(robot.turned(runs[-1].ended))
        if runs[-1].interrupted:
            break
    return DeploymentResult(runs, logs, turned, limits, job, setting.hand)


def _control_loop(config: Any, network: Network, setting: TrainingSetting, limits: JointLimits) -> ControlLoop:
    hand, trained = setting.hand, network.info.get("time_constant")
    time_constant: Any = trained if config.filter_time is None else config.filter_time
    if time_constant is None:
        raise InputError("the policy file does not say its filter time T_s; give filter_time=SECONDS")
    rules, homing, seconds = instantiate(config.stop), instantiate(config.homing), config.seconds
    decides: PolicyController | PlayedTargets
    if config.motion == "policy":
        decides, opened = PolicyController(network, hand), open_angles(setting, homing.clearance)
    else:  # every run the same commands: repeats show the noise floor
        decides, opened = excited_targets(config.motion, float(config.reach), seconds, config.seed, hand), None
    return ControlLoop(decides, time_constant, limits, rules, homing, seconds, hand, opened)


def robot_limits(setting: TrainingSetting, rate: float) -> JointLimits:
    """Return the interface contract's limits: largest change `rate` [rad/s]; the training's range, gains and torque.

    The stiffness is at least the hand's, so a policy that was trained with a softer hand gets no wider commands.
    """
    hand, constants = setting.hand, setting.constants
    gains = (np.maximum(constants.kp, constants_of(hand).kp), np.asarray(constants.kd))
    return JointLimits(hand.lower, hand.upper, rate, constants.torque_limit, *gains)
