"""Writes the bags of crates/flexure-io/tests/data/bags with rosbags and mcap, and what rosbags reads of them as bags.json.

Usage: python scripts/reference/bag_fixtures.py    (rosbags 0.11, mcap 1.6, zstandard, lz4)
"""

import json
import pathlib
import shutil
import sqlite3
import struct
import tempfile

import numpy as np
import zstandard
from mcap.writer import CompressionType, Writer as Mcap
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

OUT = pathlib.Path(__file__).resolve().parents[2] / "crates/flexure-io/tests/data/bags"
STORE = get_typestore(Stores.ROS2_HUMBLE)
PROBE = """std_msgs/Header header
uint8 MODE_IDLE=3
bool on
int8 small
uint64 large
float32[3] single
geometry_msgs/Vector3[] points
string note
uint8[] image
int64 wide
"""
STORE.register(get_types_from_msg(PROBE, "own_msgs/msg/Probe"))
T = STORE.types
N = 40
RNG = np.random.default_rng(28)


def header(k, base=1_700_000_000):
    ns = k * 10_000_000 + int(RNG.integers(0, 50_000))
    return T["std_msgs/msg/Header"](T["builtin_interfaces/msg/Time"](base + ns // 10**9, ns % 10**9), "base" * (k % 3))


def joints(k, names, effort=True):
    f = lambda a: np.array([a * np.sin(0.1 * k + i) for i in range(len(names))])  # noqa: E731
    return T["sensor_msgs/msg/JointState"](header(k), list(names), f(1.0), f(0.1), f(2.0) if effort else np.zeros(0))


def probe(k):
    vector = T["geometry_msgs/msg/Vector3"]
    points = [vector(k + i, 0.5 * k, -1e-3 * k) for i in range(2)]
    single = np.array([k / 3, k / 7, -k], dtype=np.float32)
    image = np.zeros(k % 5, dtype=np.uint8)
    wide = 2**60 + k
    return T["own_msgs/msg/Probe"](header(k), k % 2 == 0, -k, 1000 + k, single, points, "x" * (k % 4), image, wide)


def messages(order):
    """Topic, type, instant, message."""
    names = ["shoulder", "elbow", "wrist_3"]
    for k in range(N):
        logged = 1_700_000_000_000_000_000 + k * 10_000_000 + 123
        turned = names if k % 2 == 0 or not order else names[::-1]
        yield "/joint_states", "sensor_msgs/msg/JointState", logged, joints(k, turned)
        if k % 2 == 0:
            yield "/gripper", "sensor_msgs/msg/JointState", logged + 5, joints(k, ["finger"], effort=False)
        yield "/probe", "own_msgs/msg/Probe", logged + 7, probe(k)
        yield "/force", "std_msgs/msg/Float64", logged + 9, T["std_msgs/msg/Float64"](0.25 * k)
        if k == 3:
            yield "/talk", "std_msgs/msg/String", logged, T["std_msgs/msg/String"]("hello")


def bag(name, plugin, order=True, mode=CompressionMode.NONE):
    with tempfile.TemporaryDirectory() as folder:
        place = pathlib.Path(folder) / "bag"
        writer = Writer(place, version=9, storage_plugin=plugin)
        if mode != CompressionMode.NONE:
            writer.set_compression(mode, CompressionFormat.ZSTD)
        with writer:
            topics = {}
            for topic, kind, logged, message in messages(order):
                if topic not in topics:
                    topics[topic] = writer.add_connection(topic, kind, typestore=STORE)
                writer.write(topics[topic], logged, STORE.serialize_cdr(message, kind))
            writer.add_connection("/silent", "std_msgs/msg/Float64", typestore=STORE)
        read = expected(place)
        [file] = [p for p in place.iterdir() if p.suffix != ".yaml"]
        shutil.copy(file, OUT / name)
    return read


def expected(place):
    """What rosbags reads: bits of every number, as hexadecimal text."""
    bits = lambda v: struct.pack(">d", float(v)).hex()  # noqa: E731
    found = {}
    with Reader(place) as reader:
        for connection, _, data in reader.messages():
            message = STORE.deserialize_cdr(data, connection.msgtype)
            rows = found.setdefault(connection.topic, {})
            put = lambda name, v: rows.setdefault(name, []).append(bits(v))  # noqa: E731,B023
            if hasattr(message, "header"):
                stamp = message.header.stamp
                rows.setdefault("stamp", []).append(stamp.sec * 10**9 + stamp.nanosec)
            if connection.topic in ("/joint_states", "/gripper"):
                for i, name in enumerate(message.name):
                    for kind in ("position", "velocity", "effort"):
                        values = getattr(message, kind)
                        if len(values):
                            put(f"{name}.{kind}", values[i])
            elif connection.topic == "/probe":
                for name in ("on", "small", "large"):
                    put(name, getattr(message, name))
                for i, v in enumerate(message.single):
                    put(f"single[{i}]", v)
                for i, point in enumerate(message.points):
                    for axis in "xyz":
                        put(f"points[{i}].{axis}", getattr(point, axis))
            elif connection.topic == "/force":
                put("data", message.data)
    return found


def by_mcap(name, compression, little=True, chunked=True, changes=None):
    """With the `mcap` package: compressed chunks or none, either byte order."""
    with open(OUT / name, "wb") as file:
        writer = Mcap(file, compression=compression, use_chunking=chunked, chunk_size=4096)
        writer.start("ros2", "fixture")
        ids = {}
        for topic, kind, logged, message in messages(True):
            if topic not in ids:
                text, _ = STORE.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, "ros2msg", text.encode())
                ids[topic] = writer.register_channel(topic, "cdr", schema)
            data = bytes(STORE.serialize_cdr(message, kind, little_endian=little))
            if changes:
                data = changes(topic, logged, data)
            writer.add_message(ids[topic], logged, data, logged)
        writer.finish()


def odd():
    """Messages that are not what their channel says, a language of definitions that is not read, a flipped bit."""
    pair = "float64 x\nfloat64 y\nfloat64 t\n"
    turned = "float64 y\nfloat64 x\nfloat64 t\n"
    message = lambda *values: b"\0\1\0\0" + struct.pack(f"<{len(values)}d", *values)  # noqa: E731

    def bag(name, channels, rows, **options):
        with open(OUT / name, "wb") as file:
            writer = Mcap(file, compression=CompressionType.NONE, **options)
            writer.start("ros2", "fixture")
            ids = []
            for kind, language, text, encoding in channels:
                schema = writer.register_schema(kind, language, text.encode())
                ids.append(writer.register_channel("/pair", encoding, schema))
            for k, (channel, data) in enumerate(rows):
                writer.add_message(ids[channel], k * 10**7, data, k * 10**7)
            writer.finish()

    own = ("own/msg/Pair", "ros2msg", pair, "cdr")
    good = [(0, message(k, -k, 7.0)) for k in range(30)]
    bag("named_t.mcap", [own], good)
    bag("surplus.mcap", [own], [*good, (0, message(1.0, 2.0, 3.0, 4.0))])
    bag("two_definitions.mcap", [own, ("own/msg/Pair", "ros2msg", turned, "cdr")], [*good, (1, message(1.0, 2.0, 3.0))])
    bag("two_encodings.mcap", [own, ("own/msg/Pair", "ros2msg", pair, "json")], [*good, (1, b"{}")])
    bag("other_language.mcap", [("own/msg/Pair", "ros2idl", "module own {};", "cdr")], good)
    bag("flipped.mcap", [own], good, use_chunking=False, enable_data_crcs=True)
    bytes_of = bytearray((OUT / "flipped.mcap").read_bytes())
    at = bytes(bytes_of).index(struct.pack("<d", 9.0))
    bytes_of[at + 2] ^= 1
    (OUT / "flipped.mcap").write_bytes(bytes_of)


def main():
    OUT.mkdir(exist_ok=True, parents=True)
    global RNG
    reference = {}
    for name, plugin, mode in [
        ("plain.mcap", StoragePlugin.MCAP, CompressionMode.NONE),
        ("zstd.mcap", StoragePlugin.MCAP, CompressionMode.STORAGE),
        ("plain.db3", StoragePlugin.SQLITE3, CompressionMode.NONE),
        ("messages.db3", StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
        ("file.db3.zstd", StoragePlugin.SQLITE3, CompressionMode.FILE),
    ]:
        RNG = np.random.default_rng(28)
        read = bag(name, plugin, mode=mode)
        assert reference.setdefault("all", read) == read, name
    shutil.copy(OUT / "plain.db3", OUT / "old.db3")
    with sqlite3.connect(OUT / "old.db3") as database:
        # The form before ROS 2 Iron.
        database.execute("DROP TABLE message_definitions")
    database.close()
    for name, options in {
        "big_endian.mcap": {"compression": CompressionType.NONE, "little": False},
        "lz4.mcap": {"compression": CompressionType.LZ4},
        "loose.mcap": {"compression": CompressionType.NONE, "chunked": False},
    }.items():
        RNG = np.random.default_rng(28)
        by_mcap(name, **options)
    broken = {"count": 0}

    def short(topic, _, data):
        broken["count"] += topic == "/joint_states"
        return data[:60] if topic == "/joint_states" and broken["count"] == 5 else data

    RNG = np.random.default_rng(28)
    by_mcap("short.mcap", CompressionType.NONE, changes=short)
    whole = (OUT / "lz4.mcap").read_bytes()
    (OUT / "truncated.mcap").write_bytes(whole[: len(whole) // 2])
    with open(OUT / "empty.mcap", "wb") as file:
        writer = Mcap(file)
        writer.start("ros2", "fixture")
        writer.finish()
    odd()
    (OUT / "bags.json").write_text(json.dumps(reference["all"], indent=0) + "\n")
    print(zstandard.__version__, sorted(p.name for p in OUT.iterdir()))


if __name__ == "__main__":
    main()
