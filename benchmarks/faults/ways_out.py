"""Attacks on `deploy` in processes of their own: does every way out let go of blocked fingers, and end?

    python -m benchmarks.faults.ways_out --attacks 100 --seed 0 --out outputs/reliability

The shipped policy drives a hand in real time whose fingers are blocked from the phase in question on. All ways out are
tried in all phases, at random moments. Let go means: the spring torque K_P |command - measured| of the last command is
at most `stop.tolerance`. Writes ways_out.md.
"""

import argparse
import itertools
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil

from benchmarks.faults.blocked_hand import FILE, OWN, shared, torque
from tactile_cube.agent.policy_file import current_commit
from tactile_cube.deployment.robot import StopRules

SIGNALS = {"SIGINT twice": ("SIGINT", "SIGINT")} | {
    name: (name,) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP")
}
WAYS = (*SIGNALS, "broken pipe", "disk full", *OWN[1:])
PHASES = ("waiting", "homing", "wait for object", "closing", "running", "stopping")
ONLY_RUNNING = ("disk full", "policy raises")
"""The log grows, and the policy is asked, in this phase alone."""
LONGEST = 0.4
"""Latest moment of a phase [s]; of the stop, which is shorter, a quarter."""
HANGS = 60.0
"""Seconds after which a process counts as hung, on a busy machine too."""
SETTINGS = ("seconds=20", "homing.speed=2", "homing.settle=0.1", "stop.lateness=0.25", "stop.silence=0.25")
"""Short phases; a busy machine is not to end a run before it is struck."""


@dataclass
class Outcome:
    """Outcome of an attack.

    Attributes:
        pressed: spring torque of the command when it struck, and `left` of the last one [N m].
        status: of the process; None: it hung.
        closed: whether the connection was.
        told: whether the command said that the fingers may still press.
    """

    way: str
    phase: str
    pressed: float
    left: float
    status: int | None
    closed: bool
    told: bool

    @property
    def lost(self) -> bool:
        """Whether it hung, did not close, or pressed on in silence."""
        return self.status is None or not self.closed or (self.left > StopRules().tolerance and not self.told)


def strike(way: str, phase: str, moment: float, place: Path) -> Outcome:
    """Attack one process and return the outcome."""
    place.mkdir()
    shared(place / "state", "w+").flush()
    state = shared(place / "state")[0]
    words = [sys.executable, "-m", "benchmarks.faults.blocked_hand", f"hydra.run.dir={place}/run", *SETTINGS]
    words += ["robot._target_=benchmarks.faults.blocked_hand.BlockedHand"]
    environment = os.environ | {FILE: str(place / "state")}
    streams: Any = {"stdout": subprocess.PIPE, "stderr": (place / "errors").open("w"), "text": True}
    process = subprocess.Popen(words, **streams, env=environment, process_group=0, preexec_fn=_as_at_a_terminal)
    try:
        _await(process, phase, state)
        state["blocked"] = 1
        time.sleep(moment)
        pressed = torque(state)
        if phase == "stopping":
            process.send_signal(signal.SIGTERM)
            time.sleep(moment / 4)
        _do(way, process, state)
        status = _end(process)
    finally:
        process.kill()
        process.wait()
    told = "may still press" in (place / "errors").read_text()
    return Outcome(way, phase, pressed, torque(state), status, bool(state["closed"]), told)


def _as_at_a_terminal() -> None:
    """Take no signal as ignored because whoever started this ignores it, as nohup does."""
    for name in set(itertools.chain(*SIGNALS.values())):
        signal.signal(signal.Signals[name], signal.SIG_DFL)


def _await(process: "subprocess.Popen[str]", phase: str, state: Any) -> None:
    assert process.stdout is not None
    if phase == "waiting":
        while not state["ready"] and process.poll() is None:
            time.sleep(0.002)
        return
    begins = "running" if phase == "stopping" else phase
    if not any(line.startswith(begins) for line in process.stdout):
        raise RuntimeError(f"ended before the phase {phase!r}")


def _do(way: str, process: "subprocess.Popen[str]", state: Any) -> None:
    if way in SIGNALS:
        for name in SIGNALS[way]:
            process.send_signal(signal.Signals[name])
            time.sleep(0.01)
    elif way == "broken pipe":
        assert process.stdout is not None
        process.stdout.close()
        process.send_signal(signal.SIGTERM)
    elif way == "disk full":
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (1000, 1000))
    else:
        state["way"] = OWN.index(way)


def _end(process: "subprocess.Popen[str]") -> int | None:
    """Return the status at the end; a process that was suspended goes on."""
    began = time.monotonic()
    while process.poll() is None and time.monotonic() - began < HANGS:
        if psutil.Process(process.pid).status() == psutil.STATUS_STOPPED:
            process.send_signal(signal.SIGCONT)
        time.sleep(0.02)
    return process.poll()


def table(outcomes: Sequence[Outcome]) -> str:
    """One line a way out."""
    head = ["way out", "struck", "pressed [N m]", "last command [N m]", "hung", "not closed", "said that it may press"]
    lines = [head, ["---"] * len(head)]
    for way in dict.fromkeys(one.way for one in outcomes):
        of = [one for one in outcomes if one.way == way]
        left = max((one.left for one in of if not one.told), default=0.0)
        torques = (f"{max(one.pressed for one in of):.2f}", f"{left:.4f}")
        counts = [sum(one.status is None for one in of), sum(not one.closed for one in of), sum(one.told for one in of)]
        lines.append([way, str(len(of)), *torques, *map(str, counts)])
    rows = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    lost = sum(one.lost for one in outcomes)
    return f"{len(outcomes)} attacks, {lost} with a loss; commit {current_commit()}; torques: the largest\n\n{rows}\n"


def main() -> None:
    """The command."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--attacks", type=int, default=100)
    words.add_argument("--seed", type=int, default=0)
    words.add_argument("--out", type=Path)
    given = words.parse_args()
    chance, outcomes = random.Random(given.seed), list[Outcome]()
    pairs = [(w, p) for w, p in itertools.product(WAYS, PHASES) if w not in ONLY_RUNNING or p == "running"]
    chance.shuffle(pairs)
    with tempfile.TemporaryDirectory() as place:
        for number, (way, phase) in zip(range(given.attacks), itertools.cycle(pairs), strict=False):
            outcomes.append(strike(way, phase, chance.uniform(0.0, LONGEST), Path(place) / str(number)))
            print(outcomes[-1], flush=True)
    print(table(outcomes))
    if given.out is not None:
        given.out.mkdir(parents=True, exist_ok=True)
        (given.out / "ways_out.md").write_text(table(outcomes))
    raise SystemExit(1 if any(one.lost for one in outcomes) else 0)


if __name__ == "__main__":
    main()
