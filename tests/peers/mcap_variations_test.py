#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""MCAP files of other writers are read in every variation of the format, or with the reason why not; and `--profile ros2` writes what other
readers open: mcap_variations_test.py PROGRAM. The writers and readers are the Python packages mcap, mcap-ros2-support and rosbags."""
import itertools
import json
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

from checks import check, checked

sys.path.insert(0, str(Path(__file__).resolve().parent))
from peers import package  # noqa: E402

package("mcap", "mcap_ros2", "lz4", "zstandard", "rosbags")
from mcap.reader import make_reader  # noqa: E402
from mcap.writer import CompressionType, IndexType, Writer  # noqa: E402
from mcap_ros2.decoder import DecoderFactory  # noqa: E402
from mcap_ros2.writer import Writer as RosWriter  # noqa: E402
from rosbags.highlevel import AnyReader  # noqa: E402

HAL = sys.argv[1]
BEGIN = 1_700_000_000_000_000_000
PERIOD = 1_000_000
ROWS = 60


def hal(folder, *words):
    done = subprocess.run(
        [HAL, *words], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    return done.returncode, done.stdout


def cdr(*fields):
    return b"\0\1\0\0" + struct.pack(
        "<" + "".join(code for code, _ in fields), *(value for _, value in fields)
    )


def write_variation(path, compression, index, channels, schemas, chunking, statistics, crcs):
    """Three channels of two schemas and 60 rows each, in chunks of 500 bytes, with attachments and metadata in between."""
    with open(path, "wb") as file:
        writer = Writer(
            file,
            chunk_size=500,
            compression=compression,
            index_types=index,
            repeat_channels=channels,
            repeat_schemas=schemas,
            use_chunking=chunking,
            use_statistics=statistics,
            use_summary_offsets=statistics,
            enable_crcs=crcs,
            enable_data_crcs=crcs,
        )
        writer.start(profile="", library="variation")
        real = writer.register_schema("a/msg/Real", "ros2msg", b"float64 a\n")
        pair = writer.register_schema("a/msg/Pair", "ros2msg", b"int32 n\nbool on\n")
        text = writer.register_schema("a.Text", "jsonschema", b"{}")
        topics = [
            writer.register_channel("/real", "cdr", real),
            writer.register_channel("/pair", "cdr", pair),
            writer.register_channel("/text", "json", text),
        ]
        for row in range(ROWS):
            time = BEGIN + row * PERIOD
            writer.add_message(topics[0], time, cdr(("d", row + 0.5)), time, row)
            writer.add_message(topics[1], time, cdr(("i", -row), ("?", row % 2)), time, row)
            writer.add_message(topics[2], time, b"{}", time, row)
            if row == 20:
                writer.add_attachment(time, time, "note.txt", "text/plain", b"x" * 1000)
                writer.add_metadata("about", {"row": "20"})
        writer.finish()


def variations(folder):
    indexes = [IndexType.ALL, IndexType.NONE, IndexType.CHUNK, IndexType.MESSAGE]
    flags = [True, False]
    files = []
    for number, variation in enumerate(
        itertools.product(CompressionType, indexes, flags, flags, flags, flags, flags)
    ):
        compression, index, channels, schemas, chunking, statistics, crcs = variation
        if not chunking and (compression, index) not in (
            (CompressionType.NONE, IndexType.ALL),
            (CompressionType.NONE, IndexType.NONE),
        ):
            continue
        name = f"v{number}"
        write_variation(folder / f"{name}.mcap", *variation)
        files.append((name, variation))
    lines = ["loadrt threads name1=servo period1=1000000"]
    for name, _ in files:
        lines += [f"loadrt playback names={name} file={name}.mcap", f"addf {name}.update servo"]
    lines += ["start"]
    for cycles in (31, 29):
        lines.append(f"advance {cycles} cycles")
        lines += [f"getp {name}.{pin}" for name, _ in files for pin in ("a", "n", "on", "done")]
    (folder / "variations.hal").write_text("\n".join(lines) + "\n")
    status, out = hal(folder, "sim", "-q", "variations.hal")
    values = out.split()
    wrong = {}
    for at, (name, variation) in enumerate(files):
        middle = values[4 * at : 4 * at + 4]
        end = values[4 * (at + len(files)) : 4 * (at + len(files)) + 4]
        if middle != ["30.5", "-30", "FALSE", "FALSE"] or end != ["59.5", "-59", "TRUE", "TRUE"]:
            wrong[name] = (variation, middle, end)
    check(
        f"{len(files)} variations of the format",
        status == 0 and not wrong,
        list(wrong.items())[:3] or out[-500:],
    )
    lz4 = next(name for name, variation in files if variation[0] == CompressionType.LZ4)
    status, out = hal(folder, "plot", f"{lz4}.mcap")
    check(
        "what is not read beside what is",
        status == 0 and "topic '/text' is not read: its messages are 'json'" in out,
        out,
    )


def unreadable(folder):
    cases = {
        "json": ("json", "jsonschema", b"{}", b"{}", "its messages are 'json'"),
        "protobuf": ("protobuf", "protobuf", b"", b"", "its messages are 'protobuf'"),
        "ros1": ("ros1", "ros1msg", b"float64 a\n", b"12345678", "its messages are 'ros1'"),
        "flatbuffer": ("flatbuffer", "flatbuffer", b"", b"", "its messages are 'flatbuffer'"),
        "idl": (
            "cdr",
            "ros2idl",
            b"struct X { double a; };",
            cdr(("d", 1)),
            "its schema is 'ros2idl'",
        ),
        "omg": (
            "cdr",
            "omgidl",
            b"struct X { double a; };",
            cdr(("d", 1)),
            "its schema is 'omgidl'",
        ),
        "texts": (
            "cdr",
            "ros2msg",
            b"string a\n",
            cdr(("I", 1), ("B", 0)),
            "its schema has no number: a (string) is skipped",
        ),
        "short": (
            "cdr",
            "ros2msg",
            b"float64 a\n",
            b"\0\1\0\0",
            "is shorter than its schema, or not plain CDR",
        ),
    }
    for name, (encoding, schema_encoding, schema, payload, reason) in cases.items():
        for compression in (CompressionType.LZ4, CompressionType.NONE):
            with open(folder / f"{name}.mcap", "wb") as file:
                writer = Writer(file, compression=compression)
                writer.start()
                channel = writer.register_channel(
                    "/t", encoding, writer.register_schema("a/msg/X", schema_encoding, schema)
                )
                writer.add_message(channel, BEGIN, payload, BEGIN)
                writer.finish()
            status, out = hal(folder, "plot", f"{name}.mcap")
            check(
                f"{name} is named",
                status == 1 and f"'{name}.mcap' has no rows; " in out and reason in out,
                out,
            )
    with open(folder / "empty.mcap", "wb") as file:
        writer = Writer(file)
        writer.start()
        writer.finish()
    status, out = hal(folder, "plot", "empty.mcap")
    check(
        "a file without anything is named",
        status == 1 and "'empty.mcap' has no rows; it has no topics" in out,
        out,
    )
    with open(folder / "silent.mcap", "wb") as file:
        writer = Writer(file)
        writer.start()
        writer.register_channel(
            "/t", "cdr", writer.register_schema("a/msg/X", "ros2msg", b"float64 a\n")
        )
        writer.finish()
    status, out = hal(folder, "plot", "silent.mcap")
    check(
        "a topic without messages is named",
        status == 1 and "'silent.mcap' has no rows; none of its topics has a message" in out,
        out,
    )


IMU = """std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
string[] notes
float64[] samples
string<=5 name "a # = b"
uint8 MOST=5
uint8 state
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""


