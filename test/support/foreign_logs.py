"""Files as other programs make them of logs: several in one, or written down with the time of day."""

import heapq

from mcap.reader import make_reader
from mcap.writer import Writer


def merge(output, *paths):
    """One file of several, as `pymcap-cli merge` makes it: channels that are alike become one, the rest is kept."""
    with output.open("wb") as file:
        writer = Writer(file)
        writer.start("ros2", "merge")
        readers = [make_reader(path.open("rb")) for path in paths]
        numbers = {}
        for reader in readers:
            for record in reader.iter_metadata():
                writer.add_metadata(record.name, record.metadata)
            for item in reader.iter_attachments():
                writer.add_attachment(item.create_time, item.log_time, item.name, item.media_type, item.data)
        messages = [reader.iter_messages() for reader in readers]
        for schema, channel, message in heapq.merge(*messages, key=lambda found: found[2].log_time):
            number = _channel(writer, numbers, schema, channel)
            writer.add_message(number, message.log_time, message.data, message.publish_time, message.sequence)
        writer.finish()
    return output


def rewrite(output, path, time, wanted=lambda topic: True):
    """The messages of a log as a recorder of topics writes them, each with the time that `time` makes of its own."""
    with output.open("wb") as file, path.open("rb") as source:
        writer, numbers = Writer(file), {}
        writer.start("ros2", "recorder")
        for schema, channel, message in make_reader(source).iter_messages():
            if wanted(channel.topic):
                channel.metadata = {}
                number = _channel(writer, numbers, schema, channel)
                writer.add_message(number, time(message.log_time), message.data, message.log_time)
        writer.finish()
    return output


def _channel(writer, numbers, schema, channel):
    """Number of a channel in the new file."""
    key = (channel.topic, schema.name, schema.data, *sorted(channel.metadata.items()))
    if key not in numbers:
        kind = writer.register_schema(schema.name, schema.encoding, schema.data)
        numbers[key] = writer.register_channel(channel.topic, channel.message_encoding, kind, channel.metadata)
    return numbers[key]


def edit(output, path, copies, number=lambda count, own: own):
    """A log in which some messages are missing or doubled.

    `copies` says how many there are to be of the message of a topic with a number; `number` numbers them, by how many
    there were and by what the number was.
    """
    with output.open("wb") as file, path.open("rb") as source:
        reader, writer, numbers, counts = make_reader(source), Writer(file), {}, {}
        writer.start("ros2", "editor")
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        for item in reader.iter_attachments():
            writer.add_attachment(item.create_time, item.log_time, item.name, item.media_type, item.data)
        for schema, channel, message in reader.iter_messages():
            own = _channel(writer, numbers, schema, channel)
            for _ in range(copies(channel.topic, message.sequence)):
                counts[own] = counts.get(own, 0) + 1
                new = number(counts[own], message.sequence)
                writer.add_message(own, message.log_time, message.data, message.publish_time, new)
        writer.finish()
    return output
