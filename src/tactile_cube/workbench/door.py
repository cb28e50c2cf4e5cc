"""Server of the page: its secret address, access control, and what a browser may do with the page."""

import secrets
from importlib import resources
from pathlib import Path
from typing import Any

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.document import Document
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from bokeh.server.util import bind_sockets
from jinja2 import Template
from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPHeaders, HTTPServerRequest
from tornado.ioloop import IOLoop
from tornado.web import OutputTransform, RequestHandler

from tactile_cube.errors import InputError
from tactile_cube.workbench import page
from tactile_cube.workbench.desk import Desk

HOST, ENTER, COMMANDS = "127.0.0.1", "/enter", "/next_experiment.csv"
NONCE = secrets.token_urlsafe(16)
"""Placeholder in the page, which each response replaces by its own nonce of the same length."""
MESSAGE = 280_000_000
"""Bytes of a message from the page: two files of `importing.LARGEST` as base64; more closes the connection."""
BODY = 100_000
"""Bytes of a request; the page sends its files as messages."""
OURS = ("/", "/ws", COMMANDS, "/favicon.ico")
POLICY = (
    "default-src 'none'; script-src 'nonce-{nonce}'; connect-src 'self' ws://{host}; img-src 'self' data: blob:; "
    "style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
REFUSAL = "<!DOCTYPE html><title>workbench</title>Open the address that the workbench printed."


def start(desk: Desk, port: int = 0) -> tuple[BaseServer, str]:
    """Serve a desk on 127.0.0.1 and return the server, not yet running, and its address with the token.

    Raises:
        InputError: a port that is taken.
    """
    template = Template(resources.files(__package__).joinpath("page.html.jinja").read_text(encoding="utf-8"))

    def window(document: Document) -> None:
        document.title, document.template, document.template_variables["nonce"] = "workbench", template, NONCE
        page.Page(document, desk)

    try:
        sockets, port = bind_sockets(HOST, port)
    except OSError as error:
        said = f"port={port}: {error.strerror or error}; choose another one, or 0 for any that is free"
        raise InputError(said) from None
    door = Door(Application(FunctionHandler(window)), desk, port)
    http = HTTPServer(door, max_body_size=BODY)
    http.add_sockets(sockets)
    server = BaseServer(IOLoop.current(), door, http)
    server.start()
    return server, f"http://{HOST}:{port}{ENTER}?token={door.token}"


class Door(BokehTornado):  # type: ignore[misc]
    """Bokeh's application behind a token: the address has it, and gives a cookie for it; all else needs the cookie."""

    def __init__(self, application: Application, desk: Desk, port: int) -> None:
        self.token, self._host = secrets.token_urlsafe(24), f"{HOST}:{port}"
        self.cookie = f"workbench-{port}"  # browsers do not tell ports apart
        super().__init__(
            application,
            extra_websocket_origins=[self._host],
            extra_patterns=[(ENTER, Enter), (COMMANDS, Commands, {"desk": desk})],
            include_headers=[],  # Bokeh would write the cookie into the page
            include_cookies=[],
            websocket_max_message_size_bytes=MESSAGE,
            transforms=[Guarded],
            log_function=lambda handler: None,  # an access line would hold the token
        )

    def find_handler(self, request: HTTPServerRequest, **more: Any) -> Any:
        """Return what answers a request: without the cookie nothing of Bokeh's, with it what the page uses."""
        cookie = request.cookies.get(self.cookie)
        given = request.query_arguments.get("token", [b""])[-1] if request.path == ENTER else b""
        used = request.path in OURS or request.path.startswith("/static/js/")
        known = given if cookie is None or not used else cookie.value.encode()
        if request.host == self._host and secrets.compare_digest(known, self.token.encode()):
            return super().find_handler(request, **more)
        return self.get_handler_delegate(request, Refused)


class Guarded(OutputTransform):  # type: ignore[misc]
    """Headers of every answer: which scripts run, what the page may load, and nothing for other pages."""

    def __init__(self, request: HTTPServerRequest) -> None:
        self._host = request.host

    def transform_first_chunk(
        self, status_code: int, headers: HTTPHeaders, chunk: bytes, finishing: bool
    ) -> tuple[int, HTTPHeaders, bytes]:
        """Set them, and put a fresh nonce into the page."""
        nonce = secrets.token_urlsafe(16)
        headers["Content-Security-Policy"] = POLICY.format(nonce=nonce, host=self._host)
        headers["X-Content-Type-Options"], headers["Referrer-Policy"] = "nosniff", "no-referrer"
        if "text/html" in headers.get("Content-Type", ""):
            headers["Cache-Control"] = "no-store"
            chunk = chunk.replace(NONCE.encode(), nonce.encode())
        return status_code, headers, chunk


class Refused(RequestHandler):  # type: ignore[misc]
    """Say what to do, whatever was asked."""

    def prepare(self) -> None:
        """Answer."""
        self.set_status(403)
        self.finish(REFUSAL)


class Enter(RequestHandler):  # type: ignore[misc]
    """Exchange the token for a cookie, and show the page at an address without it."""

    application: Door

    def get(self) -> None:
        """Answer."""
        self.set_cookie(self.application.cookie, self.application.token, httponly=True, samesite="Lax")
        self.redirect("/")


class Commands(RequestHandler):  # type: ignore[misc]
    """The proposed commands as a file."""

    def initialize(self, desk: Desk) -> None:
        """Take the desk."""
        self._desk = desk

    def get(self) -> None:
        """Answer."""
        self.set_header("Content-Type", "text/csv; charset=utf-8")
        self.set_header("Content-Disposition", f'attachment; filename="{Path(COMMANDS).name}"')
        self.finish(self._desk.commands)
