"""The next experiment in plain words: what to play, what it does at most, and when to stop."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_cube.identification.command_limits import QUANTITIES, TRIALS, Envelope
from tactile_cube.identification.next_experiment import FILE, Experiment
from tactile_cube.identification.safe_commands import SCALES, Safety
from tactile_cube.measurement.units import TURNS, of_joint, short

MODELS = "each explanation, also with parameters at either end of their intervals"
PLENTY = 100.0  # times the evidence that is needed: how much more is of no use to anybody


def next_steps(experiment: Experiment, units: Mapping[str, str]) -> list[str]:
    """What to play to decide, when to stop it, and between what nothing that can be played decides.

    Args:
        experiment: the commands and what models make of them.
        units: joint -> unit of its position.
    """
    beyond = "stop beyond" if experiment.safety.safe else "allowed"
    lines = [
        f"  {joint}: {position}, {speed}, {torque}; {beyond} {', '.join(bounds)}"
        for joint, position, speed, torque, *bounds in joint_rows(experiment, units)
    ]
    return [*proposal(experiment), *lines, *watch_for(experiment, units)]


def proposal(experiment: Experiment) -> list[str]:
    """What to play, or that nothing is safe or nothing decides."""
    if not experiment.safety.safe:
        return [_nothing_safe(experiment)]
    lines = [
        f"No command tried separates {one} from {other}: within its limits the machine moves alike either way."
        for one, other in experiment.inseparable
    ]
    return [*lines, _play(experiment), _simulated(experiment)] if experiment.decides else lines


def joint_rows(experiment: Experiment, units: Mapping[str, str]) -> list[tuple[str, ...]]:
    """Joint; furthest position, speed and torque in any model; the same of what is allowed, with who says so."""
    safety = experiment.safety
    if safety.safe and not experiment.decides:
        return []
    return [
        (
            joint,
            *_numbers(safety.reached, j, units.get(joint, TURNS)),
            *(
                f"{number} ({safety.limits.sources[key][j]})"
                for key, number in zip(QUANTITIES, _numbers(safety.allowed, j, units.get(joint, TURNS)), strict=True)
            ),
        )
        for j, joint in enumerate(experiment.joints)
    ]


def watch_for(experiment: Experiment, units: Mapping[str, str]) -> list[str]:
    """What to watch for; what would help where nothing is safe, or nothing that is safe decides."""
    safety = experiment.safety
    if experiment.decides:
        return [_watch(experiment, units), *([_open_loop(experiment)] if safety.open_loop else [])]
    return [_help(safety)] if safety.open_loop or not safety.safe else []


def _play(experiment: Experiment) -> str:
    told = short(experiment.told, 2) if experiment.told < PLENTY else f"more than {PLENTY:g}"
    return (
        f"To decide, play {FILE} twice, add both trials and diagnose again: {_named(experiment)}, "
        f"{_seconds(experiment)}. Each should give {told} times the evidence needed to reject the "
        "wrong one, however it is refitted."
    )


def _simulated(experiment: Experiment) -> str:
    safety = experiment.safety
    starts = f" from {len(safety.starts)} starts" if len(safety.starts) > 1 else ""
    return (
        f"Simulated for the whole {_seconds(experiment)} in {safety.models} models ({MODELS}){starts}. The largest "
        f"values in any of them, and where to stop: {_percent(safety.margin)} inside stated limits, else where the "
        "trials ended:"
    )


def _watch(experiment: Experiment, units: Mapping[str, str]) -> str:
    begin = ", ".join(
        f"{joint} {short(float(value))} {units.get(joint, TURNS)}"
        for joint, value in zip(experiment.joints, experiment.safety.starts[-1], strict=True)
    )
    return (
        f"Begin at rest at {begin}. Keep a hand on the emergency stop. Stop when a joint goes beyond these limits, "
        "moves against its command or shakes: then none of these models is right."
    )


def _open_loop(experiment: Experiment) -> str:
    return (
        f"These commands are torques or forces, open loop for {_seconds(experiment)}, and unstable by nature: small "
        "errors add up. If you can, control the position instead and log the torque."
    )


def _nothing_safe(experiment: Experiment) -> str:
    return (
        f"No safe command was found: each kind, down to {_percent(SCALES[-1])} of its size, leaves the limits in at "
        f"least one of {experiment.safety.models} models ({MODELS}). The nearest is {_named(experiment)}, "
        f"{_seconds(experiment)}:"
    )


def _help(safety: Safety) -> str:
    unstated = [key for key in QUANTITIES if TRIALS in safety.limits.sources[key]]
    ways = [
        *(["control the position instead of playing torques open loop"] if safety.open_loop else []),
        "record shorter runs that start nearer the middle of the range",
        *([f"state limits of {' and '.join(unstated)} (URDF, controller)"] if unstated else []),
    ]
    return f"What would help: {'; '.join(ways)}."


def _numbers(envelope: Envelope, joint: int, unit: str) -> tuple[str, str, str]:
    return (
        f"{short(envelope.low[joint])} to {short(envelope.high[joint])} {unit}",
        f"{short(envelope.speed[joint])} {unit}/s",
        f"{short(envelope.torque[joint])} {of_joint('N m', unit)}",
    )


def _named(experiment: Experiment) -> str:
    scale = experiment.safety.scale
    return experiment.name if scale == 1.0 else f"{experiment.name} at {_percent(scale)} of full size"


def _percent(part: float) -> str:
    return f"{100 * part:.0f} %"


def _seconds(experiment: Experiment) -> str:
    return f"{short(float(experiment.time[-1]))} s"
