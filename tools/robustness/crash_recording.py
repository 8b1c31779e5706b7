"""Kill recording processes and damage recordings, many times over, and print what was lost.

    ./run python tools/robustness/crash_recording.py [--kills 200] [--damages 1000] [--seed 1]

A process that records a flight (six topics of the simulator's sizes, 100 Hz or slower or as fast as it can) is killed
with SIGKILL at a random moment; the time between the last message that is recovered and the kill is what was lost.
Then a recording is cut, overwritten, or bytes are inserted or removed at random offsets; what is recovered is compared
with the original: nothing may be there that was not recorded, and every chunk that was not touched must be there.
The exit code is 1 if one of these does not hold or a kill costs more than half a second.
"""

import argparse
import os
import random
import signal
import struct
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sbs_sim.errors import RecordingError
from sbs_sim.recording import Log, LogWriter, Recovery, qos_profiles, read, recover
from sbs_sim.recording.checked_records import Content
from sbs_sim.recording.scan import scan
from sbs_sim.recording.source import Source
from sbs_sim.recording.summary import read_summary

SCHEMA = "# Time of the message [ns].\nuint64 sent\n\n# Anything [-].\nfloat64[] values\n"
LENGTHS = (16, 72, 8, 88, 7, 0)  # numbers in the messages of six topics, about the simulator's
ALLOWED_LOSS = 0.5  # s
KILL_AFTER = (0.05, 2.0)  # s
TICKS = (0.01, 0.01, 0.2, 0.0)  # s of wall time between ticks: real time twice, a slow one, and as fast as it goes
Key = tuple[int, int]  # channel and sequence


