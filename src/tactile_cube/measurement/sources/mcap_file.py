"""Messages of an MCAP file, unpacked no further than its chunks say and `limits` allow."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, BinaryIO

import lz4.frame
import zstandard
from mcap.records import Channel, Chunk, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap_ros2.decoder import DecoderFactory

from tactile_cube import limits

UNPACK: dict[str, Callable[[bytes, int], bytes]] = {
    "": lambda data, size: data,
    "zstd": lambda data, size: zstandard.ZstdDecompressor().stream_reader(data).read(size),
    "lz4": lambda data, size: lz4.frame.LZ4FrameDecompressor().decompress(data, size),
}


def decoded_messages(stream: BinaryIO, topics: Sequence[str]) -> Iterator[tuple[str, int, Any]]:
    """Topic, time of logging [ns] and content of the ROS 2 messages on some topics, in the order of the file.

    Raises:
        ValueError: a chunk is larger than it says, or than `limits.CHUNK`.
    """
    factory, schemas, decoders = DecoderFactory(), {}, {}
    for record in _records(stream):
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel) and record.topic in topics:
            decode = factory.decoder_for(record.message_encoding, schemas.get(record.schema_id))
            if decode is None:
                raise ValueError(f"messages on '{record.topic}' are no ROS 2 messages ({record.message_encoding})")
            decoders[record.id] = record.topic, decode
        elif isinstance(record, Message) and record.channel_id in decoders:
            topic, decode = decoders[record.channel_id]
            yield topic, record.log_time, decode(record.data)


def _records(stream: BinaryIO) -> Iterator[Any]:
    for record in StreamReader(stream, emit_chunks=True, record_size_limit=limits.CHUNK).records:
        yield from breakup_chunk(unpacked(record)) if isinstance(record, Chunk) else (record,)


def unpacked(chunk: Chunk) -> Chunk:
    """Return a chunk as it was before it was compressed.

    Raises:
        ValueError: it is larger than it says, or than `limits.CHUNK`.
    """
    size = chunk.uncompressed_size
    if size > limits.CHUNK:
        raise ValueError(f"a chunk of {size / 1e6:.4g} MB; chunks up to {limits.CHUNK / 1e6:g} MB are read")
    data = UNPACK[chunk.compression](chunk.data, size + 1)
    if len(data) != size:
        raise ValueError(f"a chunk is not of the {size} bytes that it says")
    return replace(chunk, compression="", data=data)
