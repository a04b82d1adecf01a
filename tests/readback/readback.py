"""Reads every message of an MCAP file with two programs that are not ours, and compares what they see.

rosbags decodes each message with the schemas stored in the file and encodes it again: the bytes must be the same, up
to trailing padding. mcap-ros2-support decodes each message on its own. Prints the counts of both per topic. Exit code
0: both read everything and agree; 1: they do not; 2: wrong use.
"""

import sys
from collections import Counter
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

MAX_PADDING = 7


def typestore_of(reader):
    """The types that the file itself defines, on an empty store."""
    types = {}
    for connection in reader.connections:
        types.update(get_types_from_msg(connection.msgdef.data, connection.msgtype))
    store = get_typestore(Stores.EMPTY)
    store.register(types)
    return store


def same_bytes(written, again):
    """Whether two serialized messages differ at most by zeros at the end."""
    written, again = bytes(written), bytes(again)
    short, long = sorted((written, again), key=len)
    rest = long[len(short) :]
    return long.startswith(short) and len(rest) <= MAX_PADDING and not any(rest)


def with_rosbags(path, problems):
    counts = Counter()
    with AnyReader([path]) as reader:
        store = typestore_of(reader)
        for connection, time, raw in reader.messages():
            number = counts[connection.topic]
            counts[connection.topic] += 1
            try:
                message = store.deserialize_cdr(raw, connection.msgtype)
                again = store.serialize_cdr(message, connection.msgtype)
            except Exception as error:  # any failure to decode is a finding
                problems.append(f"rosbags: {connection.topic} message {number} at {time}: {error!r}")
                continue
            if not same_bytes(raw, again):
                problems.append(f"rosbags: {connection.topic} message {number} at {time}: encodes to other bytes")
        if reader.message_count != counts.total():
            problems.append(f"rosbags: the statistics say {reader.message_count}, read {counts.total()}")
    return counts


def with_mcap_ros2(path, problems):
    counts = Counter()
    factory = DecoderFactory()
    decoders = {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            number = counts[channel.topic]
            counts[channel.topic] += 1
            try:
                if channel.id not in decoders:
                    decoders[channel.id] = factory.decoder_for(channel.message_encoding, schema)
                if decoders[channel.id](message.data) is None:
                    raise ValueError("nothing was decoded")
            except Exception as error:  # any failure to decode is a finding
                problems.append(f"mcap-ros2: {channel.topic} message {number} at {message.log_time}: {error!r}")
    return counts


def main(arguments):
    if len(arguments) != 2:
        print("usage: readback.py OUT.mcap", file=sys.stderr)
        return 2
    path = Path(arguments[1])
    problems = []
    readers = {}
    for name, read in (("rosbags", with_rosbags), ("mcap-ros2", with_mcap_ros2)):
        try:
            readers[name] = read(path, problems)
        except Exception as error:  # a reader that gives up is a finding
            problems.append(f"{name}: gave up: {error!r}")
            readers[name] = Counter()
    first, second = readers.values()
    print(f"{'rosbags':>9} {'mcap-ros2':>9}  topic")
    for topic in sorted(first.keys() | second.keys()):
        print(f"{first[topic]:>9} {second[topic]:>9}  {topic}")
        if first[topic] != second[topic]:
            problems.append(f"{topic}: rosbags read {first[topic]}, mcap-ros2 {second[topic]}")
    print(f"{first.total():>9} {second.total():>9}  total")
    for problem in problems[:20]:
        print(problem, file=sys.stderr)
    if len(problems) > 20:
        print(f"and {len(problems) - 20} more", file=sys.stderr)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv))
