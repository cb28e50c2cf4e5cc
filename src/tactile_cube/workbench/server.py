"""The server of a workbench: one machine, one user, an address that nobody guesses."""

from __future__ import annotations

import logging
import secrets
import webbrowser
from importlib import resources
from typing import TYPE_CHECKING

from tactile_cube.api.job import Job
from tactile_cube.errors import InputError

if TYPE_CHECKING:
    from bokeh.document import Document
    from bokeh.server.server import Server

    from tactile_cube.workbench.desk import Desk

HOST = "127.0.0.1"
MESSAGE = 280_000_000
"""Bytes of a message from the page: two files of `importing.LARGEST` as base64; more closes the connection."""


def start(desk: Desk, port: int = 0) -> tuple[Server, str]:
    """Serve a desk on 127.0.0.1 and return the server, not yet running, and its address with the token.

    Raises:
        InputError: a port that is taken, or Bokeh is not installed.
    """
    try:
        from bokeh.application import Application
        from bokeh.application.handlers.document_lifecycle import DocumentLifecycleHandler
        from bokeh.application.handlers.function import FunctionHandler
        from bokeh.server.server import Server
    except ModuleNotFoundError:
        raise InputError("the workbench needs Bokeh: pip install 'tactile-cube[workbench]'") from None
    from jinja2 import Template

    from tactile_cube.workbench.page import Page

    token = secrets.token_urlsafe(24)
    template = Template(resources.files(__package__).joinpath("page.html.jinja").read_text(encoding="utf-8"))
    refusal = Template("<!DOCTYPE html><title>workbench</title>Open the address that the workbench printed.")

    def window(document: Document) -> None:
        asked = document.session_context.request.arguments.get("token", [b""])[0]
        right = secrets.compare_digest(asked, token.encode())
        document.title, document.template = "workbench", template if right else refusal
        if right:
            Page(document, desk)

    try:
        application = Application(FunctionHandler(window), DocumentLifecycleHandler())
        server = Server(application, address=HOST, port=port, websocket_max_message_size=MESSAGE)
    except OSError as error:
        raise InputError(
            f"port={port}: {error.strerror or error}; choose another one, or 0 for any that is free"
        ) from None
    server.start()
    return server, f"http://{HOST}:{server.port}/?token={token}"


def serve(job: Job) -> None:
    """Serve until Ctrl-C."""
    from tactile_cube.workbench.desk import Desk

    logging.getLogger("bokeh").setLevel(logging.ERROR)
    config = job.config
    desk = Desk(job.folder, config.own_effects or (), config.seed, config.model)
    server, address = start(desk, config.port)
    if config.recording is not None:
        desk.open(str(config.recording))
    print(f"workbench: {address}\nCtrl-C ends it", flush=True)
    if config.open:
        webbrowser.open(address)
    try:
        server.io_loop.start()
    except KeyboardInterrupt:
        desk.stop()
