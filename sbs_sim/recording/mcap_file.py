"""The bytes of an MCAP file, piece by piece: what a writer and a recovery have in common.

The records are those of the `mcap` package. Its `Writer` is not used: it puts schemas and channels into the first chunk
only, so that one damaged chunk can make the whole file unreadable; it does not report what reached the file when the
disk is full; and its time per message is several times that of the few lines here.
"""

import contextlib
import io
import os
import struct
import zlib
from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from sbs_sim.errors import RecordingError

MAGIC = b"\x89MCAP0\r\n"
PROFILE = "ros2"
COMPRESSION = "zstd"
COMPRESSION_LEVEL = 1  # 3, the usual one, takes twice the time for 1 % of what flights need
MESSAGE_HEAD = struct.Struct("<BQHIQQ")  # opcode, length; channel, sequence, log time, publish time
MESSAGE_OVERHEAD = 22  # of a message's length, what is not its data
DEFINITIONS_TWICE = 2  # new schemas and channels come with the next two chunks,
DEFINITIONS_PERIOD = 8  # and all of them with every so many: no single damage can take them all
CHECKSUM = "crc32"  # key of a metadata record's checksum, which the format has not
ROSBAG2 = "rosbag2"  # metadata record of that name is rosbag2's
START = "recording"  # metadata record that every file of ours begins with,
RECOVERY = "recovery"  # and the one that every recovered file ends with
BAG_VERSION = 9  # of rosbag2's metadata, Jazzy's
# Keys of the metadata of a topic, and the first of metadata records too: programs that merge files keep them.
RECORDING_ID = "recording_id"  # which recording it belongs to,
ROLE = "role"  # and what the topic is in it, however it is called
DISTRO = "ros_distro"  # key of START, and of rosbag2's metadata

Message = tuple[int, int, int, int, bytes]  # channel, sequence, log time [ns], publish time [ns], data


