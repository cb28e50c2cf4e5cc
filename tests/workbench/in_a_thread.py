"""The workbench's server in a thread of a test."""

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from tactile_cube.workbench.desk import Desk
from tactile_cube.workbench.door import start


@contextmanager
def served_in_a_thread(desk: Desk) -> Iterator[str]:
    """Address of a desk's page, with the token."""
    started: list[tuple[str, Any]] = []
    ready = threading.Event()

    def run() -> None:
        asyncio.set_event_loop(asyncio.new_event_loop())
        server, url = start(desk)
        started.append((url, server.io_loop))
        ready.set()
        server.io_loop.start()

    thread = threading.Thread(target=run)
    thread.start()
    assert ready.wait(60)
    yield started[0][0]
    started[0][1].add_callback(started[0][1].stop)
    thread.join()
