"""The command: a workbench for one user of one machine, until Ctrl-C or SIGTERM."""

import contextlib
import logging
import os
import signal
import sys
import webbrowser
from collections.abc import Iterator
from pathlib import Path

from tactile_cube.api.job import Job
from tactile_cube.errors import InputError
from tactile_cube.whole_file import write_whole

REDIRECT = '<!DOCTYPE html><meta http-equiv="refresh" content="0;url={}">'


def serve(job: Job) -> None:
    """Serve until Ctrl-C or SIGTERM, which end a diagnosis that runs too.

    What it writes is its user's alone, and the token stands in no log and no command line.
    """
    try:
        from tactile_cube.workbench.door import start
    except ModuleNotFoundError:
        raise InputError("the workbench needs Bokeh: pip install 'tactile-cube[workbench]'") from None
    from tactile_cube.workbench.desk import Desk

    logging.getLogger("bokeh").setLevel(logging.ERROR)
    os.umask(0o077)
    for file in (*job.folder.glob("*.log"), *job.folder.glob(".hydra/*")):  # written before
        file.chmod(0o600)
    config = job.config
    desk = Desk(job.folder, config.own_effects or (), config.seed, config.model)
    server, address = start(desk, config.port)
    if config.recording is not None:
        desk.open(str(config.recording))
    print(f"workbench: {address}\nCtrl-C ends it", file=sys.__stdout__, flush=True)  # past the log
    with _opened(job.folder / "open.html", address) if config.open else contextlib.nullcontext():
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        with contextlib.suppress(KeyboardInterrupt):
            server.io_loop.start()
        desk.end()


@contextlib.contextmanager
def _opened(file: Path, address: str) -> Iterator[None]:
    """Open a browser by a file, as other users of the machine see its command line."""
    write_whole(file, REDIRECT.format(address).encode())
    try:
        webbrowser.open(file.resolve().as_uri())
        yield
    finally:
        file.unlink(missing_ok=True)
