"""Making a complete recording of what is left of a truncated or damaged one."""

import itertools
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sbs_sim.errors import RecordingError
from sbs_sim.recording.checked_records import Content
from sbs_sim.recording.log import require_something
from sbs_sim.recording.mcap_file import DISTRO, MESSAGE_HEAD, RECOVERY, START, FileBuilder, Message, NewFile
from sbs_sim.recording.scan import Scan, scan
from sbs_sim.recording.source import Source


@dataclass(frozen=True)
class Recovery:
    """What became of a recovered file.

    Attributes
    ----------
    messages : int
        Messages in the new file.
    lost_bytes : int
        Bytes of the old one that could not be used.
    last_time : float or None
        Time of the latest message [s].
    complete : bool
        True if nothing that was recorded is missing. What had not yet reached the file when the recording program was
        killed cannot be known: a file without its end is never complete.
    reasons : tuple of str
        What was wrong, one line each.
    """

    messages: int
    lost_bytes: int
    last_time: float | None
    complete: bool
    reasons: tuple[str, ...]


class _Tally:
    """Count and checksum of messages, to compare what was written with what is read."""

    def __init__(self) -> None:
        self.count, self.crc, self.last = 0, 0, -1

    def add(self, messages: list[Message]) -> None:
        for channel, sequence, log_time, publish_time, data in messages:
            head = MESSAGE_HEAD.pack(0, len(data), channel, sequence, log_time, publish_time)
            self.crc = zlib.crc32(data, zlib.crc32(head, self.crc))
            self.last = max(self.last, log_time)
        self.count += len(messages)


def recover(path: str | Path, output: str | Path, progress: Callable[[float, float], None] | None = None) -> Recovery:
    """Write everything intact of a recording into a new, complete one, and verify that by reading it.

    Parameters
    ----------
    path : path-like
        Any recording; it is not changed.
    output : path-like
        Must not exist.
    progress : callable, optional
        Called with the number of chunks that are done and of all of them: they are written, then read again.

    Raises
    ------
    RecordingError
        No part of the file is intact, or one of the files cannot be read or written; then there is no output.
    """
    with Source(Path(path)) as source:
        # Twice through the file: the definitions may come after the first messages that need them.
        found = scan(source, lambda content: None)
        require_something(source, found)
        target = NewFile(Path(output))
        try:
            done = itertools.count(1)

            def report() -> None:
                if progress is not None:
                    progress(next(done), 2 * len(found.chunks))

            kept = _copy(source, found, target, report)
            target.close()
            _verify(target.path, kept, report)
        except BaseException:
            target.discard()
            raise
    return Recovery(
        messages=kept.count,
        lost_bytes=found.lost_bytes,
        last_time=kept.last / 1e9 if kept.count else None,
        complete=found.complete,
        reasons=tuple(found.reasons),
    )


def messages_of(content: Content) -> list[Message]:
    """Messages of a chunk."""
    data = content.data
    return [
        (channel, sequence, log_time, publish_time, data[start:end])
        for channel, sequence, log_time, publish_time, start, end in content.messages
    ]


def _copy(source: Source, found: Scan, target: NewFile, report: Callable[[], None]) -> _Tally:
    """Write what is intact into the new file; return the tally."""
    builder, kept = FileBuilder(), _Tally()
    builder.schemas, builder.channels = found.schemas, found.channels
    recording = dict(found.metadata).get(START, {})
    target.write(builder.start(recording.get("library", "unknown")))
    for name, data in found.metadata:
        if name != RECOVERY:
            target.write(builder.metadata(name, data))
    for attachment in found.attachments:
        target.write(builder.attachment(attachment))

    def take(content: Content) -> None:
        report()
        messages = [message for message in messages_of(content) if message[0] in found.channels]
        if messages:
            target.write(builder.chunk(messages))
            kept.add(messages)

    scan(source, take)
    if kept.count < found.messages:
        found.complete = False
        found.reasons.append(f"{found.messages - kept.count} messages of topics whose definitions are lost")
    if not kept.count and not found.complete:
        raise RecordingError(f"nothing in {source.path} can be read: the definitions of its topics are lost")
    details = {"complete": str(found.complete).lower(), "lost_bytes": str(found.lost_bytes)}
    target.write(builder.metadata(RECOVERY, {**details, "reasons": "\n".join(found.reasons)}))
    target.write(builder.finish(target.path.name, {}, recording.get(DISTRO, "")))
    return kept


def _verify(path: Path, kept: _Tally, report: Callable[[], None]) -> None:
    """Read the new file."""
    again = _Tally()

    def take(content: Content) -> None:
        report()
        again.add(messages_of(content))

    with Source(path) as source:
        found = scan(source, take)
    if not found.complete or found.reasons or (again.count, again.crc) != (kept.count, kept.crc):
        raise RecordingError(f"cannot write {path}: what was read back is not what was written")
