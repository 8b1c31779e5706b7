"""A log read by the programs of others, each in an environment of its own, and compared with our reader.

    ./run python tools/log_readers.py [bags/hover_step.mcap]

Needs the network; the readers of npm need node and npm, and are left out without them. Of each reader: the number of
messages of every topic, and the positions and flap angles of the flight, bit for bit. The table of docs/howto/logs.md
is what it prints.
"""

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

import numpy as np

from sbs_sim.recording import read

ROOT = Path(__file__).resolve().parents[1]
FIELDS = (("/state", "position"), ("/rotors", "flap"))  # whose values are compared

# Each prints a line of JSON: the number of messages by topic, and a digest of the values as little-endian doubles.
DIGEST = """
import hashlib, json, struct, sys
counts, seen = {}, {"/state": hashlib.sha256(), "/rotors": hashlib.sha256()}
def take(topic, message):
    counts[topic] = counts.get(topic, 0) + 1
    if topic == "/state":
        values = [message.position.x, message.position.y, message.position.z]
    elif topic == "/rotors":
        values = [value for rotor in message.rotors for value in rotor.flap]
    else:
        return
    seen[topic].update(struct.pack(f"<{len(values)}d", *values))
def end():
    print(json.dumps([counts, {topic: one.hexdigest()[:16] for topic, one in seen.items()}]))
"""
MCAP = (
    DIGEST
    + """
from mcap_ros2.reader import read_ros2_messages
for one in read_ros2_messages(sys.argv[1]):
    take(one.channel.topic, one.ros_msg)
end()
"""
)
FAST = (
    DIGEST
    + """
from mcap.reader import make_reader
from mcap_ros2_support_fast.decoder import DecoderFactory
with open(sys.argv[1], "rb") as file:
    for _, channel, _, message in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
        take(channel.topic, message)
end()
"""
)
ROSBAGS = (
    DIGEST
    + """
from pathlib import Path
from rosbags.highlevel import AnyReader
with AnyReader([Path(sys.argv[1])]) as reader:
    for connection, _, raw in reader.messages():
        take(connection.topic, reader.deserialize(raw, connection.msgtype))
end()
"""
)
RERUN = (
    DIGEST
    + """
from types import SimpleNamespace
from rerun.chunk import McapReader
def spaces(value):
    if isinstance(value, dict):
        return SimpleNamespace(**{name: spaces(item) for name, item in value.items()})
    return [spaces(item) for item in value] if isinstance(value, list) else value
rows = []
for chunk in McapReader(sys.argv[1]).stream():
    table = chunk.to_record_batch()
    for name in table.schema.names:
        if name.endswith(":message"):
            times = table.column("message_log_time").cast("int64").to_pylist()
            rows += zip(times, [chunk.entity_path] * len(times), table.column(name).to_pylist())
for _, topic, row in sorted(rows, key=lambda row: row[0]):
    take(topic, spaces(row[0]))
end()
"""
)
# The curves of a layout by another implementation of the paths that Foxglove has.
PATHS = """
import json, math, sys
from mcap.reader import make_reader
from mcap_ros2_support_fast.decoder import DecoderFactory
from ros_parser.message_path import parse_message_path
with open(sys.argv[2]) as file:
    panels = json.load(file)["configById"].values()
paths, values = {}, {}
for text in (path["value"] for panel in panels for path in panel.get("paths", [])):
    plain, _, change = text.partition(".@")
    parsed = parse_message_path(text), parse_message_path(plain)
    paths.setdefault(plain.split(".")[0], []).append((text, *parsed, change))
with open(sys.argv[1], "rb") as file:
    for _, channel, _, message in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
        for text, whole, plain, change in paths.get(channel.topic, ()):
            before = plain.apply(message)
            right = whole.apply(message) == (math.degrees(before) if change == "degrees" else before)
            values.setdefault(text, []).append(right)
missing = sum(map(len, paths.values())) - len(values)
rights = [right for one in values.values() for right in one]
wrong = rights.count(False)
print(json.dumps(f"{len(values)} curves, {len(rights)} values; {missing} curves empty, {wrong} values wrong"))
"""
NODE = """
import { McapIndexedReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { decompress } from "fzstd";
import { createHash } from "node:crypto";
import { open } from "node:fs/promises";
const file = await open(process.argv[2]);
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, size) => {
    const bytes = new Uint8Array(Number(size));
    await file.read(bytes, 0, Number(size), Number(offset));
    return bytes;
  },
};
const reader = await McapIndexedReader.Initialize({
  readable, decompressHandlers: { zstd: (data, size) => decompress(data, new Uint8Array(Number(size))) },
});
const readers = new Map(), counts = {};
const seen = { "/state": createHash("sha256"), "/rotors": createHash("sha256") };
for (const channel of reader.channelsById.values()) {
  const text = new TextDecoder().decode(reader.schemasById.get(channel.schemaId).data);
  readers.set(channel.id, new MessageReader(parse(text, { ros2: true })));
}
for await (const message of reader.readMessages()) {
  const topic = reader.channelsById.get(message.channelId).topic;
  const value = readers.get(message.channelId).readMessage(message.data);
  counts[topic] = (counts[topic] ?? 0) + 1;
  let numbers = [];
  if (topic === "/state") numbers = [value.position.x, value.position.y, value.position.z];
  if (topic === "/rotors") numbers = value.rotors.flatMap((rotor) => Array.from(rotor.flap));
  if (numbers.length) seen[topic].update(Buffer.from(Float64Array.from(numbers).buffer));
}
const digests = Object.fromEntries(Object.entries(seen).map(([topic, one]) => [topic, one.digest("hex").slice(0, 16)]));
console.log(JSON.stringify([counts, digests]));
"""
PYTHON = {
    "mcap-ros2-support": (("mcap==1.6.0", "mcap-ros2-support==0.6.0"), MCAP),
    "mcap-ros2-support-fast": (("mcap==1.6.0", "mcap-ros2-support-fast==0.8.0"), FAST),
    "rosbags": (("rosbags==0.11.9",), ROSBAGS),
    "rerun": (("rerun-sdk==0.41.0",), RERUN),
}
PATH_PACKAGES = (*PYTHON["mcap-ros2-support-fast"][0], "ros-parser==0.9.0")
PACKAGES = ("@mcap/core@2.2.2", "@foxglove/rosmsg@5.0.5", "@foxglove/rosmsg2-serialization@3.1.0", "fzstd@0.1.1")
COMMANDS = {"pymcap-cli": ("pymcap-cli==0.34.0", ("info", "doctor"))}  # only looked at for their exit code


