"""The server of the workbench by HTTP, where no browser is needed."""

import asyncio
import contextlib
import http.client
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from email.message import Message
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urljoin, urlsplit

import pytest

from tactile_cube.errors import InputError

pytest.importorskip("bokeh")

from tactile_cube.workbench.desk import Desk
from tactile_cube.workbench.door import MESSAGE, start
from tests.workbench.in_a_thread import served_in_a_thread


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    with served_in_a_thread(Desk(tmp_path)) as url:
        yield url


class Answer(NamedTuple):
    status: int
    headers: Message
    text: str


def ask(address: str, **headers: str) -> Answer:
    """What the server says; redirections are not followed."""
    parts = urlsplit(address)
    with contextlib.closing(http.client.HTTPConnection(parts.netloc, timeout=60)) as line:
        line.request("GET", f"{parts.path}?{parts.query}", headers=headers)
        answer = line.getresponse()
        return Answer(answer.status, answer.headers, answer.read().decode())


def entered(address: str) -> dict[str, str]:
    """The cookie that the address gives."""
    given = ask(address).headers["Set-Cookie"]
    return {"Cookie": given.partition(";")[0]}


def test_the_token_is_exchanged_for_a_cookie_and_leaves_the_address(address: str) -> None:
    first = ask(address)
    assert (first.status, first.headers["Location"]) == (302, "/")
    cookie = first.headers["Set-Cookie"]
    assert {"HttpOnly", "SameSite=Lax", "Path=/"} <= set(cookie.split("; "))
    token = address.partition("token=")[2]
    whole = ask(urljoin(address, "/"), **entered(address))
    assert "data-root-id" in whole.text
    assert token not in whole.text, "nor in what Bokeh keeps of a request"
    linked = re.findall(r"""(?:src|href)=["']([^"']+)""", whole.text)
    assert linked == ["static/js/bokeh.min.js", "static/js/bokeh-widgets.min.js"]


PLACES = ("/", "/ws", "/metadata", "/autoload.js?bokeh-autoload-element=x", "/static/js/bokeh.min.js", "/none",
          "/next_experiment.csv", "/enter", "/enter?token=", "/enter?token=%00", "/enter?token=wrong")  # fmt: skip


@pytest.mark.parametrize("place", PLACES)
def test_a_third_user_gets_nothing(address: str, place: str) -> None:
    for headers in ({}, {"Cookie": "workbench=x"}, {"Cookie": f"workbench-{port_of(address)}=x"}):
        answer = ask(urljoin(address, place), **headers)
        assert answer.status == 403
        assert answer.text.endswith("Open the address that the workbench printed.")
        assert answer.headers["Content-Security-Policy"].startswith("default-src 'none'; script-src 'nonce-")


def test_a_socket_needs_the_cookie_and_the_pages_own_origin(address: str) -> None:
    upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
               "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Protocol": "bokeh, x"}  # fmt: skip
    place, known = urljoin(address, "/ws"), entered(address)
    assert ask(place, **upgrade, Origin=urljoin(address, "/")[:-1]).status == 403
    assert ask(place, **upgrade, **known, Origin="http://127.0.0.1:9").status == 403
    assert ask(place, **upgrade, **known, Origin="http://elsewhere").status == 403


def test_another_name_of_this_machine_is_refused_even_with_the_cookie(address: str) -> None:
    assert ask(urljoin(address, "/"), **entered(address), Host="elsewhere").status == 403


@pytest.mark.parametrize("place", ["/", "/static/js/bokeh.min.js", "/static/js/none.js", "/next_experiment.csv"])
def test_every_answer_says_which_scripts_may_run(address: str, place: str) -> None:
    known = entered(address)
    answers = [ask(urljoin(address, place), **known) for _ in range(2)]
    policies = [answer.headers["Content-Security-Policy"] for answer in answers]
    scripts = [re.findall(r"script-src ([^;]+);", policy)[0] for policy in policies]
    assert scripts[0] != scripts[1], "a nonce serves once"
    assert all(re.fullmatch(r"'nonce-[\w-]+'", one) for one in scripts)
    assert not any(word in policy for policy in policies for word in ("unsafe-eval", "*", "script-src 'unsafe-inline'"))
    assert [name for name in answers[0].headers if name.startswith("Access-Control")] == []


def test_each_script_of_the_page_has_the_nonce_of_its_answer(address: str) -> None:
    answer = ask(urljoin(address, "/"), **entered(address))
    nonce = re.findall("nonce-([^']+)", answer.headers["Content-Security-Policy"])[0]
    tags = [tag for tag in re.findall("<script[^>]*>", answer.text) if "application/json" not in tag]
    assert len(tags) == 4
    assert all(f'nonce="{nonce}"' in tag for tag in tags)


