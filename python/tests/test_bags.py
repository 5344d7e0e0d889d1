"""Bags and HDF5 files that rosbags and h5py write with random content, read by the program and by the package: the numbers are the same to
the bit."""

from __future__ import annotations

import logging
import subprocess

import flexure
import h5py
import numpy as np
import pandas as pd
import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

MIX = """int16 before
string note
std_msgs/Header header
float64[] values
bool flag
geometry_msgs/Wrench wrench
uint32 after
"""


@pytest.fixture(scope="module", params=[Stores.ROS2_FOXY, Stores.ROS2_HUMBLE, Stores.ROS2_JAZZY], ids=lambda s: s.value)
def store(request):
    found = get_typestore(request.param)
    found.register(get_types_from_msg(MIX, "own_msgs/msg/Mix"))
    return found


def header(store, ns, text):
    types = store.types
    return types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](ns // 10**9, ns % 10**9), text)


def messages(store, rng, count):
    """Joint states whose joints change their order, and a mixed message: what is written, and the columns expected."""
    types = store.types
    names = ["base", "elbow_joint", "wärist"]
    expected = {"/joints": {}, "/mix": {}}
    written = []
    put = lambda topic, name, value: expected[topic].setdefault(name, []).append(float(value))  # noqa: E731
    for k in range(count):
        ns = 1_650_000_000 * 10**9 + 10_000_000 * k
        order = rng.permutation(3)
        columns = rng.normal(size=(3, 3)) * 10.0 ** rng.integers(-300, 300, (3, 3))
        for joint, i in enumerate(order):
            for row, kind in enumerate(["position", "velocity", "effort"]):
                put("/joints", f"{names[i]}.{kind}", columns[row, joint])
        state = types["sensor_msgs/msg/JointState"](header(store, ns, "f" * rng.integers(9)), [names[i] for i in order], *columns)
        written.append(("/joints", "sensor_msgs/msg/JointState", ns, state))
        vector = types["geometry_msgs/msg/Vector3"]
        force, torque = rng.normal(size=3), rng.normal(size=3)
        wrench = types["geometry_msgs/msg/Wrench"](vector(*force), vector(*torque))
        values, before, after = rng.normal(size=4), int(rng.integers(-9, 9)), int(rng.integers(2**32))
        mix = types["own_msgs/msg/Mix"](before, "n" * rng.integers(7), header(store, ns, "x"), values, bool(k % 2), wrench, after)
        written.append(("/mix", "own_msgs/msg/Mix", ns, mix))
        for name, value in [("before", before), ("flag", k % 2), ("after", after), *((f"values[{i}]", v) for i, v in enumerate(values))]:
            put("/mix", name, value)
        for part, three in [("force", force), ("torque", torque)]:
            for axis, value in zip("xyz", three):
                put("/mix", f"wrench.{part}.{axis}", value)
    return written, expected


def read(command, path, tmp_path, *options):
    """The record as the program reads it."""
    table = tmp_path / "read.parquet"
    command("prepare", path, *options, "-o", table)
    return pd.read_parquet(table)


@pytest.fixture
def command():
    import os

    def run(*arguments):
        program = os.environ.get("FLEXURE_BINARY", "flexure")
        done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

    return run


def same(found, expected):
    for name, values in expected.items():
        np.testing.assert_array_equal(np.asarray(found[name]).view(np.uint64), np.array(values).view(np.uint64), err_msg=name)


@pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
@pytest.mark.parametrize("mode", [None, CompressionMode.FILE, CompressionMode.MESSAGE, CompressionMode.STORAGE])
def test_bags_of_rosbags(store, plugin, mode, tmp_path, command):
    if (plugin, mode) in [(StoragePlugin.SQLITE3, CompressionMode.STORAGE), (StoragePlugin.MCAP, CompressionMode.MESSAGE)]:
        pytest.skip("rosbags does not write this")
    written, expected = messages(store, np.random.default_rng(3), 60)
    folder = tmp_path / "bag"
    writer = Writer(folder, version=9, storage_plugin=plugin)
    if mode:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        topics = {}
        for topic, kind, ns, message in written:
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(topics[topic], ns, store.serialize_cdr(message, kind))
    [bag] = [path for path in folder.iterdir() if path.suffix != ".yaml"]
    for topic, columns in expected.items():
        same(read(command, bag, tmp_path, "--topic", topic), columns)
        same(flexure.read(bag, topic=topic), columns)
    one = read(command, bag, tmp_path, "--joint", "elbow_joint")
    same(one, {kind: expected["/joints"][f"elbow_joint.{kind}"] for kind in ("position", "velocity", "effort")})


@pytest.mark.parametrize("libver", ["earliest", "v108", "v110", "latest"])
@pytest.mark.parametrize("packing", [{}, {"compression": "gzip", "chunks": (7,)}, {"shuffle": True, "fletcher32": True, "chunks": (50,)}], ids=str)
def test_hdf5_of_h5py(libver, packing, tmp_path, command):
    rng = np.random.default_rng(4)
    columns = {f"c{i}": rng.normal(size=50).astype(kind) for i, kind in enumerate(["<f8", ">f8", "<f4", ">f4"])}
    columns |= {f"i{i}": rng.integers(0, 100, 50).astype(kind) for i, kind in enumerate(["<i8", ">i4", "u2", "i1"])}
    path = tmp_path / "h.h5"
    with h5py.File(path, "w", libver=libver) as file:
        for name, values in columns.items():
            file.create_dataset(name, data=values, **packing)
    expected = {name: values.astype(float) for name, values in columns.items()}
    same(read(command, path, tmp_path), expected)
    same(flexure.read(path), expected)


def written(folder, topics):
    """A bag of a joint's log as `docs/examples/systems.py` makes it."""
    from test_documents import docs_systems

    systems = docs_systems()
    log = systems.joint_log(duration=30.0)
    systems.write_bag(folder / "log.mcap", dict.fromkeys(topics, log))
    return folder / "log.mcap", log


def test_a_joint_of_a_bag_is_identified(tmp_path, caplog):
    bag, log = written(tmp_path, ["elbow", "wrist"])
    with caplog.at_level(logging.INFO, logger="flexure.records"):
        found = flexure.read(bag, joint="elbow")
    assert [record.getMessage() for record in caplog.records] == [f"{bag}: topic /joint_states is read"]
    assert list(found) == ["t", "position", "velocity", "effort"]
    np.testing.assert_array_equal(found["effort"], log["tau"])
    joint = flexure.identify_joint("effort", position="position", data=found)
    assert abs(joint.inertia.value - 0.8) < 0.02


def test_what_is_unclear_or_wrong_is_said_in_the_words_of_python(tmp_path):
    bag, _ = written(tmp_path, ["elbow"])
    with pytest.raises(flexure.FileError, match=r"choose a topic by topic=; the topics are: /battery .*, joints elbow\)"):
        flexure.read(bag)
    with pytest.raises(flexure.FileError, match="has no joint 'knee'"):
        flexure.read(bag, topic="/joint_states", joint="knee")
    with pytest.raises(flexure.FileError, match="nowhere.mcap"):
        flexure.read(tmp_path / "nowhere.mcap")
    bag.write_bytes(bag.read_bytes()[:-1000])
    with pytest.raises(flexure.FileError, match="truncated.* after a message of topic /"):
        flexure.read(bag, topic="/battery")


def test_a_group_of_hdf5_and_a_text_are_read(tmp_path):
    with h5py.File(tmp_path / "h.h5", "w") as file:
        file["axis/q"], file["other/x"] = np.arange(5.0), np.arange(7.0)
    with pytest.raises(flexure.FileError, match="choose a group by topic="):
        flexure.read(tmp_path / "h.h5")
    assert list(flexure.read(tmp_path / "h.h5", topic="axis")["q"]) == [0, 1, 2, 3, 4]
    (tmp_path / "r.csv").write_text("u;y\n1,250;2,125\n1,500;2,250\n")
    with pytest.raises(flexure.FileError, match="say decimal='comma' \\(1,250 is 1.25\\) or decimal='point'"):
        flexure.read(tmp_path / "r.csv")
    found = flexure.read(tmp_path / "r.csv", decimal="comma")
    assert {name: list(values) for name, values in found.items()} == {"u": [1.25, 1.5], "y": [2.125, 2.25]}
    with pytest.raises(flexure.ParameterError, match="must be one of point, comma"):
        flexure.read(tmp_path / "r.csv", decimal="dot")
