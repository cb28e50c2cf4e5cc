"""A Rerun recording as a file, whole when the block ends that writes it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
import rerun_bindings

APPLICATION = "tactile_cube"


@contextmanager
def recording_file(
    path: Path, blueprint: rrb.Blueprint, application: str = APPLICATION
) -> Iterator[rr.RecordingStream]:
    """Write a recording; open it with `rerun FILE.rrd`.

    Rerun keeps threads and buffers of every recording until the program ends, unless it is told to let go of those that
    nothing refers to any more, which happens here to those of earlier files.

    Args:
        path: file to write, `.rrd`.
        blueprint: how the viewer arranges it.
        application: recordings of one application share their arrangement in the viewer.
    """
    rerun_bindings.flush_and_cleanup_orphaned_recordings()
    stream = rr.RecordingStream(application, recording_id=path.stem)
    _save(stream, path, blueprint, application)
    try:
        yield stream
    finally:
        stream.flush()
        stream.disconnect()


def _save(stream: rr.RecordingStream, path: Path, blueprint: rrb.Blueprint, application: str) -> None:
    """What `stream.save(path, default_blueprint=blueprint)` does, but the blueprint's own stream is closed after it.

    Rerun's keeps that stream, two threads, for good: its memory refers to it, and it to its memory (rerun-sdk 0.41.0).
    """
    native = rerun_bindings.new_blueprint(
        application_id=application, make_default=False, make_thread_default=False, default_enabled=True
    )
    layout = rr.RecordingStream._from_native(native)
    layout.set_time("blueprint", sequence=0)
    blueprint._log_to_stream(layout)
    rerun_bindings.save(
        path=str(path), default_blueprint=layout.memory_recording().storage, recording=stream.to_native()
    )
    layout.disconnect()