def test_a_large_request_is_refused_before_it_is_read(address: str) -> None:
    with socket.create_connection(("127.0.0.1", port_of(address))) as line:
        line.sendall(b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1000000000\r\n\r\n")
        assert line.recv(100).startswith(b"HTTP/1.1 4") or line.recv(1) == b""


def test_a_message_above_the_limit_closes_the_connection_before_it_is_sent(address: str) -> None:
    known = entered(address)
    token = re.findall(r'"token":"([^"]+)"', ask(urljoin(address, "/"), **known).text)[0]
    upgrade = {"Host": f"127.0.0.1:{port_of(address)}", "Origin": urljoin(address, "/")[:-1], "Upgrade": "websocket",
               "Connection": "Upgrade", "Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
               "Sec-WebSocket-Protocol": f"bokeh, {token}"} | known  # fmt: skip
    head = "".join(f"{name}: {value}\r\n" for name, value in upgrade.items())
    for size, ends in ((MESSAGE, False), (MESSAGE + 1, True)):
        with socket.create_connection(("127.0.0.1", port_of(address)), timeout=60) as line:
            line.sendall(f"GET /ws HTTP/1.1\r\n{head}\r\n".encode())
            assert line.recv(100).startswith(b"HTTP/1.1 101")
            line.sendall(b"\x82\xff" + size.to_bytes(8) + b"mask" + b"first bytes")
            line.settimeout(5.0)
            with contextlib.suppress(TimeoutError, ConnectionResetError):
                while line.recv(10_000):
                    pass
                assert ends
                continue
            assert not ends


def port_of(address: str) -> int:
    return int(re.findall(r":(\d+)/", address)[0])


@contextlib.contextmanager
def ended(run: subprocess.Popen[str]) -> Iterator[None]:
    """A program that does not outlive its test, whatever the test raises."""
    try:
        yield
    finally:
        run.kill()


READ = """
import os, pathlib, sys
os.setgroups([]); os.setgid(65534); os.setuid(65534)
for path in pathlib.Path(sys.argv[1]).rglob("*"):
    try:
        print(path, path.read_bytes())
    except OSError:
        pass
"""


@pytest.fixture
def passable() -> Iterator[Path]:
    """A folder that every user of the machine may enter."""
    with tempfile.TemporaryDirectory(dir="/tmp") as place:
        Path(place).chmod(0o755)
        yield Path(place)


def test_no_log_file_or_command_line_has_the_token_and_others_read_nothing(tmp_path: Path, passable: Path) -> None:
    seen, folder = tmp_path / "browser", passable / "run"
    seen.write_text(f'#!/bin/sh\necho "$@" > {tmp_path}/line\ncp "${{1#file://}}" {tmp_path}/copy\n')
    seen.chmod(0o755)
    (passable / "seen").write_text("by all")
    words = [sys.executable, "-m", "tactile_cube.workbench", f"hydra.run.dir={folder}"]
    environment = os.environ | {"BROWSER": str(seen)}
    output = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    with subprocess.Popen(words, **output, env=environment) as run, ended(run):
        assert run.stdout is not None
        address = next(found.group() for line in run.stdout if (found := re.search(r"http://\S+", line)))
        token = address.partition("token=")[2]
        assert ask(address).status == 302
        assert ask(address + "x").status == 403
        for _ in range(100):
            if (tmp_path / "copy").exists() and token in (tmp_path / "copy").read_text():
                break
            time.sleep(0.1)
        line = (tmp_path / "line").read_text()
        assert token in (tmp_path / "copy").read_text(), "the browser follows a file"
        assert token not in line
        modes = {path.name: path.stat().st_mode & 0o077 for path in folder.glob("*.*") if path.is_file()}
        assert modes == {"workbench.log": 0, "open.html": 0}
        if os.getuid() == 0:  # only root becomes somebody else
            read = [sys.executable, "-c", READ, str(passable)]
            assert subprocess.check_output(read, text=True) == f"{passable}/seen b'by all'\n"
        run.send_signal(signal.SIGTERM)  # which is taken as Ctrl-C is
        said = run.stdout.read()
        assert run.wait() in (0, 130)
    assert token not in said
    assert not (folder / "open.html").exists()
    kept = [path for path in folder.rglob("*") if path.is_file()]
    assert {path.name for path in kept} > {"workbench.log", "config.yaml"}
    assert [path for path in kept if token in path.read_text()] == []


def test_a_port_that_is_taken_is_named(address: str, tmp_path: Path) -> None:
    port = port_of(address)
    with pytest.raises(InputError, match=rf"port={port}: .*choose another one"):
        asyncio.run(_start(Desk(tmp_path), port))


async def _start(desk: Desk, port: int) -> None:
    start(desk, port)
