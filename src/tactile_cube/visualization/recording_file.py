"""A Rerun recording as a file, whole when the block ends that writes it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
from rerun_bindings import flush_and_cleanup_orphaned_recordings

APPLICATION = "tactile_cube"


@contextmanager
def recording_file(
    path: Path, blueprint: rrb.Blueprint, application: str = APPLICATION
) -> Iterator[rr.RecordingStream]:
    """Write a recording; open it with `rerun FILE.rrd`.

    Rerun keeps threads and buffers of every recording until the program ends, unless it is told to let go of those that
    nothing refers to any more, which happens here to those of earlier files. The two threads of a blueprint stay, idle.

    Args:
        path: file to write, `.rrd`.
        blueprint: how the viewer arranges it.
        application: recordings of one application share their arrangement in the viewer.
    """
    flush_and_cleanup_orphaned_recordings()
    stream = rr.RecordingStream(application, recording_id=path.stem)
    stream.save(path, default_blueprint=blueprint)
    try:
        yield stream
    finally:
        stream.flush()
        stream.disconnect()
