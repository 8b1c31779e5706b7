#!/usr/bin/env bash
# A bag compressed message by message gives numbers, not an error, to readers of MCAP: frames of zstd decoded as CDR.
#
# rosbags 0.11.9 with StoragePlugin.MCAP and CompressionMode.MESSAGE puts a zstd frame into every Message record. Channel and
# schema stay those of plain messages ("cdr", "ros2msg"); what was done is told by the text of one metadata record alone.
# mcap 1.6.0 with mcap-ros2-support 0.6.0, the reference decoder, takes the first bytes of the frame for the header of the
# encapsulation and the rest for the fields: 0.1 comes back as 1.4e-309. A flight log then plots as zero everywhere.
# CompressionMode.STORAGE compresses the chunks of MCAP itself, which every reader undoes. Who must read both looks for the
# magic number 28 b5 2f fd where the encapsulation header should be (its first byte is zero), or for compression_mode in the
# metadata record "rosbag2".
#
# Exit status 0 while the output is the one below.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf -- "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check rosbags==0.11.9 mcap==1.6.0 mcap-ros2-support==0.6.0
cat >"$folder/look.py" <<'PYTHON'
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

KIND = "std_msgs/msg/Float64"
store = get_typestore(Stores.ROS2_JAZZY)
for mode in ("NONE", "STORAGE", "MESSAGE"):
    path = Path(sys.argv[1]) / mode.lower()
    writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
    if mode != "NONE":
        writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection("/pitch", KIND, typestore=store)
        writer.write(connection, 0, store.serialize_cdr(store.types[KIND](data=0.1), KIND))
    (file,) = path.glob("*.mcap")
    with file.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        ((schema, channel, message, decoded),) = reader.iter_decoded_messages()
    print(f"{mode}: {channel.message_encoding} {schema.encoding} {message.data[:4].hex(' ')} -> {decoded.data:.1e}")
PYTHON
"$folder/venv/bin/python" "$folder/look.py" "$folder" | tee "$folder/seen"
diff - "$folder/seen" <<'SEEN'
NONE: cdr ros2msg 00 01 00 00 -> 1.0e-01
STORAGE: cdr ros2msg 00 01 00 00 -> 1.0e-01
MESSAGE: cdr ros2msg 28 b5 2f fd -> 1.4e-309
SEEN
