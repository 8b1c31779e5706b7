#!/usr/bin/env bash
# An attachment that was damaged on the disk is returned without a word, though the reader was asked to check checksums.
#
# mcap 1.6.0: make_reader(stream, validate_crcs=True) and StreamReader(stream, validate_crcs=True) raise CRCValidationError for
# a chunk with one changed byte. The Attachment record has a checksum of its own, over its name, times and data, and
# Writer.add_attachment writes it; but reading skips these four bytes, whatever was asked. Logs of flights keep what a
# replay needs in attachments (parameters, aircraft files): there one changed digit is another aircraft. Who reads them
# computes zlib.crc32 over the content of the record up to its last four bytes, as the specification has it.
#
# Exit status 0 while the output is the one below.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf -- "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mcap==1.6.0
cat >"$folder/look.py" <<'PYTHON'
import io
import struct
import zlib

from mcap.reader import make_reader
from mcap.records import Attachment
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

MAGIC, ATTACHMENT = b"\x89MCAP0\r\n", 0x09
stream = io.BytesIO()
writer = Writer(stream, compression=CompressionType.NONE)
writer.start()
schema = writer.register_schema("text", "jsonschema", b"{}")
channel = writer.register_channel("/mass", "json", schema)
writer.add_message(channel, 0, b'{"mass": 20.62}', 0)
writer.add_attachment(0, 0, "aircraft.json", "application/json", b'{"mass": 20.63}')
writer.finish()
good = stream.getvalue()


def changed(text):
    """The file with the 2 of a text made a 9."""
    return good.replace(text, text.replace(b"2", b"9", 1))


def outcome(read):
    try:
        return read()
    except Exception as error:
        return type(error).__name__


def by_stream(data):
    records = StreamReader(io.BytesIO(data), validate_crcs=True).records
    return next(bytes(record.data) for record in records if isinstance(record, Attachment))


def by_index(data):
    return next(bytes(found.data) for found in make_reader(io.BytesIO(data), validate_crcs=True).iter_attachments())


def messages(data):
    return [bytes(found[2].data) for found in make_reader(io.BytesIO(data), validate_crcs=True).iter_messages()]


def has_its_checksum(data):
    at = len(MAGIC)
    while data[at] != ATTACHMENT:  # a record: one byte of its kind, eight of its length, its content
        at += 9 + struct.unpack_from("<Q", data, at + 1)[0]
    content = data[at + 9 :][: struct.unpack_from("<Q", data, at + 1)[0]]
    return zlib.crc32(content[:-4]) == struct.unpack("<I", content[-4:])[0]


for name, data in (
    ("as written", good),
    ("message changed", changed(b'{"mass": 20.62}')),
    ("attachment changed", changed(b'{"mass": 20.63}')),
):
    print(f"{name}: messages {outcome(lambda: messages(data))}")
    print(f"  attachment {outcome(lambda: by_stream(data))} {outcome(lambda: by_index(data))}, sound: {has_its_checksum(data)}")
PYTHON
"$folder/venv/bin/python" "$folder/look.py" | tee "$folder/seen"
diff - "$folder/seen" <<'SEEN'
as written: messages [b'{"mass": 20.62}']
  attachment b'{"mass": 20.63}' b'{"mass": 20.63}', sound: True
message changed: messages CRCValidationError
  attachment b'{"mass": 20.63}' b'{"mass": 20.63}', sound: True
attachment changed: messages [b'{"mass": 20.62}']
  attachment b'{"mass": 90.63}' b'{"mass": 90.63}', sound: False
SEEN