def messages_with_texts(folder):
    with open(folder / "imu.mcap", "wb") as file:
        writer = RosWriter(file, compression=CompressionType.LZ4)
        schema = writer.register_msgdef("sensor_msgs/msg/MyImu", IMU)
        for row in range(ROWS):
            message = {
                "header": {"stamp": {"sec": 5, "nanosec": row}, "frame_id": "f" * (row % 7)},
                "orientation": {"x": 1.0, "y": 2.0, "z": 3.0, "w": row + 0.25},
                "orientation_covariance": [float(i) for i in range(9)],
                "angular_velocity": {"x": 7.0, "y": -row, "z": 9.0},
                "notes": ["n" * i for i in range(row % 4)],
                "samples": [0.5] * (row % 3),
                "name": "abc",
                "state": row,
            }
            writer.write_message("/imu", schema, message, BEGIN + row * PERIOD, sequence=row)
        writer.finish()
    pins = {
        "header.stamp.sec": "5",
        "header.stamp.nanosec": "40",
        "orientation.w": "40.25",
        "orientation_covariance.8": "8",
        "angular_velocity.y": "-40",
        "state": "40",
    }
    (folder / "imu.hal").write_text(
        "loadrt threads name1=servo period1=1000000\nloadrt playback names=p file=imu.mcap\naddf p.update servo\nstart\n"
        "advance 41 cycles\n" + "".join(f"getp p.{pin}\n" for pin in pins)
    )
    status, out = hal(folder, "sim", "-q", "imu.hal")
    check(
        "numbers beside texts, arrays and messages in a message",
        status == 0 and out.split() == list(pins.values()),
        out,
    )
    status, out = hal(folder, "plot", "imu.mcap", "orientation.w")
    check(
        "and a note of what is skipped",
        status == 0
        and "topic '/imu': not read: header.frame_id (string), notes (string[]), "
        "samples (float64[]), name (string<=5)" in out,
        out,
    )


