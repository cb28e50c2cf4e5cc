"""What `make` does to set up, tried with an interpreter that only notes what pip is asked for."""

import http.server
import os
import re
import shutil
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SAID = "taking that of pip's own index"


@contextmanager
def index(kind: str) -> Iterator[str]:
    """URL of a package index that answers, that refuses connections, or that takes them and stays silent."""
    if kind == "answers":
        with http.server.HTTPServer(("127.0.0.1", 0), Answers) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            yield f"http://127.0.0.1:{server.server_port}"
            server.shutdown()
        return
    with socket.socket() as quiet:
        quiet.bind(("127.0.0.1", 0))
        if kind == "silent":
            quiet.listen()
        yield f"http://127.0.0.1:{quiet.getsockname()[1]}"


class Answers(http.server.BaseHTTPRequestHandler):
    """Gives an empty page."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.end_headers()

    def log_message(self, *_: object) -> None:
        """Say nothing."""


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
@pytest.mark.parametrize(
    ("kind", "gpu", "asked", "said"),
    [
        ("answers", False, True, False),
        ("refuses", False, False, True),
        ("silent", False, False, True),
        ("answers", True, False, False),
    ],
)
def test_torch_comes_without_cuda_where_no_gpu_is_and_its_index_answers(kind, gpu, asked, said, tmp_path) -> None:
    programs = {
        "python": f'if [ "$1" = -m ]; then echo "$@" >> {tmp_path}/pip; else exec {sys.executable} "$@"; fi',
        "nvidia-smi": f"exit {0 if gpu else 9}",
    }
    for name, text in programs.items():
        (tmp_path / name).write_text(f"#!/bin/sh\n{text}\n")
        (tmp_path / name).chmod(0o755)
    environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "no_proxy": "*"}
    with index(kind) as url:
        command = ["make", "--silent", "torch", f"BIN={tmp_path}", f"TORCH_INDEX={url}"]
        run = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=60, check=True)
    assert (SAID in run.stdout, run.stderr) == (said, "")
    assert (tmp_path / "pip").exists() == asked
    if asked:
        (pinned,) = re.findall("^torch==.*", (ROOT / "requirements.txt").read_text(), re.MULTILINE)
        assert (tmp_path / "pip").read_text().endswith(f"--no-deps --index-url {url} {pinned}\n")