class FileBuilder:
    """Makes the pieces of one file in their order and keeps what its summary needs.

    Attributes
    ----------
    size : int
        Bytes of all pieces so far.
    schemas, channels : dict
        Records by their number. Replaced, never changed: another thread may add to them.
    """

    def __init__(self) -> None:
        self.size = 0
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self._crc = 0
        self._defined = 0
        self._in_chunks: tuple[set[int], set[int]] = set(), set()  # schemas and channels whose definitions are in one
        self._definitions_due = 0
        self._compressor = zstandard.ZstdCompressor(level=COMPRESSION_LEVEL)
        self._counts: defaultdict[int, int] = defaultdict(int)
        # As they will be written: in a flight of hours they are tens of thousands, and as objects tens of megabytes.
        self._chunk_indices = bytearray()
        self._chunk_count = 0
        self._first_time, self._last_time = 2**64 - 1, 0  # the latest and the earliest that there are
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []

    def start(self, library: str) -> bytes:
        """First piece."""
        return self._piece(MAGIC + serialize(Header(PROFILE, library)))

    def metadata(self, name: str, data: dict[str, str]) -> bytes:
        """Piece with a metadata record; but for rosbag2's it has a checksum of its own."""
        if name != ROSBAG2:
            data = {**data, CHECKSUM: metadata_checksum(name, data)}
        record = serialize(Metadata(name, data))
        self._metadata.append(MetadataIndex(offset=self.size, length=len(record), name=name))
        return self._piece(record)

    def attachment(self, attachment: Attachment) -> bytes:
        """Piece with an attachment."""
        record = serialize(attachment)
        self._attachments.append(
            AttachmentIndex(
                offset=self.size,
                length=len(record),
                log_time=attachment.log_time,
                create_time=attachment.create_time,
                data_size=len(attachment.data),
                name=attachment.name,
                media_type=attachment.media_type,
            )
        )
        return self._piece(record)

    def chunk(self, messages: Sequence[Message]) -> bytes:
        """Piece with messages and their index; not for none."""
        parts = [self._definitions()]
        offset = len(parts[0])
        index: dict[int, list[tuple[int, int]]] = {}
        for channel, sequence, log_time, publish_time, data in messages:
            index.setdefault(channel, []).append((log_time, offset))
            length = MESSAGE_OVERHEAD + len(data)
            parts += (MESSAGE_HEAD.pack(5, length, channel, sequence, log_time, publish_time), data)
            offset += 9 + length
        content = b"".join(parts)
        times = [message[2] for message in messages]
        chunk = Chunk(
            compression=COMPRESSION,
            data=self._compressor.compress(content),
            message_start_time=min(times),
            message_end_time=max(times),
            uncompressed_crc=zlib.crc32(content),
            uncompressed_size=len(content),
        )
        return self._piece(self._indexed(chunk, index))

    def _definitions(self) -> bytes:
        """Schemas and channels, if it is their turn."""
        schemas, channels = self.schemas, self.channels
        if len(channels) != self._defined:
            self._defined = len(channels)
            self._definitions_due = DEFINITIONS_TWICE
        if not self._definitions_due and self._chunk_count % DEFINITIONS_PERIOD:
            return b""
        self._definitions_due = max(0, self._definitions_due - 1)
        self._in_chunks = set(schemas), set(channels)
        return _serialized([*schemas.values(), *channels.values()])

    def _other_definitions(self) -> bytes:
        """Definitions of the topics that came after the last chunk: readers want to have met all of the summary's."""
        schemas, channels = self._in_chunks
        others: list[McapRecord] = [schema for number, schema in self.schemas.items() if number not in schemas]
        return _serialized([*others, *(channel for number, channel in self.channels.items() if number not in channels)])

    def _indexed(self, chunk: Chunk, index: dict[int, list[tuple[int, int]]]) -> bytes:
        """A chunk with its message index."""
        builder = RecordBuilder()
        chunk.write(builder)
        chunk_length = builder.count
        offsets = {}
        for channel, entries in index.items():
            self._counts[channel] += len(entries)
            offsets[channel] = self.size + builder.count
            MessageIndex(channel, entries).write(builder)
        self._chunk_indices += serialize(
            ChunkIndex(
                chunk_length=chunk_length,
                chunk_start_offset=self.size,
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                message_end_time=chunk.message_end_time,
                message_index_length=builder.count - chunk_length,
                message_index_offsets=offsets,
                message_start_time=chunk.message_start_time,
                uncompressed_size=chunk.uncompressed_size,
            )
        )
        self._chunk_count += 1
        self._first_time = min(self._first_time, chunk.message_start_time)
        self._last_time = max(self._last_time, chunk.message_end_time)
        return builder.end()

    def finish(self, name: str, custom_data: dict[str, str], distro: str = "") -> bytes:
        """Last piece: rosbag2's metadata and the summary.

        Parameters
        ----------
        name : str
            The file's name, without its folder.
        custom_data : dict of str to str
            For rosbag2's metadata.
        distro : str
            Distribution of ROS 2 that recorded, for the same; empty where it is not known, as rosbag2 has it.
        """
        piece = self._piece(self._other_definitions())
        bag = bag_metadata(self._statistics(), self.schemas, self.channels, name, custom_data, distro)
        piece += self.metadata(ROSBAG2, {"serialized_metadata": bag})
        piece += self._piece(serialize(DataEnd(self._crc)))
        return piece + self._summary()

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self.channels),
            channel_message_counts=dict(sorted(self._counts.items())),  # of those that have some
            chunk_count=self._chunk_count,
            message_count=sum(self._counts.values()),
            message_end_time=self._last_time,
            message_start_time=self._first_time if self._chunk_count else 0,
            metadata_count=len(self._metadata),
            schema_count=len(self.schemas),
        )

    def _summary(self) -> bytes:
        """Summary, its offsets, and the footer with the checksum of all that."""
        groups = [
            (Opcode.SCHEMA, _serialized(self.schemas.values())),
            (Opcode.CHANNEL, _serialized(self.channels.values())),
            (Opcode.STATISTICS, serialize(self._statistics())),
            (Opcode.CHUNK_INDEX, bytes(self._chunk_indices)),
            (Opcode.ATTACHMENT_INDEX, _serialized(self._attachments)),
            (Opcode.METADATA_INDEX, _serialized(self._metadata)),
        ]
        offset, offsets = self.size, []
        for opcode, records in groups:
            if records:
                offsets.append(SummaryOffset(opcode, offset, len(records)))
            offset += len(records)
        offsets_start = offset
        summary = b"".join(records for _, records in groups) + _serialized(offsets)
        unsigned = serialize(Footer(self.size, offsets_start, 0))[:-4]
        return summary + unsigned + struct.pack("<I", zlib.crc32(summary + unsigned)) + MAGIC

    def _piece(self, data: bytes) -> bytes:
        self.size += len(data)
        self._crc = zlib.crc32(data, self._crc)
        return data


