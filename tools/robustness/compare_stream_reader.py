"""Damage a recording many times and compare what is read with what `mcap.stream_reader` would give.

    ./run python tools/robustness/compare_stream_reader.py [--damages 700] [--seed 1]

After damage the stream reader is started again at the next bytes that look like a chunk. It prints in how many files
the stream reader gave other messages than `read`, metadata or attachments that were not recorded, or fewer metadata;
and the time per message of both.
"""

import argparse
import random
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from crash_recording import KINDS, Key, make_original, messages_of
from mcap.records import Attachment, Chunk, DataEnd, Message, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk, get_chunk_data_stream

from sbs_sim.errors import RecordingError
from sbs_sim.recording import read
from sbs_sim.recording.checked_records import CHUNK_SIGNATURE, MAX_RECORD_SIZE, SIGNATURE_OFFSET, chunk_content
from sbs_sim.recording.mcap_file import CHECKSUM, MAGIC, RECORDING_ID, ROSBAG2

OWN_KEYS = (CHECKSUM, RECORDING_ID)  # which `read` takes from metadata


def main() -> None:
    """Do what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--damages", type=int, default=700)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    chance, counts = random.Random(arguments.seed), Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        original, path = make_original(Path(folder), seconds=2.0), Path(folder) / "damaged.mcap"
        for number in range(arguments.damages):
            path.write_bytes(KINDS[number % len(KINDS)](original.data, chance)[0])
            messages, metadata, attachments = streamed(path)
            counts["other messages"] += messages != messages_of(path)
            counts["wrong metadata"] += not metadata.items() <= original.metadata.items()
            counts["wrong attachments"] += not attachments.items() <= original.attachments.items()
            counts["metadata missing"] += bool(metadata_of(path).keys() - metadata.keys())
        path.write_bytes(original.data)
        times = time_per_message(path)
    print(f"{arguments.damages} damaged files: {', '.join(f'{count} {what}' for what, count in counts.items())}")
    print(f"time per message: {times[0]:.2f} us by breakup_chunk, {times[1]:.2f} us by chunk_content")


def streamed(path: Path) -> tuple[dict[Key, bytes], dict[str, Any], dict[str, bytes]]:
    """Messages, metadata and attachments that the stream reader gives, started again after every damage."""
    messages, metadata, attachments = dict[Key, bytes](), dict[str, Any](), dict[str, bytes]()
    data, offset = path.read_bytes(), len(MAGIC)
    with path.open("rb") as file:
        while offset < len(data):
            file.seek(offset)
            reader = StreamReader(file, skip_magic=True, emit_chunks=True, record_size_limit=MAX_RECORD_SIZE)
            try:
                for record in reader.records:
                    match record:
                        case Chunk():
                            inside = [item for item in breakup_chunk(record, True) if isinstance(item, Message)]
                            messages |= {(item.channel_id, item.sequence): item.data for item in inside}
                        case Metadata() if record.name != ROSBAG2:
                            pairs = record.metadata.items()
                            metadata[record.name] = {key: value for key, value in pairs if key not in OWN_KEYS}
                        case Attachment():
                            attachments[record.name] = record.data
                        case DataEnd():
                            return messages, metadata, attachments
                    offset = file.tell()
                break
            except Exception:
                found = data.find(CHUNK_SIGNATURE, offset + 1 + SIGNATURE_OFFSET)
                offset = found - SIGNATURE_OFFSET if found >= 0 else len(data)
    return messages, metadata, attachments


def metadata_of(path: Path) -> dict[str, dict[str, str]]:
    """Metadata that `read` finds."""
    try:
        return dict(read(path).metadata)
    except RecordingError:
        return {}


def time_per_message(path: Path) -> tuple[float, float]:
    """Shortest time to take a chunk apart [us per message], by the package and by our code."""
    with path.open("rb") as file:
        chunks = [record for record in StreamReader(file, emit_chunks=True).records if isinstance(record, Chunk)]
    for chunk in chunks:  # unpacked, which takes both the same time
        stream, length = get_chunk_data_stream(chunk)
        chunk.data, chunk.compression = stream.read(length), ""
    count = sum(len(chunk_content(chunk.data).messages) for chunk in chunks)
    theirs = _shortest(lambda: [breakup_chunk(chunk) for chunk in chunks])
    ours = _shortest(lambda: [chunk_content(chunk.data) for chunk in chunks])
    return theirs / count * 1e6, ours / count * 1e6


def _shortest(work: Callable[[], Any]) -> float:
    times = []
    for _ in range(20):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return min(times)


if __name__ == "__main__":
    main()
