"""Which trials are fitted and which are held out: split by trial, never by sample."""

import numpy as np

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.recording import Recording


def held_out_split(recording: Recording, share: float = 0.33, seed: int = 0) -> tuple[Recording, Recording]:
    """The trials to fit and the trials to judge by.

    Whole robot initialisations are held out where there are several, so that no joint offset is on both sides;
    otherwise whole trials: of each kind that was repeated all but one at most, or, if none was, of all kinds together.

    Args:
        recording: at least two trials.
        share: part of the trials that is held out.
        seed: which ones.

    Raises:
        InputError: there is one trial alone.
    """
    if len(recording.trials) < 2:
        raise InputError(
            f"{recording.folder}: 1 trial in all, so none can be held out to judge by; record more, or cut the log in "
            "several (record source=csv source.length=SECONDS)"
        )
    rng = np.random.default_rng(seed)
    initialisations = sorted({trial.initialisation for trial in recording.trials})
    if len(initialisations) > 1:
        count = max(1, round(share * len(initialisations)))
        held = set(rng.permutation(initialisations)[:count].tolist())
        chosen = [trial.initialisation in held for trial in recording.trials]
    else:
        kinds = [trial.kind for trial in recording.trials]
        repeated = len(set(kinds)) < len(kinds)
        chosen = _trials_of_each_kind(kinds if repeated else ["any"] * len(kinds), share, rng)
    trials = list(zip(recording.trials, chosen, strict=True))
    return (
        recording.with_trials([trial for trial, held_out in trials if not held_out]),
        recording.with_trials([trial for trial, held_out in trials if held_out]),
    )


def _trials_of_each_kind(kinds: list[str], share: float, rng: np.random.Generator) -> list[bool]:
    chosen = [False] * len(kinds)
    for kind in dict.fromkeys(kinds):
        members = [index for index, other in enumerate(kinds) if other == kind]
        count = min(len(members) - 1, max(1, round(share * len(members))))
        for index in rng.permutation(members)[:count]:
            chosen[int(index)] = True
    return chosen
