"""A node of another DDS implementation (CycloneDDS) that does what it is told, one command at a time.

Reads one JSON object a line from stdin and answers each with one line on stdout; ends when stdin does. Every message
that is received is decoded with the IDL types of `ros_types`, encoded again and compared: `same` says whether the bytes
agree up to padding. Messages are CDR with encapsulation header, in hexadecimal.

  {"op": "write", "topic": T, "type": N, "qos": Q}     -> {"id": I}       opens a writer
  {"op": "read", "topic": T, "type": N, "qos": Q}      -> {"id": I}       opens a reader
  {"op": "send", "id": I, "data": D}                   -> {}             or "file": PATH in the place of the data
  {"op": "take", "id": I, "count": C, "timeout_s": S}  -> {"samples": [{"data": D, "same": B, "sent_ns": T}]}
  {"op": "matched", "id": I, "count": C, "timeout_s": S} -> {"count": N, "waited_s": W}   waits for exactly C peers
  {"op": "close", "id": I}                             -> {}
  {"op": "play", "tape": PATH, "writers": {topic: I}, ...} -> {"sent": N, "held_s": H}   see `play`
  {"op": "load", ...}                                  see `load`
  {"op": "watch", ...}                                 see `watch`
  {"op": "status", "id": I}                            -> {"incompatible": N, "lost": N}

T is a topic of DDS (`rt/..`), N a ROS type or `blob:LENGTH:TYPE` for any bytes in its name, Q may hold "reliable", "transient_local" and "depth". A command with
"background": true answers at once and runs beside the others; {"op": "join"} waits for its answer.
"""

import json
import struct
import sys
import threading
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from ros_types import TYPES, blob

HEADER = bytes([0, 1, 0, 0])
MAX_PADDING = 7


class Sample:
    """Bytes on their way through the middleware."""

    def __init__(self, data):
        self.data = data
        self.sample_info = None


def carry_bytes(cls):
    """Lets the middleware carry bytes of this type without looking into them."""
    cls.serialize = lambda self, **_: self.raw
    cls.deserialize = classmethod(lambda _, data, **__: Sample(data))
    return cls


def same_bytes(one, other):
    short, long = sorted((bytes(one), bytes(other)), key=len)
    rest = long[len(short):]
    return long.startswith(short) and len(rest) <= MAX_PADDING and not any(rest)


def decodes(cls, data):
    """Whether the bytes are a message of the type, seen by its IDL alone. The padding in the options is not compared."""
    message = cls.__idl__.deserialize(data)
    again = cls.__idl__.serialize(message, use_version_2=False)
    return same_bytes(data[4:], again[4:])


def qos_of(wanted):
    depth = wanted.get("depth", 1)
    policies = [Policy.History.KeepLast(depth), Policy.DataRepresentation(use_cdrv0_representation=True)]
    reliable = wanted.get("reliable", True)
    policies.append(Policy.Reliability.Reliable(duration(seconds=2)) if reliable else Policy.Reliability.BestEffort)
    if wanted.get("transient_local"):
        policies.append(Policy.Durability.TransientLocal)
        policies.append(Policy.DurabilityService(
            duration(seconds=0), Policy.History.KeepLast(depth), -1, -1, -1))
    else:
        policies.append(Policy.Durability.Volatile)
    return Qos(*policies)


class Pace:
    """Maps times of a tape to now; what holds it up shifts everything after it."""

    def __init__(self, rate):
        self.rate = rate
        self.started = None
        self.first_ns = 0
        self.held = 0.0

    def wait_until(self, time_ns):
        if self.started is None:
            self.started, self.first_ns = time.monotonic(), time_ns
        due = self.started + self.held + (time_ns - self.first_ns) * 1e-9 / self.rate
        time.sleep(max(0.0, due - time.monotonic()))

    def hold(self, action):
        before = time.monotonic()
        action()
        self.held += time.monotonic() - before


