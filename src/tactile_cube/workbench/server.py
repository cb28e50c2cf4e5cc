"""The server of a workbench: one machine, one user, an address that nobody guesses."""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import sys
import webbrowser
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from tactile_cube.api.job import Job
from tactile_cube.errors import InputError
from tactile_cube.whole_file import write_whole

if TYPE_CHECKING:
    from bokeh.document import Document
    from bokeh.server.server import BaseServer

    from tactile_cube.workbench.desk import Desk

HOST = "127.0.0.1"
MESSAGE = 280_000_000
"""Bytes of a message from the page: two files of `importing.LARGEST` as base64; more closes the connection."""
BODY = 100_000
"""Bytes of a request; the page sends its files as messages."""
REDIRECT = '<!DOCTYPE html><meta http-equiv="refresh" content="0;url={}">'


def start(desk: Desk, port: int = 0) -> tuple[BaseServer, str]:
    """Serve a desk on 127.0.0.1 and return the server, not yet running, and its address with the token.

    Raises:
        InputError: a port that is taken, or Bokeh is not installed.
    """
    try:
        from bokeh.application import Application
        from bokeh.application.handlers.function import FunctionHandler
        from bokeh.server.server import BaseServer
        from bokeh.server.util import bind_sockets
    except ModuleNotFoundError:
        raise InputError("the workbench needs Bokeh: pip install 'tactile-cube[workbench]'") from None
    from jinja2 import Template
    from tornado.httpserver import HTTPServer
    from tornado.ioloop import IOLoop

    from tactile_cube.workbench.door import ENTER, NONCE, Door
    from tactile_cube.workbench.page import Page

    template = Template(resources.files(__package__).joinpath("page.html.jinja").read_text(encoding="utf-8"))

    def window(document: Document) -> None:
        document.title, document.template, document.template_variables["nonce"] = "workbench", template, NONCE
        Page(document, desk)

    try:
        sockets, port = bind_sockets(HOST, port)
    except OSError as error:
        raise InputError(
            f"port={port}: {error.strerror or error}; choose another one, or 0 for any that is free"
        ) from None
    door = Door(Application(FunctionHandler(window)), desk, port, MESSAGE)
    http = HTTPServer(door, max_body_size=BODY)
    http.add_sockets(sockets)
    server = BaseServer(IOLoop.current(), door, http)
    server.start()
    return server, f"http://{HOST}:{port}{ENTER}?token={door.token}"


def serve(job: Job) -> None:
    """Serve until Ctrl-C or SIGTERM, which end a diagnosis that runs too.

    What it writes is its user's alone, and the token stands in no log and no command line.
    """
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
