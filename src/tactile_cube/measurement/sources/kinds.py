"""Which logs repeat one command: by their names, and by the commands themselves."""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.comparing.repeats import lag_between

Array = NDArray[np.float64]
COUNT = re.compile(r"[ _.-]*(?:(?:run|rep|repeat|trial|take|try|no|nr)[ _.-]*)?\(?\d+\)?$", re.IGNORECASE)
DATE = re.compile(r"[ _.-]*\d{4}[-_.]?\d{2}[-_.]?\d{2}(?:[ T_.-]*\d{2}[-_.:h]?\d{2}(?:[-_.:m]?\d{2})?)?[ _.-]*")
NO_NAME = "motion"
COARSE = 0.005  # [s] between samples is enough to tell two commands apart


def kinds_of(names: Sequence[str], commands: Sequence[Array], step: float) -> list[str]:
    """The kind of each log: logs of one name but for a number or a date, if their commands (n, joints) agree.

    Args:
        names: of the files, without endings.
        commands: as logged.
        step: time between samples [s].
    """
    words = [_without_count(name) for name in names]
    stride = max(1, round(COARSE / step))
    coarse = [command[::stride] for command in commands]
    kinds = [""] * len(names)
    for word in dict.fromkeys(words):
        members = [k for k, other in enumerate(words) if other == word]
        groups = _alike(members, coarse, stride * step)
        for group in groups:
            for k in group:
                kinds[k] = word if len(groups) == 1 else names[group[0]]
    return kinds


def _without_count(name: str) -> str:
    return COUNT.sub("", DATE.sub("_", name)).strip("_ .-") or NO_NAME


def _alike(members: Sequence[int], commands: Sequence[Array], step: float) -> list[list[int]]:
    groups: list[list[int]] = []
    for k in members:
        known = (group for group in groups if lag_between(commands[group[0]], commands[k], step) is not None)
        same = next(known, None)
        if same is None:
            groups.append([k])
        else:
            same.append(k)
    return groups