class Peer:
    def __init__(self, domain):
        self.participant = DomainParticipant(domain)
        self.topics = {}
        self.endpoints = {}
        self.next_id = 1
        self.lock = threading.Lock()
        self.background = None

    def topic(self, name, type_name):
        if (name, type_name) not in self.topics:
            if type_name.startswith("blob:"):
                _, length, of = type_name.split(":")
                cls = carry_bytes(blob(int(length), of))
            else:
                cls = carry_bytes(TYPES[type_name])
            self.topics[name, type_name] = (Topic(self.participant, name, cls), cls)
        return self.topics[name, type_name]

    def open(self, make, command):
        topic, cls = self.topic(command["topic"], command["type"])
        endpoint = make(self.participant, topic, qos=qos_of(command.get("qos", {})))
        number, self.next_id = self.next_id, self.next_id + 1
        self.endpoints[number] = (endpoint, cls)
        return {"id": number}

    def write(self, command):
        return self.open(DataWriter, command)

    def read(self, command):
        return self.open(DataReader, command)

    def send_bytes(self, number, data):
        writer, cls = self.endpoints[number]
        sample = object.__new__(cls)
        sample.raw = data
        writer.write(sample)

    def send(self, command):
        if "file" in command:
            with open(command["file"], "rb") as file:
                self.send_bytes(command["id"], file.read())
        else:
            self.send_bytes(command["id"], bytes.fromhex(command["data"]))
        return {}

    def take(self, command):
        reader, cls = self.endpoints[command["id"]]
        until = time.monotonic() + command.get("timeout_s", 0)
        samples = []
        while len(samples) < command.get("count", 1):
            taken = reader.take(N=command.get("count", 1) - len(samples))
            for sample in taken:
                if not isinstance(sample, Sample):
                    continue
                samples.append({
                    "data": sample.data.hex(),
                    "same": decodes(cls, sample.data),
                    "sent_ns": sample.sample_info.source_timestamp,
                })
            if not taken:
                if time.monotonic() >= until:
                    break
                time.sleep(0.002)
        return {"samples": samples}

    def matched(self, command):
        endpoint, _ = self.endpoints[command["id"]]
        is_writer = isinstance(endpoint, DataWriter)
        count = lambda: len(  # noqa: E731
            endpoint.get_matched_subscriptions() if is_writer else endpoint.get_matched_publications())
        started = time.monotonic()
        until = started + command.get("timeout_s", 0)
        while count() != command["count"] and time.monotonic() < until:
            time.sleep(0.005)
        return {"count": count(), "waited_s": time.monotonic() - started}

    def status(self, command):
        endpoint, _ = self.endpoints[command["id"]]
        if isinstance(endpoint, DataWriter):
            status = endpoint.get_offered_incompatible_qos_status()
            return {"incompatible": status.total_count, "lost": 0}
        status = endpoint.get_requested_incompatible_qos_status()
        return {"incompatible": status.total_count, "lost": endpoint.get_sample_lost_status().total_count}

    def close(self, command):
        endpoint, _ = self.endpoints.pop(command["id"])
        del endpoint
        return {}

    def play(self, command):
        """Sends a tape in real time, held up where it says so. A tape is a row of entries, each beginning with its kind:
        M: u8 length of the topic, topic, i64 ns, u32 length, CDR - a message, due at its time
        P: f64 s - do nothing for so long
        W: i64 ns - go on when the reader `watch` has got a message whose first field is this time"""
        with open(command["tape"], "rb") as file:
            tape = file.read()
        position, sent, pace = 0, 0, Pace(command.get("rate", 1))
        while position < len(tape):
            kind, position = tape[position:position + 1], position + 1
            if kind == b"M":
                end = position + 1 + tape[position]
                topic = tape[position + 1:end].decode()
                time_ns, size = struct.unpack_from("<qI", tape, end)
                position = end + 12 + size
                pace.wait_until(time_ns)
                self.send_bytes(command["writers"][topic], tape[end + 12:position])
                sent += 1
            elif kind == b"P":
                (seconds,) = struct.unpack_from("<d", tape, position)
                position += 8
                pace.hold(lambda: time.sleep(seconds))
            elif kind == b"W":
                (time_ns,) = struct.unpack_from("<q", tape, position)
                position += 8
                pace.hold(lambda: self.wait_for_stamp(command["watch"], time_ns, command["patience_s"]))
            else:
                raise ValueError(f"a tape with {kind!r} at {position}")
        return {"sent": sent, "held_s": pace.held}

    def wait_for_stamp(self, number, time_ns, patience_s):
        reader, _ = self.endpoints[number]
        until = time.monotonic() + patience_s
        while time.monotonic() < until:
            for sample in reader.take(N=100):
                if isinstance(sample, Sample):
                    sec, nanosec = struct.unpack_from("<iI", sample.data, 4)
                    if sec * 10**9 + nanosec == time_ns:
                        return
            time.sleep(0.001)
        raise TimeoutError(f"no message of time {time_ns}")

    def load(self, command):
        """Sends each message at its own rate for a while: {"streams": [{"id": I, "data": D, "hz": F, "stamp_at": [offset, ..]}],
        "seconds": S}. The four plus four bytes at each offset of `stamp_at` become the time of sending; at `number_at` the
        number of the message is put, so that a lost one is seen."""
        streams = []
        for stream in command["streams"]:
            streams.append({**stream, "data": bytearray(bytes.fromhex(stream["data"])), "sent": 0})
        started = time.monotonic()
        late = 0.0
        while True:
            stream = min(streams, key=lambda stream: stream["sent"] / stream["hz"])
            due = started + stream["sent"] / stream["hz"]
            if due - started >= command["seconds"]:
                break
            wait = due - time.monotonic()
            if wait > 0:
                time.sleep(wait)
            late = max(late, time.monotonic() - due)
            now = time.time_ns()
            for offset in stream.get("stamp_at", []):
                struct.pack_into("<iI", stream["data"], offset, now // 10**9, now % 10**9)
            if "number_at" in stream:
                struct.pack_into("<I", stream["data"], stream["number_at"], stream["sent"])
            self.send_bytes(stream["id"], bytes(stream["data"]))
            stream["sent"] += 1
        return {"sent": [stream["sent"] for stream in streams], "late_max_s": late}

    def watch(self, command):
        """Notes what a reader gets until nothing has come for `quiet_s`: {"id": I, "stamp_at": offset, "quiet_s": S} ->
        {"seen": [[stamp, sent, got], ..]} in ns: the time in the message at that offset, when it was sent, and when it
        was here; what is shorter is left out. Nothing is decoded, so that watching costs little."""
        reader, _ = self.endpoints[command["id"]]
        seen, last = [], time.monotonic()
        while time.monotonic() - last < command["quiet_s"]:
            for sample in reader.take(N=100):
                if not isinstance(sample, Sample):
                    continue
                last = time.monotonic()
                if len(sample.data) < command["stamp_at"] + 8:
                    continue  # an empty set
                sec, nanosec = struct.unpack_from("<iI", sample.data, command["stamp_at"])
                seen.append([sec * 10**9 + nanosec, sample.sample_info.source_timestamp, time.time_ns()])
            time.sleep(0.002)
        return {"seen": seen}

    def run(self, command):
        operation = command["op"]
        if operation == "join":
            self.background.join(command.get("timeout_s", 600))
            return self.result
        if operation not in {"write", "read", "send", "take", "matched", "status", "close", "play", "load", "watch"}:
            raise ValueError(f"{operation} is no command")
        if command.get("background"):
            self.result = {"error": "not finished"}
            self.background = threading.Thread(target=self.keep, args=(operation, command), daemon=True)
            self.background.start()
            return {}
        return getattr(self, operation)(command)

    def keep(self, operation, command):
        try:
            self.result = getattr(self, operation)(command)
        except Exception as error:  # the answer to `join`
            self.result = {"error": repr(error)}


def main(arguments):
    if len(arguments) != 2:
        print("usage: peer.py DOMAIN", file=sys.stderr)
        return 2
    peer = Peer(int(arguments[1]))
    print(json.dumps({"ready": True}), flush=True)
    for line in sys.stdin:
        try:
            answer = peer.run(json.loads(line))
        except Exception as error:  # the test decides what it means
            answer = {"error": repr(error)}
        print(json.dumps(answer), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv))