def main() -> int:
    """Do what the command line asks for; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--damages", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    chance = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as folder:
        good = kill_many(Path(folder), arguments.kills, chance)
        good = damage_many(Path(folder), arguments.damages, chance) and good
    return 0 if good else 1


# ------------------------------------------------------------------------------------------------------------- kills


def kill_many(folder: Path, count: int, chance: random.Random) -> bool:
    """Kill that many recorders and print what it cost."""
    losses: list[float] = []
    early = 0
    for number in range(count):
        loss = kill_one(folder / f"kill{number}.mcap", TICKS[number % len(TICKS)], chance.uniform(*KILL_AFTER))
        early += loss is None
        losses += [] if loss is None else [loss]
    if losses:
        median, high = np.percentile(losses, [50, 95])
        print(f"{count} kills: lost {median:.3f} s (median), {high:.3f} s (95 %), {max(losses):.3f} s (most)")
        print(f"  {early} of them before the first chunk, within {ALLOWED_LOSS:g} s of the start")
    return all(loss <= ALLOWED_LOSS for loss in losses)


def kill_one(path: Path, tick: float, after: float) -> float | None:
    """Kill a recorder; seconds of flight that were lost, None if it had not written anything yet."""
    begin = time.monotonic_ns()
    child = os.fork()
    if child == 0:
        try:
            record(path, tick)
        finally:
            os._exit(1)
    time.sleep(after)
    killed = time.monotonic_ns()
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    output = path.with_suffix(".recovered.mcap")
    try:
        recovery = recover(path, output)
    except RecordingError:
        if killed - begin > ALLOWED_LOSS * 1e9:
            raise
        return None
    assert not recovery.complete
    messages = messages_of(output)
    check_no_gaps(messages)
    latest = max(struct.unpack_from("<Q", data, 4)[0] for data in messages.values())
    path.unlink()
    output.unlink()
    return (killed - latest) / 1e9


def record(path: Path, tick: float, ticks: int | None = None) -> LogWriter:
    """Record until killed, or a number of ticks."""
    log = LogWriter(
        path,
        library="crash_recording",
        wall_start=time.time_ns(),
        metadata={"aircraft": {"name": "sbs", "file": "rotors: 2"}, "flight": {"wind": "none"}},
        attachments={"sbs.yaml": b"mass: 15\n" * 100, "noise": bytes(range(256))},
    )
    profiles = qos_profiles()
    channels = [log.add_channel(f"/t{length}", f"test_msgs/msg/T{length}", SCHEMA, profiles) for length in LENGTHS]
    random_state = np.random.default_rng(1)
    number = 0
    while ticks is None or number < ticks:
        number += 1
        for channel, length in zip(channels, LENGTHS, strict=True):
            sent = time.monotonic_ns()
            values = np.round(random_state.normal(size=length), 3)
            head = struct.pack("<4BQI", 0, 1, 0, 0, sent, length) + (b"\0\0\0\0" if length else b"")
            log.write(channel, number * 10_000_000, head + values.tobytes(), wait=tick == 0.0)
        if tick:
            time.sleep(tick)
    return log


def messages_of(path: Path) -> dict[Key, bytes]:
    """All messages of a recording, however damaged."""
    messages: dict[Key, bytes] = {}

    def take(content: Content) -> None:
        for channel, sequence, _, _, start, end in content.messages:
            assert (channel, sequence) not in messages, "a message is there twice"
            messages[channel, sequence] = content.data[start:end]

    with Source(path) as source:
        scan(source, take)
    return messages


def check_no_gaps(messages: dict[Key, bytes]) -> None:
    """A killed recorder loses the end, nothing else."""
    for channel in {channel for channel, _ in messages}:
        numbers = sorted(sequence for other, sequence in messages if other == channel)
        assert numbers == list(range(1, len(numbers) + 1)), f"a gap in channel {channel}"


# ----------------------------------------------------------------------------------------------------------- damages


@dataclass(repr=False)
class Original:
    """A complete recording and what is in it.

    Attributes
    ----------
    data : bytes
    messages : dict
    chunks : dict
        Keys of the messages of each chunk, by where it begins and ends.
    metadata, attachments : dict
    """

    data: bytes
    messages: dict[Key, bytes]
    chunks: dict[tuple[int, int], set[Key]]
    metadata: dict[str, dict[str, str]]
    attachments: dict[str, bytes]


def make_original(folder: Path, seconds: float = 6.0) -> Original:
    """Record a short flight."""
    path = folder / "original.mcap"
    assert record(path, 0.01, round(seconds * 100)).close()
    spans = []
    with Source(path) as source:
        summary = read_summary(source)
        assert summary is not None
        starts = sorted(summary.chunks)
        contents: list[set[Key]] = []
        scan(source, lambda content: contents.append({message[:2] for message in content.messages}))
        for start in starts:
            length = struct.unpack("<Q", source.at(start + 1, 8))[0]
            spans.append((start, start + 9 + length))
    log = read(path)
    chunks = dict(zip(spans, contents, strict=True))
    return Original(path.read_bytes(), messages_of(path), chunks, log.metadata, log.attachments)


Damage = tuple[bytes, int, int, int]  # damaged file, first and last + 1 byte of the original touched, shift behind


def cut(data: bytes, chance: random.Random) -> Damage:
    """The end is missing."""
    offset = chance.randrange(len(data))
    return data[:offset], offset, len(data), 0


def flip(data: bytes, chance: random.Random) -> Damage:
    """One bit is wrong."""
    offset = chance.randrange(len(data))
    return data[:offset] + bytes([data[offset] ^ 1 << chance.randrange(8)]) + data[offset + 1 :], offset, offset + 1, 0


def flip_early(data: bytes, chance: random.Random) -> Damage:
    """One byte is wrong where the definitions, the metadata and the attachments are."""
    offset = chance.randrange(4000)
    return data[:offset] + bytes([data[offset] ^ chance.randrange(1, 256)]) + data[offset + 1 :], offset, offset + 1, 0


def overwrite(data: bytes, chance: random.Random) -> Damage:
    """A block of noise."""
    offset, length = chance.randrange(len(data)), chance.randrange(1, 5000)
    end = min(len(data), offset + length)
    return data[:offset] + chance.randbytes(end - offset) + data[end:], offset, end, 0


def zero(data: bytes, chance: random.Random) -> Damage:
    """A page of zeros, as file systems leave it."""
    offset = chance.randrange(len(data)) // 4096 * 4096
    end = min(len(data), offset + 4096)
    return data[:offset] + bytes(end - offset) + data[end:], offset, end, 0


def insert(data: bytes, chance: random.Random) -> Damage:
    """Noise in between."""
    offset, length = chance.randrange(len(data)), chance.randrange(1, 300)
    return data[:offset] + chance.randbytes(length) + data[offset:], offset, offset, length


def remove(data: bytes, chance: random.Random) -> Damage:
    """Bytes are missing in between."""
    offset, length = chance.randrange(len(data) - 300), chance.randrange(1, 300)
    return data[:offset] + data[offset + length :], offset, offset + length, -length


KINDS: tuple[Callable[[bytes, random.Random], Damage], ...] = (cut, flip, flip_early, overwrite, zero, insert, remove)


def damage_many(folder: Path, count: int, chance: random.Random) -> bool:
    """Damage a recording in many ways, one at a time, and print what was recovered."""
    original = make_original(folder)
    print(f"{count} damages to {len(original.data)} bytes, {len(original.messages)} messages", end="")
    print(f" in {len(original.chunks)} chunks")
    wrong = 0
    for number, kind in enumerate(KINDS):
        share = count // len(KINDS) + (number < count % len(KINDS))
        lost = [0]
        outcome = {"complete": 0, "in part": 0, "not": 0}
        for _ in range(share):
            try:
                result, missing = damage_one(folder, original, kind(original.data, chance))
            except Exception as error:
                wrong += 1
                print(f"  {kind.__name__}: {error!r}")
                continue
            outcome[result] += 1
            lost += [missing]
        figures = ", ".join(f"{value} {key}" for key, value in outcome.items() if value)
        print(f"  {kind.__name__:10}: {figures}; messages lost: {np.median(lost):.0f} (median), {max(lost)} (most)")
    print(f"  {wrong} wrong")
    return not wrong


def damage_one(folder: Path, original: Original, damage: Damage) -> tuple[str, int]:
    """Recover a damaged file and check all that must hold; how that went, and how many messages are lost."""
    data, first, last, _ = damage
    path, output = folder / "damaged.mcap", folder / "output.mcap"
    path.write_bytes(data)
    output.unlink(missing_ok=True)
    untouched = [keys for (start, end), keys in original.chunks.items() if end <= first or start >= last]
    why = ""
    try:
        recovery = recover(path, output)
    except RecordingError as error:
        why = str(error)
    if why:
        assert "\n" not in why
        assert not untouched, "chunks that are whole were not recovered"
        assert not output.exists(), "an output without content"
        return "not", len(original.messages)
    messages = messages_of(output)
    assert messages.items() <= original.messages.items(), "something that was not recorded"
    assert set().union(*untouched) <= messages.keys(), "chunks that are whole are missing"
    check_rest(original, recovery, read(path), read(output))
    return "complete" if recovery.complete else "in part", len(original.messages) - len(messages)


def check_rest(original: Original, recovery: Recovery, damaged: Log, output: Log) -> None:
    """All that must hold of metadata, attachments and of what is said of a file that was recovered."""
    assert sum(len(topic.time_ns) for topic in damaged.values()) == recovery.messages
    assert (damaged.complete, damaged.reasons) == (recovery.complete, recovery.reasons)
    metadata = {name: data for name, data in output.metadata.items() if name != "recovery"}
    assert (metadata, output.attachments) == (damaged.metadata, damaged.attachments)
    assert metadata.items() <= original.metadata.items(), "wrong metadata"
    assert output.attachments.items() <= original.attachments.items(), "a wrong attachment"
    assert output.complete
    if recovery.complete:
        assert recovery.messages == len(original.messages), "messages are missing"
        assert (metadata, output.attachments) == (original.metadata, original.attachments), "something is missing"
    else:
        assert recovery.reasons


if __name__ == "__main__":
    sys.exit(main())