NETLIST = """loadrt threads name1=servo-thread period1=1000000 name2=servo_thread period2=10000000
loadrt siggen names=wave
loadrt sum2 names=late
loadrt two_mass names=axis
setp wave.frequency 2
setp axis.torque 0.1
setp late.in0 3
addf wave.update servo-thread
addf axis.update servo-thread
addf late servo_thread
net sine wave.sine
net slow-sum late.out
"""


def profile(folder):
    (folder / "a.hal").write_text(NETLIST)
    status, out = hal(
        folder,
        "sim",
        "-q",
        "a.hal",
        "--for",
        "2s",
        "--record",
        "ros.mcap",
        "--profile",
        "ros2",
        "--values",
        "sine,slow-sum,axis.*",
    )
    check("recorded", status == 0, out)
    with open(folder / "ros.mcap", "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        check("the profile", reader.get_header().profile == "ros2", reader.get_header())
        summary = reader.get_summary()
        topics = {channel.topic: channel for channel in summary.channels.values()}
        check(
            "ROS 2 messages only",
            {channel.message_encoding for channel in topics.values()} == {"cdr"},
            topics,
        )
        check(
            "names that ROS allows",
            set(topics)
            == {
                "/hal/events",
                "/hal/servo_thread",
                "/hal/servo_thread/joints",
                "/hal/servo_thread_2",
            },
            topics,
        )
        rows = [
            decoded
            for _, _, _, decoded in reader.iter_decoded_messages(topics=["/hal/servo_thread"])
        ]
        check(
            "mcap-ros2-support decodes it",
            len(rows) == 2000 and max(row.sine for row in rows) > 0.99,
            len(rows),
        )
    with AnyReader([folder / "ros.mcap"]) as bag:
        counts = {connection.topic: connection.msgcount for connection in bag.connections}
        check(
            "rosbags opens it",
            counts.get("/hal/servo_thread") == 2000 and counts.get("/hal/servo_thread_2") == 200,
            counts,
        )
        wanted = [
            connection for connection in bag.connections if connection.topic == "/hal/servo_thread"
        ]
        sines = [
            bag.deserialize(data, connection.msgtype).sine
            for connection, _, data in bag.messages(wanted)
        ]
        check("with the same values", sines == [row.sine for row in rows], sines[:3])
        wanted = [
            connection for connection in bag.connections if connection.topic.endswith("/joints")
        ]
        joints = [
            bag.deserialize(data, connection.msgtype)
            for connection, _, data in bag.messages(wanted)
        ]
        check(
            "and joints",
            len(joints) == 100 and joints[0].name == ["axis.load", "axis.motor", "axis"],
            joints[:1],
        )
    (folder / "b.hal").write_text(
        NETLIST.replace("loadrt siggen names=wave\n", "")
        .replace("setp wave.frequency 2\n", "")
        .replace("addf wave.update servo-thread\n", "")
        .replace("net sine wave.sine\n", "net sine => late.in1\n")
    )
    status, out = hal(folder, "replay", "ros.mcap", "b.hal", "--names", "sine,axis.*")
    check(
        "and hal replay, on the thread with its dash",
        status == 0 and "not read" not in out and "axis.twist           equal in 2000 rows" in out,
        out,
    )
    (folder / "fault.hal").write_text(
        "loadrt threads name1=servo period1=1000000\nloadrt siggen names=wave\naddf wave.update servo\n"
    )
    status, out = hal(
        folder, "sim", "-q", "a.hal", "--for", "1s", "--record", "a.csv", "--profile", "ros2"
    )
    check(
        "not of a table",
        status == 1 and "--profile is for a recording that ends in .mcap" in out,
        out,
    )
    status, out = hal(
        folder, "sim", "-q", "a.hal", "--for", "1s", "--record", "a.mcap", "--profile", "ros1"
    )
    check(
        "not of an unknown name",
        status == 1 and "unknown --profile 'ros1'; supported: ros2" in out,
        out,
    )


def live(folder):
    """hal record of a running machine, with an event."""
    (folder / "live.hal").write_text(
        "loadrt threads name1=servo period1=1000000\nloadrt siggen names=wave\naddf wave.update servo\nnet sine wave.sine\nstart\n"
    )
    machine = subprocess.Popen(
        [HAL, "run", "live.hal", "--name", "ros-profile"],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    try:
        for _ in range(100):
            if (
                hal(folder, "shell", "--name", "ros-profile", "--wait", "1s", "show", "thread")[0]
                == 0
            ):
                break
        recorder = subprocess.Popen(
            [
                HAL,
                "record",
                "-N",
                "ros-profile",
                "live.mcap",
                "sine",
                "--profile",
                "ros2",
                "--for",
                "1s",
            ],
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        for number in range(20):
            hal(folder, "shell", "--name", "ros-profile", "setp", "wave.amplitude", str(1 + number))
            if recorder.poll() is not None:
                break
        out = recorder.communicate()[0]
    finally:
        machine.terminate()
        machine.wait()
    check("hal record", recorder.returncode == 0, out)
    with AnyReader([folder / "live.mcap"]) as bag:
        wanted = [connection for connection in bag.connections if connection.topic == "/hal/events"]
        events = [
            bag.deserialize(data, connection.msgtype)
            for connection, _, data in bag.messages(wanted)
        ]
        check(
            "events are messages of the log",
            any(
                "wave.amplitude" in event.msg and event.level == 20 and event.stamp.sec > 0
                for event in events
            ),
            json.dumps([(event.name, event.msg) for event in events]),
        )
        check(
            "and values",
            sum(
                connection.msgcount
                for connection in bag.connections
                if connection.topic == "/hal/servo"
            )
            >= 900,
        )
    status, out = hal(folder, "plot", "live.mcap", "-o", "-")
    check("hal plot draws the events", status == 0 and "wave.amplitude" in out, out[:300])


with tempfile.TemporaryDirectory() as temporary:
    place = Path(temporary)
    variations(place)
    unreadable(place)
    messages_with_texts(place)
    profile(place)
    live(place)
sys.exit(checked())
