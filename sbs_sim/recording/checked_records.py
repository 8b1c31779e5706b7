"""Records of an MCAP file, accepted only if they are intact: chunks, attachments, metadata."""

import io
import struct
import zlib
from dataclasses import dataclass, field
from typing import Any

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Metadata, Schema
from mcap.stream_reader import get_chunk_data_stream

from sbs_sim.recording.mcap_file import (
    CHECKSUM,
    MESSAGE_HEAD,
    MESSAGE_OVERHEAD,
    ROSBAG2,
    START,
    metadata_checksum,
    serialize,
)
from sbs_sim.recording.source import BLOCK, DamageError, Source

RECORD_HEAD = struct.Struct("<BQ")  # opcode, length
# opcode, length; start and end time, size, checksum, length of compression's name
CHUNK_HEAD = struct.Struct("<BQQQQII")
CHUNK_SIGNATURE = b"\x04\x00\x00\x00zstd"  # of the chunks that we write, at the end of CHUNK_HEAD
SIGNATURE_OFFSET = CHUNK_HEAD.size - 4
MAX_RECORD_SIZE = 1 << 28  # bytes of a record, packed or not: a damaged one may claim to need all memory that there is
# Records inside chunks; in a file without chunks they are between the others.
CONTENT_RECORDS = frozenset((Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE))
# Errors of parsing damaged data: too short, not UTF-8, not decompressible, sizes beyond the memory.
PARSE_ERRORS = (
    struct.error,
    ValueError,
    McapError,
    zstandard.ZstdError,
    RuntimeError,
    MemoryError,
    OverflowError,
    LookupError,
)
Extent = tuple[int, int, int]  # size of a chunk's content, earliest and latest time [ns]


@dataclass
class Content:
    """What a chunk holds.

    Attributes
    ----------
    data : bytes
        Decompressed.
    schemas, channels : dict
        Records by number.
    messages : list of tuple
        Channel, sequence, log time [ns], publish time [ns], and where in `data` the message begins and ends.
    """

    data: bytes
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    messages: list[tuple[int, int, int, int, int, int]] = field(default_factory=list)

    def extent(self) -> Extent:
        """What identifies the chunk."""
        times = [message[2] for message in self.messages] or [0]
        return len(self.data), min(times), max(times)


def loose_records_at(source: Source, offset: int, end: int) -> tuple[Content, int]:
    """Messages and definitions outside of chunks that follow one another, a BLOCK of them or somewhat more.

    Raises
    ------
    DamageError
        They make no sense.
    """
    following = offset
    while following + RECORD_HEAD.size <= end and following - offset < BLOCK:
        opcode, length = RECORD_HEAD.unpack(source.at(following, RECORD_HEAD.size))
        if opcode not in CONTENT_RECORDS or length > MAX_RECORD_SIZE or following + RECORD_HEAD.size + length > end:
            break
        following += RECORD_HEAD.size + length
    if following == offset:
        raise DamageError("the file ends in the middle of a record")
    return chunk_content(source.at(offset, following - offset)), following


def chunk_at(source: Source, offset: int, end: int, checksum_optional: bool = False) -> tuple[Content, int]:
    """Content of the chunk at an offset, and the offset of the next record.

    `checksum_optional` accepts a chunk without a checksum if its fields agree with its content.

    Raises
    ------
    DamageError
        There is no intact chunk.
    """
    opcode, length = RECORD_HEAD.unpack(source.at(offset, RECORD_HEAD.size))
    following = offset + RECORD_HEAD.size + length
    if opcode != Opcode.CHUNK or length > MAX_RECORD_SIZE:
        raise DamageError("a chunk is damaged")
    if following > end:
        raise DamageError("the file ends in the middle of a chunk")
    chunk: Chunk = checked_record(Chunk, source.at(offset + RECORD_HEAD.size, length))
    if not chunk.uncompressed_crc and not checksum_optional:
        raise DamageError("a chunk has no checksum to trust")
    content = chunk_content(_decompress(chunk))
    if (chunk.uncompressed_size, chunk.message_start_time, chunk.message_end_time) != content.extent():
        raise DamageError("a chunk is damaged: its fields do not agree with its content")
    return content, following


