"""Which data of a recording may lack a checksum: none in files of this package, some in those of other writers."""

from dataclasses import dataclass

from mcap.opcode import Opcode

from sbs_sim.recording.checked_records import CHUNK_HEAD, CONTENT_RECORDS, RECORD_HEAD, checked_metadata
from sbs_sim.recording.mcap_file import MAGIC, RECOVERY, ROSBAG2, START
from sbs_sim.recording.source import DamageError, Source
from sbs_sim.recording.summary import Summary, read_summary

# Records between chunks. Schemas and channels are used from chunks only, where a checksum covers them.
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


@dataclass(frozen=True)
class OptionalChecksums:
    """Which data of a file are accepted without a checksum, since its writer made none.

    Attributes
    ----------
    parts : bool
        Metadata, attachments and summary, as in any file of another writer, which may lack a summary too.
    chunks : bool
        Chunks, since none has a checksum; messages may then be outside of chunks.
    """

    parts: bool = False
    chunks: bool = False


def open_recording(source: Source) -> tuple[OptionalChecksums, Summary | None]:
    """Which checksums of a file are optional, and its summary if that is usable."""
    summary = read_summary(source)
    optional = optional_checksums(source, summary)
    if summary is None and optional.parts:
        summary = read_summary(source, checked=False)
    return optional, summary


def optional_checksums(source: Source, summary: Summary | None) -> OptionalChecksums:
    """Which checksums of a file are optional, from its summary or from the heads of its records."""
    if summary is not None and {START, RECOVERY} & set(summary.metadata.values()):
        return OptionalChecksums()
    parts, chunks = summary is not None, False
    offset = len(MAGIC)
    try:
        while offset < source.size:
            opcode, length = RECORD_HEAD.unpack(source.at(offset, RECORD_HEAD.size))
            if opcode == Opcode.METADATA and has_own_checksum(source.at(offset + RECORD_HEAD.size, length)):
                return OptionalChecksums()
            if opcode == Opcode.CHUNK and CHUNK_HEAD.unpack(source.at(offset, CHUNK_HEAD.size))[5]:
                return OptionalChecksums(parts=True)
            parts = parts or opcode == Opcode.DATA_END
            chunks = chunks or opcode in (Opcode.CHUNK, Opcode.MESSAGE)
            if opcode == Opcode.DATA_END or opcode not in OTHER_RECORDS | CONTENT_RECORDS | {Opcode.CHUNK}:
                break
            offset += RECORD_HEAD.size + length
    except DamageError:
        pass  # what was seen before it counts
    return OptionalChecksums(parts or chunks, chunks)


def has_own_checksum(data: bytes) -> bool:
    """True for a metadata record with the checksum that this package adds."""
    try:
        return checked_metadata(data).name != ROSBAG2
    except DamageError:
        return False
