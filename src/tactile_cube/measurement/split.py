"""Split into training, validation and test trials: by trial, never by sample."""

from collections import Counter

import numpy as np

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.recording import Recording


def held_out_split(recording: Recording, share: float = 0.33, seed: int = 0) -> tuple[Recording, Recording]:
    """Split a recording into trials to fit and a held-out `share` of all trials, chosen by `seed`.

    Whole robot initialisations are held out if there are several, so that no joint offset is on both sides; otherwise
    whole trials: all but one at most of each repeated kind, or, if no kind is repeated, of all kinds together.

    Raises:
        InputError: there is only one trial.
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
        kinds = kinds if len(set(kinds)) < len(kinds) else ["any"] * len(kinds)
        chosen = [False] * len(kinds)
        for kind in dict.fromkeys(kinds):
            members = [index for index, other in enumerate(kinds) if other == kind]
            count = min(len(members) - 1, max(1, round(share * len(members))))
            for index in rng.permutation(members)[:count]:
                chosen[int(index)] = True
    trials = list(zip(recording.trials, chosen, strict=True))
    fitted, judged = ([trial for trial, out in trials if out is wanted] for wanted in (False, True))
    return recording.with_trials(fitted), recording.with_trials(judged)


TESTED = 0.15  # of all trials
FEWEST_FITTED = 5  # trials that stay to be fitted; with fewer a test part would take what the fit needs


def with_test_part(fitted: Recording, trials: int, seed: int = 0) -> tuple[Recording, Recording | None]:
    """Split test trials off the trials to fit: nothing is fitted to them and nothing is chosen by them.

    They come from the trials to fit, as the held-out ones are few already; of each kind at least one stays there.
    The test part is None if there are too few trials. `trials` is the recording's number of trials, `seed` chooses.
    """
    kinds = Counter(trial.kind for trial in fitted.trials)
    repeated = max(kinds.values()) > 1
    count = min(max(1, round(TESTED * trials)), len(fitted.trials) - FEWEST_FITTED)
    chosen: set[int] = set()
    for index in np.random.default_rng([seed, 1]).permutation(len(fitted.trials)).tolist():
        kind = fitted.trials[index].kind
        if len(chosen) < count and (kinds[kind] > 1 or not repeated) and fitted.trials[index].valid.any():
            chosen.add(index)
            kinds[kind] -= 1
    if not chosen:
        return fitted, None
    rows = list(enumerate(fitted.trials))
    kept, tested = ([trial for k, trial in rows if (k in chosen) is test] for test in (False, True))
    return fitted.with_trials(kept), fitted.with_trials(tested)
