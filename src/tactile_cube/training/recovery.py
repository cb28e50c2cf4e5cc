"""Workers that die, fail or get stuck: the run goes back to its last barrier with new ones."""

import gc
from collections.abc import Callable

from tactile_cube.training.collection import CollectionError
from tactile_cube.training.run import Run

ATTEMPTS = 3
"""Times in a row that workers may fail without a barrier reached in between."""


def train_on(build: Callable[[], Run], again: Callable[[], Run] | None = None) -> tuple[Run, str]:
    """Train to the end through faults of the workers; gives the closed run and the reason it ended.

    All since the barrier is done again from the same state, so that its numbers are those of a run without faults.
    `build` makes the run, fresh or from its last checkpoint; `again` makes it once more after a fault, by default
    likewise.

    Raises:
        CollectionError: workers failed `ATTEMPTS` times without a barrier reached in between.
    """
    failures, reached = 0, -1
    while True:
        run, outcome = _session(build)
        if run is not None and isinstance(outcome, str):
            run.conclude(outcome)
            return run, outcome
        saved_at = run.saved_at if run is not None else -1
        failures, reached = (1 if saved_at > reached else failures + 1), max(saved_at, reached)
        if failures == ATTEMPTS:
            raise CollectionError(f"{outcome}; {ATTEMPTS} times in a row without a barrier in between")
        print(f"fault: {outcome}; going back to the last barrier with new workers", flush=True)
        build = (again or build) if run is not None else build
        del run
        gc.collect()  # its replay is as large as the next one's


def _session(build: Callable[[], Run]) -> tuple[Run | None, str | CollectionError]:
    """Train until the end or a fault of the workers."""
    run = None
    try:
        run = build()
        run.announce()
        return run, run.train()
    except CollectionError as error:
        return run, CollectionError(str(error))  # its cause would keep what failed from being deleted
    finally:
        if run is not None:
            run.close()
