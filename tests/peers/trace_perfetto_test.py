#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen
"""The Python package perfetto, with the public schema of Perfetto, parses what `hal trace` writes: no unknown field, and a replay of the timeline as
a viewer does it: trace_perfetto_test.py PROGRAM."""

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from checks import check, checked, wait_for

sys.path.insert(0, str(Path(__file__).resolve().parent))
from peers import package  # noqa: E402

package("perfetto", "google.protobuf")
from google.protobuf.unknown_fields import UnknownFieldSet  # noqa: E402
from perfetto.protos.perfetto.trace.perfetto_trace_pb2 import Trace, TrackEvent  # noqa: E402

MACHINE = """loadrt threads name1=fast period1=1000000 name2=servo period2=5000000
loadrt sum2 names=adder
loadrt and2 names=gate
loadrt canopen config=a.canopen
loadrt canopen_io names=io link=sim:trace id=3
addf canopen.0.receive fast
addf gate fast
addf canopen.0.transmit fast
addf io.update fast
addf adder servo
start
"""
CANOPEN = """[bus]
link = sim:trace
bitrate = 500000
sync = 2000 us

[node 3 io]
device = cia401
"""
CLEARED, NEEDED = 1, 2  # TracePacket.SequenceFlags
MONOTONIC = 3


def unknown(message):
    """The number of fields that the schema does not know, in all depths."""
    count = len(UnknownFieldSet(message))
    for field, value in message.ListFields():
        if field.message_type:
            count += sum(map(unknown, value if field.is_repeated else [value]))
    return count


class Replay:
    """What a viewer makes of the packets of one sequence."""

    def __init__(self, trace):
        self.problems, self.tracks, self.slices, self.instants, self.counters = [], {}, [], [], []
        self.processes, self.threads, self.clocks = set(), {}, {}
        names, open_slices, cleared = {}, {}, False
        for packet in trace.packet:
            if packet.HasField("clock_snapshot"):
                self.clocks = {
                    clock.clock_id: clock.timestamp for clock in packet.clock_snapshot.clocks
                }
            if packet.sequence_flags & CLEARED:
                cleared, names = packet.trace_packet_defaults.timestamp_clock_id == MONOTONIC, {}
            if packet.HasField("track_descriptor"):
                described = packet.track_descriptor
                self.tracks[described.uuid] = (
                    described.thread.thread_name or described.name or described.process.process_name
                )
                if described.HasField("process"):
                    self.processes.add(described.process.pid)
                if described.HasField("thread"):
                    self.threads[described.thread.thread_name] = (
                        described.thread.pid,
                        described.thread.tid,
                    )
                if described.parent_uuid and described.parent_uuid not in self.tracks:
                    self.problems.append(f"{described.uuid} has an unknown parent")
            if not packet.HasField("track_event"):
                continue
            if (
                not cleared
                or not packet.sequence_flags & NEEDED
                or not packet.trusted_packet_sequence_id
            ):
                self.problems.append("an event outside of a sequence")
            names.update((name.iid, name.name) for name in packet.interned_data.event_names)
            event = packet.track_event
            if event.track_uuid not in self.tracks:
                self.problems.append(f"an event on the unknown track {event.track_uuid}")
            track, name = self.tracks.get(event.track_uuid), names.get(event.name_iid)
            notes = {
                one.name: one.uint_value or one.string_value for one in event.debug_annotations
            }
            if event.type in (TrackEvent.TYPE_SLICE_BEGIN, TrackEvent.TYPE_INSTANT) and not name:
                self.problems.append("an event without a name")
            if event.type == TrackEvent.TYPE_SLICE_BEGIN:
                open_slices.setdefault(track, []).append((name, packet.timestamp, notes))
            elif event.type == TrackEvent.TYPE_SLICE_END:
                name, begin, notes = open_slices[track].pop()
                outer = open_slices[track][-1][1] if open_slices[track] else 0
                if not outer <= begin <= packet.timestamp:
                    self.problems.append(f"{name} begins at {begin} and ends at {packet.timestamp}")
                self.slices.append(
                    (track, name, begin, packet.timestamp, notes, len(open_slices[track]))
                )
            elif event.type == TrackEvent.TYPE_INSTANT:
                self.instants.append((track, name, packet.timestamp, notes))
            elif event.type == TrackEvent.TYPE_COUNTER:
                self.counters.append((track, packet.timestamp, event.counter_value))
        self.problems += [
            f"{track}: {left} does not end" for track, left in open_slices.items() if left
        ]


