"""A ROS 2 bag in MCAP (joint states and commands) as a recording; needs the extra `ros`, but no ROS."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Literal

import numpy as np

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.description import PerJoint, Rate, TrialEntry
from tactile_cube.measurement.recordings.rig import read_rig
from tactile_cube.measurement.recordings.writing import Array, RecordingTables, TrialTable
from tactile_cube.measurement.sources.source import described, listed, rate_of, with_stated
from tactile_cube.untrusted_file import regular

if TYPE_CHECKING:
    from mcap.records import Chunk

SAME_STAMP = 1e-6  # [s]


@dataclass(frozen=True)
class RosBag:
    """Imports bags, one trial each; conf/source/mcap.yaml says what each setting means, and its units.

    Efforts of the joint states become torques. A Float64MultiArray of commands is in the order of `joints`.
    """

    files: str | Sequence[str]
    urdf: str
    joints: Sequence[str]
    controller: Mapping[str, PerJoint | None]
    states: str
    commands: str
    nominal: Mapping[str, PerJoint | None]
    gravity: tuple[float, float, float]
    rate: Rate | None
    read: Literal["before", "after"]

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """Build one recording of all bags."""
        rig, joints = read_rig(Path(self.urdf)), list(self.joints)
        tables = [self._trial(Path(name), joints) for name in listed(self.files)]
        rate = self.rate if self.rate is not None else rate_of(tables[0].time, 2, str(tables[0].entry.note))
        description = described(
            gravity=list(self.gravity), rate_hz=rate, joints=joints, sensors={"read": self.read},
            controller=with_stated(self.controller, rig.gains, joints),
            nominal=with_stated(self.nominal, rig.nominal, joints),
        )  # fmt: skip
        return {"": RecordingTables(description, rig.text, tables, list(rig.understood(joints)))}

    def _trial(self, path: Path, joints: list[str]) -> TrialTable:
        messages = _messages(path, (self.states, self.commands))
        states, orders = messages[self.states], messages[self.commands]
        time, when = (np.array([stamp for stamp, _ in one]) for one in (states, orders))
        position = np.stack([_by_joint(message, joints, path, "position") for _, message in states])
        command = np.stack([_by_joint(message, joints, path, "command") for _, message in orders])
        keep = time + SAME_STAMP >= max(time[0], when[0])
        held = np.searchsorted(when, time[keep] + SAME_STAMP, side="right") - 1
        torque = None
        if all(len(message.effort) == len(message.name) for _, message in states):
            torque = np.stack([_ordered(message.name, message.effort, joints) for _, message in states])[keep]
        entry = TrialEntry(file=f"trials/{path.stem}.parquet", kind=path.stem, note=f"from {path.name}")
        return TrialTable(entry, time[keep] - time[keep][0], command[held], position[keep], torque)


def _messages(path: Path, topics: tuple[str, str]) -> dict[str, list[tuple[float, Any]]]:
    """Return topic -> (time [s], message)."""
    found: dict[str, list[tuple[float, Any]]] = {topic: [] for topic in topics}
    try:
        with regular(path).open("rb") as stream:
            for number, (topic, seconds, message) in enumerate(_decoded(stream, topics)):
                if number == limits.MESSAGES:
                    raise InputError(f"{path}: more than {number} messages on {' and '.join(topics)}; split the bag")
                found[topic].append((seconds, message))
    except InputError:
        raise
    except ImportError:
        raise InputError("source=mcap needs the optional extra: pip install 'tactile-cube[ros]'") from None
    except Exception as error:  # decoder and decompressors raise a dozen kinds for damaged files
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: not a complete MCAP file: {reason}") from None
    for topic, messages in found.items():
        if len(messages) < 2:
            raise InputError(
                f"{path}: {len(messages)} messages on topic '{topic}'; set source.states and source.commands"
            )
    return {topic: sorted(messages, key=lambda one: one[0]) for topic, messages in found.items()}


def _decoded(stream: BinaryIO, topics: Sequence[str]) -> Iterator[tuple[str, float, Any]]:
    """Yield topic, time [s] by the header's stamp, or without one of logging, and content of ROS 2 messages."""
    from mcap.records import Channel, Chunk, Message, Schema
    from mcap.stream_reader import StreamReader, breakup_chunk
    from mcap_ros2.decoder import DecoderFactory

    factory, schemas, decoders = DecoderFactory(), {}, {}
    whole = StreamReader(stream, emit_chunks=True, record_size_limit=limits.CHUNK).records
    for record in (
        one for part in whole for one in (breakup_chunk(unpacked(part)) if isinstance(part, Chunk) else [part])
    ):
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel) and record.topic in topics:
            decode = factory.decoder_for(record.message_encoding, schemas.get(record.schema_id))
            if decode is None:
                raise ValueError(f"messages on '{record.topic}' are no ROS 2 messages ({record.message_encoding})")
            decoders[record.id] = record.topic, decode
        elif isinstance(record, Message) and record.channel_id in decoders:
            topic, decode = decoders[record.channel_id]
            message = decode(record.data)
            stamp = getattr(getattr(message, "header", None), "stamp", None)
            seconds = 0.0 if stamp is None else float(stamp.sec) + 1e-9 * float(stamp.nanosec)
            yield topic, seconds or 1e-9 * record.log_time, message


def unpacked(chunk: Chunk) -> Chunk:
    """Return a chunk as it was before it was compressed; a ValueError if larger than it says, or `limits.CHUNK`."""
    import lz4.frame
    import zstandard

    size = chunk.uncompressed_size
    if size > limits.CHUNK:
        raise ValueError(f"a chunk of {size / 1e6:.4g} MB; chunks up to {limits.CHUNK / 1e6:g} MB are read")
    data = chunk.data
    if chunk.compression == "zstd":
        data = zstandard.ZstdDecompressor().stream_reader(data).read(size + 1)
    elif chunk.compression == "lz4":
        data = lz4.frame.LZ4FrameDecompressor().decompress(data, size + 1)
    if len(data) != size:
        raise ValueError(f"a chunk is not of the {size} bytes that it says")
    return replace(chunk, compression="", data=data)


def _by_joint(message: Any, joints: list[str], path: Path, signal: str) -> Array:
    if hasattr(message, "points"):
        names, values = message.joint_names, message.points[0].positions
    elif hasattr(message, "position"):
        names, values = message.name, message.position
    else:
        names, values = joints, message.data
    missing = [joint for joint in joints if joint not in list(names)[: len(values)]]
    if missing:
        raise InputError(f"{path}: {signal} of joint '{missing[0]}' is missing; the messages have {list(names)}")
    return _ordered(names, values, joints)


def _ordered(names: Iterable[str], values: Iterable[float], joints: list[str]) -> Array:
    table = dict(zip(names, values, strict=False))
    return np.array([table[joint] for joint in joints], dtype=np.float64)
