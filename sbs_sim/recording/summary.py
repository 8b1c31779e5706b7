"""Summary of an MCAP file: its definitions and where its records begin."""

import io
import zlib
from dataclasses import dataclass, field

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Channel, ChunkIndex, Footer, MetadataIndex, Schema, Statistics
from mcap.stream_reader import StreamReader

from sbs_sim.recording.checked_records import PARSE_ERRORS, RECORD_HEAD, Extent, read_record
from sbs_sim.recording.mcap_file import MAGIC
from sbs_sim.recording.source import DamageError, Source

FOOTER_SIZE = RECORD_HEAD.size + 20


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

    def offsets(self) -> list[int]:
        """Offsets of chunks, attachments and metadata."""
        return sorted([*self.chunks, *self.attachments, *self.metadata])


def read_summary(source: Source, checked: bool = True) -> Summary | None:
    """The summary, if there is one with a right checksum.

    Where it need not be `checked` it may lack the checksum, or be missing altogether in a file that has its end.
    """
    try:
        end = source.size - FOOTER_SIZE - len(MAGIC)
        data = source.at(end, FOOTER_SIZE) if end > 0 else b""
        if data[: RECORD_HEAD.size] != RECORD_HEAD.pack(Opcode.FOOTER, 20):
            return None
        footer = read_record(Footer, data[RECORD_HEAD.size :])
        if not footer.summary_start and not checked:
            return Summary(end)
        if not len(MAGIC) <= footer.summary_start <= end:
            return None
        records = source.at(footer.summary_start, end - footer.summary_start)
        if zlib.crc32(records + data[:-4]) != footer.summary_crc and (checked or footer.summary_crc):
            return None
        return _summary_of(footer.summary_start, records + data + MAGIC)
    except (DamageError, *PARSE_ERRORS):
        return None


def _summary_of(start: int, data: bytes) -> Summary:
    """Summary of its records, the footer and the magic bytes."""
    summary = Summary(start)
    for record in StreamReader(io.BytesIO(data), skip_magic=True).records:
        match record:
            case Schema():
                summary.schemas[record.id] = record
            case Channel():
                summary.channels[record.id] = record
            case ChunkIndex():
                extent = record.uncompressed_size, record.message_start_time, record.message_end_time
                summary.chunks[record.chunk_start_offset] = extent
            case AttachmentIndex():
                summary.attachments[record.offset] = record.name
            case MetadataIndex():
                summary.metadata[record.offset] = record.name
            case Statistics():
                summary.messages = record.message_count
    return summary