with tempfile.TemporaryDirectory() as folder:
    environment = dict(os.environ, XDG_RUNTIME_DIR=folder, HOME=folder)

    def hal(*words):
        return subprocess.run(
            [sys.argv[1], *words],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def value(pin):
        return hal("shell", "getp", pin).stdout.strip()

    def wait_for_cycles(count):
        end = int(value("fast.threadbeat")) + count
        wait_for(lambda: int(value("fast.threadbeat")) > end)

    Path(folder, "a.hal").write_text(MACHINE)
    Path(folder, "a.canopen").write_text(CANOPEN)
    machine = subprocess.Popen(
        [sys.argv[1], "run", "a.hal"],
        cwd=folder,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        wait_for(lambda: value("canopen.0.io.operational") == "TRUE")
        tracer = subprocess.Popen(
            [sys.argv[1], "trace", "t.pftrace"],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            text=True,
        )
        wait_for(lambda: Path(folder, "t.pftrace").exists())
        wait_for_cycles(100)
        hal("shell", "net", "late", "gate.out")
        wait_for_cycles(400)
        tracer.send_signal(signal.SIGINT)
        out = tracer.communicate()[0]
        check("the trace is written", tracer.returncode == 0, out)
    finally:
        machine.terminate()
        machine.wait()
    data = Path(folder, "t.pftrace").read_bytes()

trace = Trace()
trace.ParseFromString(data)
check("the schema knows every field", unknown(trace) == 0, unknown(trace))
replay = Replay(trace)
check(
    "slices nest, tracks and names are described before their use",
    not replay.problems,
    replay.problems[:5],
)
check(
    "clocks of the machine, of the day and since the boot",
    set(replay.clocks) >= {1, 3, 6},
    replay.clocks,
)
check("one process", replay.processes == {machine.pid}, replay.processes)
check(
    "a track for each thread, with the number of the system's thread",
    set(replay.threads) == {"fast", "servo"}
    and all(pid == machine.pid and tid > 0 for pid, tid in replay.threads.values()),
    replay.threads,
)
cycles = [one for one in replay.slices if one[:2] == ("fast", "cycle")]
numbers = [one[4]["cycle"] for one in cycles]
check(
    "each cycle once, in order", len(cycles) > 100 and numbers == sorted(set(numbers)), numbers[:20]
)
inner = {one[1] for one in replay.slices if one[0] == "fast" and one[5] == 1}
check(
    "the functions of the thread within its cycles",
    {"canopen.0.receive", "gate", "canopen.0.transmit", "io.update"} <= inner,
    inner,
)
check(
    "the edit",
    any(one[1] == "take new plan" for one in replay.slices)
    and any(
        name == "edit" and notes["text"] == "net late gate.out"
        for _, name, _, notes in replay.instants
    ),
    replay.instants[-3:],
)
frames = [one for one in replay.instants if " CAN " in one[1]]
transmit = [one for one in replay.slices if one[1] == "canopen.0.transmit"]
syncs = [
    one
    for one in frames
    if one[1] == "send CAN 080h"
    and any(begin <= one[2] <= end for _, _, begin, end, _, _ in transmit)
]
check(
    "the SYNC frames within the function that sends them",
    len(syncs) > 100,
    (len(syncs), {one[1] for one in frames}),
)
check(
    "the device receives them",
    sum(one[1] == "receive CAN 080h" for one in frames) > 100,
    len(frames),
)
check(
    "counters of latency and execution",
    {"fast wake-up latency", "fast execution time"} <= {one[0] for one in replay.counters},
)
sys.exit(checked())
