"""Who may ask the workbench's server for what, and what a browser may do with its answers."""

from __future__ import annotations

import secrets
from pathlib import Path
from typing import Any

from bokeh.application import Application
from bokeh.server.tornado import BokehTornado
from tornado.httputil import HTTPHeaders, HTTPServerRequest
from tornado.web import OutputTransform, RequestHandler

from tactile_cube.workbench.desk import Desk

NONCE = secrets.token_urlsafe(16)
"""Stands in the page where each answer puts a nonce of its own, of the same length."""
ENTER, COMMANDS = "/enter", "/next_experiment.csv"
OURS = ("/", "/ws", COMMANDS, "/favicon.ico")
POLICY = (
    "default-src 'none'; script-src 'nonce-{nonce}'; connect-src 'self' ws://{host}; img-src 'self' data: blob:; "
    "style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
REFUSAL = "<!DOCTYPE html><title>workbench</title>Open the address that the workbench printed."


class Door(BokehTornado):  # type: ignore[misc]
    """Bokeh's application behind a token: the address has it, and gives a cookie for it; all else needs the cookie.

    Attributes:
        token: nobody guesses it.
    """

    def __init__(self, application: Application, desk: Desk, port: int, largest: int) -> None:
        self.token, self._host = secrets.token_urlsafe(24), f"127.0.0.1:{port}"
        self.cookie = f"workbench-{port}"  # browsers do not tell ports apart
        super().__init__(
            application,
            extra_websocket_origins=[self._host],
            extra_patterns=[(ENTER, Enter), (COMMANDS, Commands, {"desk": desk})],
            include_headers=[],  # Bokeh would write the cookie into the page
            include_cookies=[],
            websocket_max_message_size_bytes=largest,
            transforms=[Guarded],
            log_function=lambda handler: None,  # an access line would hold the token
        )

    def find_handler(self, request: HTTPServerRequest, **more: Any) -> Any:
        """Return what answers a request: without the cookie nothing of Bokeh's, with it what the page uses."""
        cookie = request.cookies.get(self.cookie)
        known = cookie is not None and secrets.compare_digest(cookie.value.encode(), self.token.encode())
        used = request.path in OURS or request.path.startswith("/static/js/")
        if request.host == self._host and (request.path == ENTER or (known and used)):
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


class Enter(RequestHandler):  # type: ignore[misc]
    """Exchange the token for a cookie, and show the page at an address without it."""

    application: Door

    def get(self) -> None:
        """Answer."""
        given = self.get_query_argument("token", "")
        if not secrets.compare_digest(given.encode(), self.application.token.encode()):
            self.set_status(403)
            self.finish(REFUSAL)
            return
        self.set_cookie(self.application.cookie, self.application.token, httponly=True, samesite="Lax")
        self.redirect("/")


class Refused(RequestHandler):  # type: ignore[misc]
    """Say what to do, whatever was asked."""

    def prepare(self) -> None:
        """Answer."""
        self.set_status(403)
        self.finish(REFUSAL)


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
