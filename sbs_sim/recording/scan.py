"""Reading a recording so that nothing is taken on trust: whole files, truncated ones and damaged ones.

The file is gone through from its start to its end. Taken are chunks, attachments and metadata whose checksum is right;
the definitions of types and topics come from the chunks and from the summary, which has one too. Where a record makes
no sense the search goes on at the next place known from the summary or the next bytes that look like a chunk.

The format leaves checksums to the writer, and others leave some or all of them out. What such a file has none for is
taken as it is, and said to be so; a file of ours, or one in which any chunk has a checksum, is never trusted like that.
"""

import bisect
import io
import os
import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.stream_reader import get_chunk_data_stream

from sbs_sim.errors import RecordingError
from sbs_sim.recording.mcap_file import (
    CHECKSUM,
    MAGIC,
    MESSAGE_HEAD,
    MESSAGE_OVERHEAD,
    RECOVERY,
    ROSBAG2,
    START,
    metadata_checksum,
    reason,
    serialize,
)

RECORD_HEAD = struct.Struct("<BQ")  # opcode, length
CHUNK_HEAD = struct.Struct(
    "<BQQQQII"
)  # opcode, length; start and end time, size, checksum, length of compression's name
CHUNK_SIGNATURE = b"\x04\x00\x00\x00zstd"  # of the chunks that we write, at the end of CHUNK_HEAD
SIGNATURE_PLACE = CHUNK_HEAD.size - 4
DATA_END_SIZE = RECORD_HEAD.size + 4
FOOTER_SIZE = RECORD_HEAD.size + 20
LARGEST = 1 << 28  # bytes of a record, packed or not: a damaged one may claim to need all memory that there is
# Records that may stand between chunks. Schemas and channels count in chunks only, where they have a checksum.
OTHER_RECORDS = frozenset(
    (
        Opcode.HEADER,
        Opcode.SCHEMA,
        Opcode.CHANNEL,
        Opcode.MESSAGE_INDEX,
        Opcode.ATTACHMENT,
        Opcode.METADATA,
    )
)
# Records that stand in chunks, or in a file without chunks between the others.
CONTENT_RECORDS = frozenset((Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE))
BLOCK = 1 << 20
HEAD_SIZE = 64  # bytes that tell what kind of file it is
PACKED = {b"\x28\xb5\x2f\xfd": "zstd -d", b"\x1f\x8b\x08": "gunzip -k", b"\x04\x22\x4d\x18": "lz4 -d"}
TO_MCAP = (
    "`rosbags-convert --src {} --dst NEW --dst-storage mcap` of the Python package rosbags makes one in MCAP of it"
)
MOST_NAMES = 3  # that are listed
MOST_REASONS = 100  # a file of another kind can be wrong at every message
# What the reading of nonsense can end with: short data, wrong text, a decompressor's complaint, absurd sizes.
NONSENSE = (
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


class DamageError(Exception):
    """A place in the file that makes no sense; the text says why."""


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


@dataclass(frozen=True)
class Trust:
    """What of a file is taken without a checksum, because its writer made none.

    Attributes
    ----------
    foreign : bool
        Another program's file: metadata, attachments and summary need no checksum, and there may be no summary.
    content : bool
        No chunk has a checksum: they need none, and messages may stand outside of chunks.
    """

    foreign: bool = False
    content: bool = False


@dataclass
class Summary:
    """What a summary with a right checksum says."""

    start: int
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: dict[int, Extent] = field(default_factory=dict)  # by where they begin
    attachments: dict[int, str] = field(default_factory=dict)  # names by where they begin
    metadata: dict[int, str] = field(default_factory=dict)
    messages: int = -1  # all of them; unknown if there are no statistics

    def places(self) -> list[int]:
        """Where records begin that matter."""
        return sorted([*self.chunks, *self.attachments, *self.metadata])


@dataclass
class Scan:
    """What is whole in a file.

    Attributes
    ----------
    schemas, channels : dict
        Records by number.
    metadata : list of (str, dict of str to str)
        Names and values, in the order of the file; files that were made of several have several of a name.
    attachments : list of Attachment
        The same.
    messages : int
        Messages in whole chunks.
    chunks : dict of int to tuple
        Extents of the whole ones by where they begin.
    reasons : list of str
        What is wrong, one line each.
    lost_bytes : int
        Bytes that could not be used.
    complete : bool
        True if nothing that was recorded is missing.
    """

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    attachments: list[Attachment] = field(default_factory=list)
    messages: int = 0
    chunks: dict[int, Extent] = field(default_factory=dict)
    reasons: list[str] = field(default_factory=list)
    lost_bytes: int = 0
    complete: bool = False
    unlisted: int = 0  # what is wrong besides

    def note(self, reason: str) -> None:
        """Add a reason, if there are not too many already."""
        if len(self.reasons) < MOST_REASONS:
            self.reasons.append(reason)
        else:
            self.unlisted += 1


class Source:
    """A file that is read at given places; a context that closes it.

    Raises
    ------
    RecordingError
        The file cannot be read: path and reason in one line. So do the methods.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._descriptor = -1
        try:
            self._descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
            self.size = os.lseek(self._descriptor, 0, os.SEEK_END)
            head = os.pread(self._descriptor, HEAD_SIZE, 0)
        except IsADirectoryError:  # a folder can be opened, but not read
            self.close()
            raise RecordingError(f"cannot read {path}: {what_folder(path)}") from None
        except (OSError, ValueError) as error:
            self.close()
            raise RecordingError(f"cannot read {path}: {reason(error)}") from None
        if other := what_else(path, head):
            self.close()
            raise RecordingError(f"cannot read {path}: {other}")

    def at(self, offset: int, length: int) -> bytes:
        """Bytes at a place.

        Raises
        ------
        DamageError
            The file ends before.
        """
        if not 0 <= length <= self.size - offset:
            raise DamageError("the file ends in the middle of a record")
        parts = []
        while length:
            try:
                part = os.pread(self._descriptor, length, offset)
            except OSError as error:
                raise RecordingError(f"cannot read {self.path}: {reason(error)}") from None
            if not part:
                raise DamageError("the file ends in the middle of a record")
            parts.append(part)
            offset += len(part)
            length -= len(part)
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def blocks(self, start: int, end: int) -> Iterator[tuple[int, bytes]]:
        """Everything between two places in handy blocks, each with its place."""
        for offset in range(start, end, BLOCK):
            yield offset, self.at(offset, min(BLOCK, end - offset))

    def checksum(self, end: int) -> int:
        """Checksum of everything before a place."""
        crc = 0
        for _, block in self.blocks(0, end):
            crc = zlib.crc32(block, crc)
        return crc

    def close(self) -> None:
        """Close the file."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
        self._descriptor = -1

    def __enter__(self) -> "Source":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def what_folder(path: Path) -> str:
    """What to do with a folder where a log is wanted; rosbag2 makes one for each bag."""
    found = {suffix: sorted(path.glob(f"*{suffix}")) for suffix in (".mcap", ".mcap.zstd", ".db3", ".db3.zstd")}
    if logs := found[".mcap"]:
        more = ", ..." if len(logs) > MOST_NAMES else ""
        return f"a folder, name the log in it: {', '.join(map(str, logs[:MOST_NAMES]))}{more}"
    if packed := found[".mcap.zstd"]:
        return f"a folder whose log is compressed as a whole: `zstd -d {packed[0]}` unpacks it"
    if found[".db3"] or found[".db3.zstd"]:
        return f"a folder with a bag in SQLite: {TO_MCAP.format(path)}"
    return "a folder without a log (.mcap)"


def what_else(path: Path, head: bytes) -> str:
    """What a file is by its first bytes, and what to do with it, if it is of a known kind that is not MCAP."""
    if head.startswith(b"SQLite format 3\0"):
        return f"a bag in SQLite: {TO_MCAP.format(path.parent)}"
    if head.startswith(b"#ROSBAG V"):
        return f"a bag of ROS 1: {TO_MCAP.format(path)}"
    if b"rosbag2_bagfile_information" in head:
        return f"the description of a bag, which is {what_folder(path.parent)}"
    for magic, command in PACKED.items():
        if head.startswith(magic):
            return f"compressed as a whole: `{command} {path}` unpacks it"
    return ""


def scan(source: Source, take: Callable[[Content], None]) -> Scan:
    """Go through a file and hand out the content of every chunk that is whole, in the order of the file.

    Of messages outside of chunks some that follow one another are handed out like a chunk.
    """
    trust, summary = open_recording(source)
    found = Scan()
    walk = _Walk(source, summary, trust, found, take)
    try:
        data_end = walk.go()
    except DamageError as damage:  # it was longer when this began
        raise RecordingError(f"cannot read {source.path}: {damage}") from None
    if summary is not None:
        found.schemas.update(summary.schemas)
        found.channels.update(summary.channels)
    if summary is not None and not found.lost_bytes and summary.messages not in (-1, found.messages):
        found.note(f"{summary.messages} messages by the summary, {found.messages} in the file")
    if data_end and not found.lost_bytes and not found.reasons:
        found.complete = True  # the checksum of everything is right
    elif summary is not None:
        found.complete = _nothing_missing(summary, found)
    if found.unlisted:
        found.reasons.append(f"{found.unlisted} more places like these")
    if summary is None:
        closed = data_end or (source.size >= len(MAGIC) and source.at(source.size - len(MAGIC), len(MAGIC)) == MAGIC)
        found.reasons.append("the summary is damaged" if closed else "the recording was not closed: it has no end")
    if walk.unchecked:
        found.reasons.append(f"no checksums, so that damage cannot be found: {', '.join(sorted(walk.unchecked))}")
    found.channels = {
        number: channel
        for number, channel in found.channels.items()
        if channel.schema_id in found.schemas or not channel.schema_id
    }
    return found


def open_recording(source: Source) -> tuple[Trust, Summary | None]:
    """What of a file needs no checksum, and its summary, if it has one that can be used."""
    summary = read_summary(source)
    trust = trust_in(source, summary)
    if summary is None and trust.foreign:
        summary = read_summary(source, checked=False)
    return trust, summary


def trust_in(source: Source, summary: Summary | None) -> Trust:
    """Whether a file is another program's, and whether it has checksums at all, from the heads of its records."""
    if summary is not None and {START, RECOVERY} & set(summary.metadata.values()):
        return Trust()
    foreign, content = summary is not None, False
    offset = len(MAGIC)
    try:
        while offset < source.size:
            opcode, length = RECORD_HEAD.unpack(source.at(offset, RECORD_HEAD.size))
            if opcode == Opcode.METADATA and _is_ours(source.at(offset + RECORD_HEAD.size, length)):
                return Trust()
            if opcode == Opcode.CHUNK and CHUNK_HEAD.unpack(source.at(offset, CHUNK_HEAD.size))[5]:
                return Trust(foreign=True)
            foreign = foreign or opcode == Opcode.DATA_END
            content = content or opcode in (Opcode.CHUNK, Opcode.MESSAGE)
            if opcode == Opcode.DATA_END or opcode not in OTHER_RECORDS | CONTENT_RECORDS | {Opcode.CHUNK}:
                break
            offset += RECORD_HEAD.size + length
    except DamageError:
        pass  # what was seen before it counts
    return Trust(foreign or content, content)


def _is_ours(data: bytes) -> bool:
    """True for a metadata record with a right checksum of the kind that the format does not have."""
    try:
        return whole_metadata(data).name != ROSBAG2
    except DamageError:
        return False


def _nothing_missing(summary: Summary, found: Scan) -> bool:
    """True if all that the summary names has been found; rosbag2's metadata can be made again."""
    return (
        summary.messages == found.messages
        and summary.chunks.items() <= found.chunks.items()
        and Counter(summary.attachments.values()) <= Counter(attachment.name for attachment in found.attachments)
        and Counter(name for name in summary.metadata.values() if name != ROSBAG2)
        <= Counter(name for name, _ in found.metadata)
    )


class _Walk:
    """One way through a file."""

    def __init__(
        self, source: Source, summary: Summary | None, trust: Trust, found: Scan, take: Callable[[Content], None]
    ) -> None:
        self._source, self._summary, self._trust, self._found, self._take = source, summary, trust, found, take
        self.unchecked: set[str] = set()  # what was taken without a checksum
        self._places = summary.places() if summary else []
        self._sure = len(MAGIC)  # end of the last record with a right checksum
        self._seen: set[int] = set()  # where something was read, right or wrong
        self._end = summary.start if summary else source.size

    def go(self) -> bool:
        """Go to the end; true if the end of the data is there and the checksum of all of it is right."""
        offset = self._check_magic()
        while offset < self._end:
            self._seen.add(offset)
            try:
                opcode, length = RECORD_HEAD.unpack(self._source.at(offset, RECORD_HEAD.size))
                if (opcode, length) == (Opcode.DATA_END, 4) and self._is_end(offset):
                    return self._checksum_is_right(offset)
                offset = self._chunk(offset) if opcode == Opcode.CHUNK else self._other(offset, opcode, length)
            except DamageError as damage:
                offset = self._after_damage(offset, str(damage))
        return False

    def _check_magic(self) -> int:
        try:
            if self._source.at(0, len(MAGIC)) != MAGIC:
                self._found.reasons.append("the first bytes are not those of an MCAP file")
        except DamageError:
            self._found.reasons.append("the file is too short")
        return len(MAGIC)

    def _is_end(self, offset: int) -> bool:
        """True if what looks like the end of the data is where the summary has it, or is not followed by chunks."""
        if self._summary is not None:
            return offset + DATA_END_SIZE == self._end
        return self._next_place() == self._end

    def _checksum_is_right(self, offset: int) -> bool:
        (crc,) = struct.unpack("<I", self._source.at(offset + RECORD_HEAD.size, 4))
        if not crc and self._trust.foreign:
            return True  # none was made, which is allowed
        right = crc == self._source.checksum(offset)
        if right:
            self.unchecked.clear()  # it covers them all
        if crc and not right and not self._found.reasons:
            self._found.reasons.append("the checksum of the data is wrong, those of their parts are right")
        return right

    def _chunk(self, offset: int) -> int:
        """Take a chunk; where the next record begins."""
        content, following, note = self._content(offset, self._trust.content)
        if note:
            self._found.note(f"byte {offset}: {note}")
        self._keep(offset, content, following)
        return following

    def _keep(self, offset: int, content: Content, following: int) -> None:
        """Take a content that ends at a place."""
        if self._trust.content:
            self.unchecked.add("messages")
        self._found.chunks[offset] = content.extent()
        self._found.messages += len(content.messages)
        self._found.schemas.update(content.schemas)
        self._found.channels.update(content.channels)
        self._take(content)
        self._sure = following

    def _content(self, offset: int, unchecked: bool = False) -> tuple[Content, int, str]:
        """What `chunk_at` gives, if it is what the summary says of this place."""
        content, following, note = chunk_at(self._source, offset, self._end, unchecked)
        known = None if self._summary is None else self._summary.chunks
        if known is not None and (known or not self._trust.foreign) and known.get(offset) != content.extent():
            raise DamageError("a chunk that the summary does not know")
        return content, following, note

    def _other(self, offset: int, opcode: int, length: int) -> int:
        """Take another record; where the next one begins."""
        if self._trust.content and opcode in CONTENT_RECORDS:
            content, following = run_at(self._source, offset, self._end)
            self._keep(offset, content, following)
            return following
        if opcode not in OTHER_RECORDS:
            raise DamageError("a damaged record, or a message without a checksum")
        following = offset + RECORD_HEAD.size + length
        if following > self._end or length > LARGEST:
            raise DamageError("the file ends in the middle of a record")
        data = self._source.at(offset + RECORD_HEAD.size, length)
        if opcode == Opcode.ATTACHMENT:
            attachment = whole_attachment(data, self._trust.foreign)
            if not struct.unpack("<I", data[-4:])[0]:
                self.unchecked.add("attachments")
            self._found.attachments.append(attachment)
            self._sure = following
        elif opcode == Opcode.METADATA:
            metadata = whole_metadata(data, self._trust.foreign)
            if metadata.name != ROSBAG2:
                if not _is_ours(data):
                    self.unchecked.add("metadata")
                self._found.metadata.append((metadata.name, metadata.metadata))
                self._sure = following
        elif opcode == Opcode.MESSAGE_INDEX:
            if length < 6 or struct.unpack_from("<I", data, 2)[0] != length - 6 or (length - 6) % 16:
                raise DamageError("a message index is damaged, it is not needed")
        elif opcode == Opcode.HEADER:
            _whole(Header, data)
        return following

    def _after_damage(self, offset: int, why: str) -> int:
        """Note the damage; where to go on."""
        if self._is_chunk(offset):  # of which the first byte is wrong
            return self._chunk(offset)
        following = self._next_record(offset)
        if following is None:
            following = self._next_place()
        lost = max(0, following - offset)
        self._found.note(f"byte {offset}: {why} ({lost} bytes skipped)")
        self._found.lost_bytes += lost
        return following

    def _next_record(self, offset: int) -> int | None:
        """Where the next record begins, if the damaged one is no chunk and is followed by what looks like a record."""
        try:
            opcode, length = RECORD_HEAD.unpack(self._source.at(offset, RECORD_HEAD.size))
            following = offset + RECORD_HEAD.size + length
            if opcode == Opcode.CHUNK or following > self._end:
                return None
            opcode, length = RECORD_HEAD.unpack(self._source.at(following, RECORD_HEAD.size))
        except DamageError:
            return None
        known = Opcode.HEADER <= opcode <= Opcode.DATA_END
        return following if known and following + RECORD_HEAD.size + length <= self._end else None

    def _next_place(self) -> int:
        """Next record that the summary knows, or next bytes that are a whole chunk, or the end.

        The search begins where what is sure ends, which may be before the damage: a message index has no checksum, and
        one that is too long for its place ends within the next chunk.
        """
        index = bisect.bisect_left(self._places, self._sure)
        limit = next((place for place in self._places[index:] if place not in self._seen), self._end)
        overlap = b""
        for place, block in self._source.blocks(self._sure, limit):
            text = overlap + block
            start = place - len(overlap)
            hit = text.find(CHUNK_SIGNATURE)
            while hit >= 0:
                candidate = start + hit - SIGNATURE_PLACE
                if candidate >= self._sure and self._is_chunk(candidate):
                    return candidate
                hit = text.find(CHUNK_SIGNATURE, hit + 1)
            overlap = text[-len(CHUNK_SIGNATURE) + 1 :]
        return limit

    def _is_chunk(self, offset: int) -> bool:
        try:
            self._content(offset)
        except DamageError:
            return False
        return True


def run_at(source: Source, offset: int, end: int) -> tuple[Content, int]:
    """Messages and definitions outside of chunks that follow one another, a BLOCK of them or somewhat more.

    Raises
    ------
    DamageError
        They make no sense.
    """
    following = offset
    while following + RECORD_HEAD.size <= end and following - offset < BLOCK:
        opcode, length = RECORD_HEAD.unpack(source.at(following, RECORD_HEAD.size))
        if opcode not in CONTENT_RECORDS or length > LARGEST or following + RECORD_HEAD.size + length > end:
            break
        following += RECORD_HEAD.size + length
    if following == offset:
        raise DamageError("the file ends in the middle of a record")
    return chunk_content(source.at(offset, following - offset)), following


def chunk_at(source: Source, offset: int, end: int, unchecked: bool = False) -> tuple[Content, int, str]:
    """Content of the chunk at a place, where the next record begins, and what is wrong with it all the same.

    Of the chunk's fields only the checksum is believed; its length is there twice, and the right one is tried out.
    `unchecked` takes a chunk that has none as well, if its fields agree with its content.

    Raises
    ------
    DamageError
        There is no chunk whose checksum is right.
    """
    opcode, length, start, stop, size, crc, name_length = CHUNK_HEAD.unpack(source.at(offset, CHUNK_HEAD.size))
    if name_length > 8:
        raise DamageError("a chunk is damaged")
    place = offset + CHUNK_HEAD.size
    tail = source.at(place, name_length + 8)
    compression, (inner,) = tail[:name_length], struct.unpack("<Q", tail[name_length:])
    place += len(tail)
    outer = length - (place - offset - RECORD_HEAD.size)
    for data_length in dict.fromkeys((inner, outer)):
        if not 0 <= data_length <= min(end - place, LARGEST):
            continue
        data = _decompress(source.at(place, data_length), compression, crc, unchecked)
        if data is not None:
            content = chunk_content(data)
            right = (opcode, inner, (size, start, stop)) == (Opcode.CHUNK, outer, content.extent())
            if not crc and not right:
                break
            return content, place + data_length, "" if right else "the head of a chunk is damaged, its content is whole"
    if place + inner > end and place + outer > end:
        raise DamageError("the file ends in the middle of a chunk")
    raise DamageError("a chunk is damaged: its checksum is wrong" if crc else "a chunk has no checksum to trust")


def _decompress(data: bytes, compression: bytes, crc: int, unchecked: bool) -> bytes | None:
    """Content of a chunk if its checksum is right; a chunk without a checksum counts as damaged unless told otherwise.

    So does one without content: zeros look like one, the checksum of nothing being zero.
    """
    try:
        size = LARGEST
        if compression == b"zstd":
            size = zstandard.get_frame_parameters(data).content_size
            if size == zstandard.CONTENTSIZE_UNKNOWN:
                size = LARGEST
            if size > LARGEST:
                return None
        chunk = Chunk(compression.decode(), data, 0, 0, 0, size)
        stream, length = get_chunk_data_stream(chunk)
        content = stream.read(length)
    except NONSENSE:
        return None
    return content if content and (zlib.crc32(content) == crc or (unchecked and not crc)) else None


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
                schema = _read(Schema, data[offset + RECORD_HEAD.size : following])
                content.schemas[schema.id] = schema
            elif opcode == Opcode.CHANNEL:
                channel_record = _read(Channel, data[offset + RECORD_HEAD.size : following])
                content.channels[channel_record.id] = channel_record
            offset = following
    except NONSENSE:
        raise DamageError("a chunk makes no sense in spite of its right checksum") from None
    return content


def whole_attachment(data: bytes, unchecked: bool = False) -> Attachment:
    """Attachment of a record, if its checksum is right, or missing where that is allowed."""
    crc = struct.unpack("<I", data[-4:])[0] if len(data) >= 4 else -1
    if crc != zlib.crc32(data[:-4]) and (crc or not unchecked):
        raise DamageError("an attachment is damaged: its checksum is wrong")
    attachment: Attachment = _whole(Attachment, data if crc == zlib.crc32(data[:-4]) else _signed(data))
    return attachment


def _signed(data: bytes) -> bytes:
    """An attachment's record with a checksum."""
    return data[:-4] + struct.pack("<I", zlib.crc32(data[:-4]))


def whole_metadata(data: bytes, unchecked: bool = False) -> Metadata:
    """Metadata of a record without their checksum, if it is right or may be missing, as in rosbag2's."""
    metadata: Metadata = _whole(Metadata, data)
    if metadata.name != ROSBAG2 and not (unchecked and CHECKSUM not in metadata.metadata and metadata.name != START):
        crc = metadata.metadata.pop(CHECKSUM, "")
        if crc != metadata_checksum(metadata.name, metadata.metadata):
            raise DamageError(f"the metadata {metadata.name!r} are damaged: their checksum is wrong")
    return metadata


def _whole(kind: Any, data: bytes) -> Any:
    """A record, if writing it again gives the same bytes: the package's readers do not mind short or odd data."""
    try:
        record = _read(kind, data)
        if serialize(record)[RECORD_HEAD.size :] == data:
            return record
    except NONSENSE:
        pass
    raise DamageError(f"a {kind.__name__.lower()} record is damaged")


def _read(kind: Any, data: bytes) -> Any:
    return kind.read(ReadDataStream(io.BytesIO(data)))


def read_summary(source: Source, checked: bool = True) -> Summary | None:
    """The summary, if there is one with a right checksum.

    Where it need not be `checked` it may lack the checksum, or be missing altogether in a file that has its end.
    """
    try:
        end = source.size - FOOTER_SIZE - len(MAGIC)
        data = source.at(end, FOOTER_SIZE) if end > 0 else b""
        if data[: RECORD_HEAD.size] != RECORD_HEAD.pack(Opcode.FOOTER, 20):
            return None
        footer = _read(Footer, data[RECORD_HEAD.size :])
        if not footer.summary_start and not checked:
            return Summary(end)
        if not len(MAGIC) <= footer.summary_start <= end:
            return None
        records = source.at(footer.summary_start, end - footer.summary_start)
        if zlib.crc32(records + data[:-4]) != footer.summary_crc and (checked or footer.summary_crc):
            return None
        return _summary_of(footer.summary_start, records)
    except (DamageError, *NONSENSE):
        return None


def _summary_of(start: int, data: bytes) -> Summary:
    summary = Summary(start)
    offset = 0
    while offset < len(data):
        opcode, length = RECORD_HEAD.unpack_from(data, offset)
        following = offset + RECORD_HEAD.size + length
        content = data[offset + RECORD_HEAD.size : following]
        if opcode == Opcode.SCHEMA:
            schema = _read(Schema, content)
            summary.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = _read(Channel, content)
            summary.channels[channel.id] = channel
        elif opcode == Opcode.CHUNK_INDEX:
            chunk = _read(ChunkIndex, content)
            extent = chunk.uncompressed_size, chunk.message_start_time, chunk.message_end_time
            summary.chunks[chunk.chunk_start_offset] = extent
        elif opcode == Opcode.STATISTICS:
            summary.messages = _read(Statistics, content).message_count
        elif opcode == Opcode.ATTACHMENT_INDEX:
            attachment = _read(AttachmentIndex, content)
            summary.attachments[attachment.offset] = attachment.name
        elif opcode == Opcode.METADATA_INDEX:
            metadata = _read(MetadataIndex, content)
            summary.metadata[metadata.offset] = metadata.name
        offset = following
    return summary