def _decompress(chunk: Chunk) -> bytes:
    """Content of a chunk; empty content is damage too, since zeros look like a chunk without content."""
    try:
        if chunk.uncompressed_size > MAX_RECORD_SIZE:
            raise ValueError
        if chunk.compression == "zstd":
            size = zstandard.get_frame_parameters(chunk.data).content_size
            if size not in (chunk.uncompressed_size, zstandard.CONTENTSIZE_UNKNOWN):
                raise ValueError
        stream, length = get_chunk_data_stream(chunk, validate_crc=True)
        content = bytes(stream.read(length))
    except PARSE_ERRORS:
        raise DamageError("a chunk is damaged: its checksum is wrong") from None
    if not content:
        raise DamageError("a chunk is damaged: it is empty")
    return content


def chunk_content(data: bytes) -> Content:
    """Take a chunk's content apart.

    Raises
    ------
    DamageError
        It is no sequence of records.
    """
    content = Content(data)
    offset, end, MESSAGE = 0, len(data), int(Opcode.MESSAGE)
    add, unpack = content.messages.append, MESSAGE_HEAD.unpack_from
    try:
        while offset < end:
            opcode, length = RECORD_HEAD.unpack_from(data, offset)
            following = offset + RECORD_HEAD.size + length
            if following > end:
                raise ValueError
            if opcode == MESSAGE:
                if length < MESSAGE_OVERHEAD:
                    raise ValueError
                _, _, channel, sequence, log_time, publish_time = unpack(data, offset)
                add((channel, sequence, log_time, publish_time, offset + MESSAGE_HEAD.size, following))
            elif opcode == Opcode.SCHEMA:
                schema = read_record(Schema, data[offset + RECORD_HEAD.size : following])
                content.schemas[schema.id] = schema
            elif opcode == Opcode.CHANNEL:
                channel_record = read_record(Channel, data[offset + RECORD_HEAD.size : following])
                content.channels[channel_record.id] = channel_record
            offset = following
    except PARSE_ERRORS:
        raise DamageError("a chunk with a correct checksum is no sequence of records") from None
    return content


def checked_attachment(data: bytes, unchecked: bool = False) -> Attachment:
    """Attachment of a record, if its checksum is right, or missing where that is allowed."""
    crc = struct.unpack("<I", data[-4:])[0] if len(data) >= 4 else -1
    if crc != zlib.crc32(data[:-4]) and (crc or not unchecked):
        raise DamageError("an attachment is damaged: its checksum is wrong")
    attachment: Attachment = checked_record(Attachment, data if crc == zlib.crc32(data[:-4]) else _with_checksum(data))
    return attachment


def _with_checksum(data: bytes) -> bytes:
    """An attachment's record with a checksum."""
    return data[:-4] + struct.pack("<I", zlib.crc32(data[:-4]))


def checked_metadata(data: bytes, unchecked: bool = False) -> Metadata:
    """Metadata of a record without their checksum, if it is right or may be missing, as in rosbag2's."""
    metadata: Metadata = checked_record(Metadata, data)
    if metadata.name != ROSBAG2 and not (unchecked and CHECKSUM not in metadata.metadata and metadata.name != START):
        crc = metadata.metadata.pop(CHECKSUM, "")
        if crc != metadata_checksum(metadata.name, metadata.metadata):
            raise DamageError(f"the metadata {metadata.name!r} are damaged: their checksum is wrong")
    return metadata


def checked_record(kind: Any, data: bytes) -> Any:
    """A record, if it serialises to the same bytes: `read_record` accepts short data and trailing bytes."""
    try:
        record = read_record(kind, data)
        if serialize(record)[RECORD_HEAD.size :] == data:
            return record
    except PARSE_ERRORS:
        pass
    raise DamageError(f"a {kind.__name__.lower()} record is damaged")


def read_record(kind: Any, data: bytes) -> Any:
    """Record of a type of the `mcap` package; raises one of `PARSE_ERRORS` if the data are not one."""
    return kind.read(ReadDataStream(io.BytesIO(data)))
