"""Scan of a recording that may be complete, truncated or damaged.

The scan reads the file from start to end. It accepts chunks, attachments and metadata with a correct checksum.
Definitions of types and topics come from the chunks and from the summary, which has a checksum too. After damage the
scan continues at the next offset that the summary names, or at the next bytes that are an intact chunk.

Checksums are optional in MCAP. Data without a checksum are accepted only in files of other writers in which no chunk
has one; `reasons` then says so.
"""

import bisect
import struct
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Schema

from sbs_sim.errors import RecordingError
from sbs_sim.recording.checked_records import (
    CHUNK_SIGNATURE,
    CONTENT_RECORDS,
    MAX_RECORD_SIZE,
    RECORD_HEAD,
    SIGNATURE_OFFSET,
    Content,
    Extent,
    checked_attachment,
    checked_metadata,
    chunk_at,
    loose_records_at,
)
from sbs_sim.recording.checksum_policy import OTHER_RECORDS, OptionalChecksums, has_own_checksum, open_recording
from sbs_sim.recording.mcap_file import MAGIC, ROSBAG2
from sbs_sim.recording.source import DamageError, Source
from sbs_sim.recording.summary import Summary

DATA_END_SIZE = RECORD_HEAD.size + 4
MAX_REASONS = 100  # a file of another kind can have one at every message


@dataclass
class Scan:
    """What is intact in a file.

    Attributes
    ----------
    schemas, channels : dict
        Records by number.
    metadata : list of (str, dict of str to str)
        Names and values, in the order of the file; files that were made of several have several of a name.
    attachments : list of Attachment
        The same.
    messages : int
        Messages in intact chunks.
    chunks : dict of int to tuple
        Extents of the intact chunks by offset.
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
    unlisted: int = 0  # further reasons

    def note(self, reason: str) -> None:
        """Add a reason, up to MAX_REASONS."""
        if len(self.reasons) < MAX_REASONS:
            self.reasons.append(reason)
        else:
            self.unlisted += 1


def scan(source: Source, take: Callable[[Content], None]) -> Scan:
    """Scan a file and pass the content of every intact chunk to `take`, in the order of the file.

    Consecutive messages outside of chunks are passed in groups, like chunks.
    """
    optional, summary = open_recording(source)
    found = Scan()
    scanner = _Scanner(source, summary, optional, found, take)
    try:
        data_end = scanner.run()
    except DamageError as damage:  # the file has been truncated during the scan
        raise RecordingError(f"cannot read {source.path}: {damage}") from None
    if summary is not None:
        found.schemas.update(summary.schemas)
        found.channels.update(summary.channels)
    if summary is not None and not found.lost_bytes and summary.messages not in (-1, found.messages):
        found.note(f"{summary.messages} messages by the summary, {found.messages} in the file")
    if data_end and not found.lost_bytes and not found.reasons:
        found.complete = True  # the checksum of all data is correct
    elif summary is not None:
        found.complete = _nothing_missing(summary, found)
    if found.unlisted:
        found.reasons.append(f"{found.unlisted} more reasons like these")
    if summary is None:
        closed = data_end or (source.size >= len(MAGIC) and source.at(source.size - len(MAGIC), len(MAGIC)) == MAGIC)
        found.reasons.append("the summary is damaged" if closed else "the recording was not closed: it has no end")
    if scanner.unchecked:
        found.reasons.append(f"no checksums, so that damage cannot be found: {', '.join(sorted(scanner.unchecked))}")
    found.channels = {
        number: channel
        for number, channel in found.channels.items()
        if channel.schema_id in found.schemas or not channel.schema_id
    }
    return found


def _nothing_missing(summary: Summary, found: Scan) -> bool:
    """True if everything that the summary names was found, except rosbag2's metadata, which can be remade."""
    return (
        summary.messages == found.messages
        and summary.chunks.items() <= found.chunks.items()
        and Counter(summary.attachments.values()) <= Counter(attachment.name for attachment in found.attachments)
        and Counter(name for name in summary.metadata.values() if name != ROSBAG2)
        <= Counter(name for name, _ in found.metadata)
    )