class NewFile:
    """A file that is made here and written from its start to its end.

    Parameters
    ----------
    path : Path
        Must not exist.

    Attributes
    ----------
    path : Path
        Where the file is, as far as is known, see `check_file`.

    Raises
    ------
    RecordingError
        It exists, its folder does not or must not be written: path and reason in one line. `write` raises it too.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._size = 0
        try:
            self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        except FileNotFoundError:
            raise RecordingError(f"cannot write {path}: the folder {path.parent} does not exist") from None
        except (OSError, ValueError) as error:  # the latter for names that no file can have
            raise RecordingError(f"cannot write {path}: {reason(error)}") from None
        own = os.fstat(self._descriptor)
        self._identity = own.st_dev, own.st_ino

    def write(self, data: bytes) -> None:
        """Hand all of it to the operating system; what was handed over survives the end of the process, however."""
        left = memoryview(data)
        try:
            while left:
                left = left[os.write(self._descriptor, left) :]
        except OSError as error:
            with contextlib.suppress(OSError):  # a partial record is of no use
                os.ftruncate(self._descriptor, self._size)
            raise RecordingError(f"cannot write {self.path}: {reason(error)}") from None
        self._size += len(data)

    def check_file(self) -> None:
        """Follow a file that was given another name.

        Raises
        ------
        RecordingError
            It was deleted, or another program has written into it: further writes would be lost.
        """
        if not self._is_at(self.path):
            self.path = self._present_path()
        if os.fstat(self._descriptor).st_size != self._size:
            raise RecordingError(f"{self.path} was overwritten by another program during the recording")

    def _present_path(self) -> Path:
        """Where the file is now, if it is anywhere and the system reports it (Linux)."""
        with contextlib.suppress(OSError):
            path = Path(os.readlink(f"/proc/self/fd/{self._descriptor}"))
            # NFS keeps a deleted file under such a name, until it is closed
            if os.fstat(self._descriptor).st_nlink and self._is_at(path) and not path.name.startswith(".nfs"):
                return path
        raise RecordingError(f"{self.path} was deleted while it was written: what was in it is lost")

    def _is_at(self, path: Path) -> bool:
        """True if a path leads to this file; where nobody may look it is believed to."""
        try:
            found = os.stat(path)
        except (FileNotFoundError, NotADirectoryError):
            return False
        except OSError:
            return True
        return (found.st_dev, found.st_ino) == self._identity

    def close(self) -> None:
        """Close it; more than once does no harm."""
        descriptor, self._descriptor = self._descriptor, -1
        try:
            if descriptor >= 0:
                os.close(descriptor)
        except OSError as error:  # some file systems say only now that the disk is full
            raise RecordingError(f"cannot write {self.path}: {reason(error)}") from None

    def discard(self) -> None:
        """Close and delete it; a file that another program has put there stays."""
        with contextlib.suppress(RecordingError):
            self.close()
        with contextlib.suppress(OSError):
            if self._is_at(self.path):
                self.path.unlink()


def reason(error: Exception) -> str:
    """What the operating system says, without number and path."""
    return (isinstance(error, OSError) and error.strerror) or " ".join(str(error).split())


def serialize(record: McapRecord) -> bytes:
    """Bytes of a record, with its opcode and length."""
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


def _serialized(records: Iterable[McapRecord]) -> bytes:
    return b"".join(map(serialize, records))


def metadata_checksum(name: str, data: dict[str, str]) -> str:
    """Checksum of a metadata record without its checksum."""
    return f"{zlib.crc32(serialize(Metadata(name, data))):08x}"


def bag_metadata(
    statistics: Statistics,
    schemas: dict[int, Schema],
    channels: dict[int, Channel],
    name: str,
    custom_data: dict[str, str],
    distro: str,
) -> str:
    """What rosbag2 of Jazzy writes about a file, as YAML."""
    yaml: Any = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.width = 10_000
    yaml.sort_base_mapping_type_on_output = False
    yaml.representer.ignore_aliases = lambda *_: True
    times = {
        "duration": {"nanoseconds": statistics.message_end_time - statistics.message_start_time},
        "starting_time": {"nanoseconds_since_epoch": statistics.message_start_time},
        "message_count": statistics.message_count,
    }
    topics = [
        {
            "topic_metadata": {
                "name": channel.topic,
                "type": schemas[channel.schema_id].name,
                "serialization_format": channel.message_encoding,
                "offered_qos_profiles": _profiles(yaml, channel.metadata.get("offered_qos_profiles", "")),
                "type_description_hash": channel.metadata.get("topic_type_hash", ""),
            },
            "message_count": statistics.channel_message_counts.get(channel.id, 0),
        }
        for channel in channels.values()
        if channel.schema_id in schemas  # rosbag2 knows no topics without a type
    ]
    text = io.StringIO()
    yaml.dump(
        {
            "version": BAG_VERSION,
            "storage_identifier": "mcap",
            **times,
            "topics_with_message_count": topics,
            "compression_format": "",  # of the whole file or of single messages, not of the chunks
            "compression_mode": "",
            "relative_file_paths": [name],
            "files": [{"path": name, **times}],
            "custom_data": custom_data,
            DISTRO: distro,
        },
        text,
    )
    return text.getvalue()


def _profiles(yaml: Any, text: str) -> Any:
    """Quality of service profiles of a topic; none where another writer has put something else there."""
    try:
        return yaml.load(text) or []
    except YAMLError:
        return []