def ours(log):
    """Numbers of messages by topic and digests of the values, by our own reader."""
    found = read(log)
    counts = {topic.name: len(topic.time_ns) for topic in found.values()}
    state, rotors = found["state"], found["rotors"]
    position = np.stack([state[f"position.{axis}"] for axis in "xyz"], axis=1)
    names = sorted(name for name in rotors if name.endswith(".flap"))
    flap = np.concatenate([rotors[name] for name in names], axis=1)
    values = {"/state": position, "/rotors": flap}
    return counts, {
        topic: hashlib.sha256(one.astype("<f8").tobytes()).hexdigest()[:16] for topic, one in values.items()
    }


def environment(folder, packages):
    """Folder with the programs of a new environment that has packages."""
    venv.create(folder, with_pip=True)
    install = [folder / "bin" / "python", "-m", "pip", "install", "-q", "--disable-pip-version-check", *packages]
    subprocess.run(install, check=True, env=clean(), capture_output=True)
    return folder / "bin"


def clean():
    """Environment of a process without our packages."""
    return {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}


def answer(command, **options):
    """What a reader says, or the last line of its complaint."""
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False, env=clean(), **options)
    if done.returncode:
        return (done.stderr.strip() or done.stdout.strip()).splitlines()[-1]
    return json.loads(done.stdout.splitlines()[-1])


def verdict(found, wanted):
    """One line: alike, or what differs."""
    if isinstance(found, str):
        return found
    counts, digests = found
    lost = sorted(set(wanted[0]) - set(counts))
    if dict(counts) != {name: count for name, count in wanted[0].items() if count}:
        return f"other numbers of messages; without {', '.join(lost)}" if lost else "other numbers of messages"
    return "all messages, values bit for bit" if digests == wanted[1] else "all messages, other values"


def main() -> None:
    """Read and print."""
    parser = argparse.ArgumentParser(description="Read a log with the programs of others.")
    parser.add_argument("log", nargs="?", default=ROOT / "bags" / "hover_step.mcap", type=Path)
    log = parser.parse_args().log.resolve()
    wanted = ours(log)
    print(f"{log.name}: {sum(wanted[0].values())} messages on {len(wanted[0])} topics", flush=True)
    with tempfile.TemporaryDirectory(prefix="readers-") as name:
        folder = Path(name)
        for reader, (packages, code) in PYTHON.items():
            programs = environment(folder / reader, packages)
            said = verdict(answer([programs / "python", "-c", code, log]), wanted)
            print(f"| {', '.join(packages)} | {said} |", flush=True)
        programs = environment(folder / "paths", PATH_PACKAGES)
        said = answer([programs / "python", "-c", PATHS, log, ROOT / "config" / "layouts" / "foxglove.json"])
        print(f"| {', '.join(PATH_PACKAGES)}, curves of foxglove.json | {said} |", flush=True)
        for reader, (package, words) in COMMANDS.items():
            programs = environment(folder / reader, [package])
            for word in words:
                done = subprocess.run([programs / reader, word, log], capture_output=True, check=False, env=clean())
                print(f"| {package} {word} | exit code {done.returncode} |", flush=True)
        if shutil.which("npm") is None:
            sys.exit("no npm: its readers are left out")
        node = folder / "node"
        node.mkdir()
        (node / "package.json").write_text('{"type": "module"}')
        (node / "read.mjs").write_text(NODE)
        subprocess.run(["npm", "install", "--silent", "--no-audit", "--no-fund", *PACKAGES], check=True, cwd=node)
        print(f"| {', '.join(PACKAGES)} | {verdict(answer(['node', 'read.mjs', log], cwd=node), wanted)} |")


if __name__ == "__main__":
    main()