class _Scanner:
    """Reads a file from start to end once."""

    def __init__(
        self,
        source: Source,
        summary: Summary | None,
        optional: OptionalChecksums,
        found: Scan,
        take: Callable[[Content], None],
    ) -> None:
        self._source, self._summary, self._optional, self._found, self._take = source, summary, optional, found, take
        self.unchecked: set[str] = set()  # kinds of data accepted without a checksum
        self._known_offsets = summary.offsets() if summary else []
        self._verified_end = len(MAGIC)  # end of the last record with a correct checksum
        self._visited: set[int] = set()  # offsets at which a record was read, intact or not
        self._end = summary.start if summary else source.size
        self._content_opcodes = CONTENT_RECORDS | {Opcode.CHUNK} if optional.chunks else {Opcode.CHUNK}

    def run(self) -> bool:
        """Read to the end; true if the data have their end and their checksum is correct."""
        offset = self._check_magic()
        while offset < self._end:
            self._visited.add(offset)
            try:
                opcode, length = RECORD_HEAD.unpack(self._source.at(offset, RECORD_HEAD.size))
                if (opcode, length) == (Opcode.DATA_END, 4) and self._is_end(offset):
                    return self._checksum_is_right(offset)
                offset = (
                    self._content(offset, opcode)
                    if opcode in self._content_opcodes
                    else self._other(offset, opcode, length)
                )
            except DamageError as damage:
                offset = self._skip_damage(offset, str(damage))
        return False

    def _check_magic(self) -> int:
        try:
            if self._source.at(0, len(MAGIC)) != MAGIC:
                self._found.reasons.append("the first bytes are not those of an MCAP file")
        except DamageError:
            self._found.reasons.append("the file is too short")
        return len(MAGIC)

    def _is_end(self, offset: int) -> bool:
        """True if the end of the data is where the summary has it, or no chunk follows it."""
        if self._summary is not None:
            return offset + DATA_END_SIZE == self._end
        return self._resynchronise() == self._end

    def _checksum_is_right(self, offset: int) -> bool:
        (crc,) = struct.unpack("<I", self._source.at(offset + RECORD_HEAD.size, 4))
        if not crc and self._optional.parts:
            return True  # the writer made none
        right = crc == self._source.checksum(offset)
        if right:
            self.unchecked.clear()  # it covers all parts
        if crc and not right and not self._found.reasons:
            self._found.reasons.append("the checksum of the data is wrong, those of their parts are right")
        return right

    def _content(self, offset: int, opcode: int) -> int:
        """Accept a chunk, or consecutive records outside of chunks; the offset of the next record."""
        if opcode == Opcode.CHUNK:
            content, following = self._chunk_at(offset, self._optional.chunks)
        else:
            content, following = loose_records_at(self._source, offset, self._end)
        if self._optional.chunks:
            self.unchecked.add("messages")
        self._found.chunks[offset] = content.extent()
        self._found.messages += len(content.messages)
        self._found.schemas.update(content.schemas)
        self._found.channels.update(content.channels)
        self._take(content)
        self._verified_end = following
        return following

    def _chunk_at(self, offset: int, checksum_optional: bool = False) -> tuple[Content, int]:
        """See `chunk_at`; a chunk that the summary does not name is damage too."""
        content, following = chunk_at(self._source, offset, self._end, checksum_optional)
        known = None if self._summary is None else self._summary.chunks
        if known is not None and (known or not self._optional.parts) and known.get(offset) != content.extent():
            raise DamageError("a chunk that the summary does not know")
        return content, following

    def _other(self, offset: int, opcode: int, length: int) -> int:
        """Accept another record; the offset of the next one."""
        if opcode not in OTHER_RECORDS:
            raise DamageError("a damaged record, or a message without a checksum")
        following = offset + RECORD_HEAD.size + length
        if following > self._end or length > MAX_RECORD_SIZE:
            raise DamageError("the file ends in the middle of a record")
        data = self._source.at(offset + RECORD_HEAD.size, length)
        if opcode == Opcode.ATTACHMENT:
            attachment = checked_attachment(data, self._optional.parts)
            if not struct.unpack("<I", data[-4:])[0]:
                self.unchecked.add("attachments")
            self._found.attachments.append(attachment)
            self._verified_end = following
        elif opcode == Opcode.METADATA:
            metadata = checked_metadata(data, self._optional.parts)
            if metadata.name != ROSBAG2:
                if not has_own_checksum(data):
                    self.unchecked.add("metadata")
                self._found.metadata.append((metadata.name, metadata.metadata))
                self._verified_end = following
        return following

    def _skip_damage(self, offset: int, why: str) -> int:
        """Record the damage; the offset at which to continue."""
        following = self._next_record(offset)
        if following is None:
            following = self._resynchronise()
        lost = max(0, following - offset)
        self._found.note(f"byte {offset}: {why} ({lost} bytes skipped)")
        self._found.lost_bytes += lost
        return following

    def _next_record(self, offset: int) -> int | None:
        """Offset of the next record, if the damaged one is no chunk and a plausible record follows it."""
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

    def _resynchronise(self) -> int:
        """Offset of the next record that the summary names, or of the next intact chunk, or the end.

        The search starts at the end of the verified data, which may be before the damage: a message index has no
        checksum, and a wrong length of one ends within the next chunk.
        """
        index = bisect.bisect_left(self._known_offsets, self._verified_end)
        limit = next((offset for offset in self._known_offsets[index:] if offset not in self._visited), self._end)
        overlap = b""
        for offset, block in self._source.blocks(self._verified_end, limit):
            text = overlap + block
            start = offset - len(overlap)
            hit = text.find(CHUNK_SIGNATURE)
            while hit >= 0:
                candidate = start + hit - SIGNATURE_OFFSET
                if candidate >= self._verified_end and self._is_chunk(candidate):
                    return candidate
                hit = text.find(CHUNK_SIGNATURE, hit + 1)
            overlap = text[-len(CHUNK_SIGNATURE) + 1 :]
        return limit

    def _is_chunk(self, offset: int) -> bool:
        try:
            self._chunk_at(offset)
        except DamageError:
            return False
        return True
