"""The server of the workbench by HTTP, where no browser is needed."""

import asyncio
import re
import threading
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from tactile_cube.errors import InputError

pytest.importorskip("bokeh")

from tactile_cube.workbench.desk import Desk
from tactile_cube.workbench.server import start


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    started: list[str] = []
    ready = threading.Event()
    loops = []

    def run() -> None:
        asyncio.set_event_loop(asyncio.new_event_loop())
        server, url = start(Desk(tmp_path))
        started.append(url)
        loops.append(server.io_loop)
        ready.set()
        server.io_loop.start()

    thread = threading.Thread(target=run)
    thread.start()
    assert ready.wait(60)
    yield started[0]
    loops[0].add_callback(loops[0].stop)
    thread.join()


def page(address: str) -> str:
    with urllib.request.urlopen(address) as answer:
        return str(answer.read().decode())


def test_the_page_needs_the_token_and_nothing_from_elsewhere(address: str) -> None:
    assert address.startswith("http://127.0.0.1:")
    whole = page(address)
    assert "data-root-id" in whole
    assert [url for url in re.findall(r"""(?:src|href)=["']([^"']+)""", whole) if not url.startswith("/static/")] == []
    for wrong in (address.partition("?")[0], address + "x"):
        assert "data-root-id" not in page(wrong)
        assert "Open the address that the workbench printed" in page(wrong)


def test_a_port_that_is_taken_is_named(address: str, tmp_path: Path) -> None:
    port = int(re.findall(r":(\d+)/", address)[0])
    with pytest.raises(InputError, match=rf"port={port}: .*choose another one"):
        asyncio.run(_start(Desk(tmp_path), port))


async def _start(desk: Desk, port: int) -> None:
    start(desk, port)
