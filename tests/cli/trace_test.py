# SPDX-License-Identifier: MIT
"""hal trace: the file is decoded by protoc, which knows nothing of the program, and its timeline is checked."""
import shutil
import signal
import subprocess
import threading
import time
import unittest

from harness import HAL, TIMEOUT, Case, wait_until

MACHINE = """loadrt threads name1=fast period1=1000000 name2=servo period2=5000000
loadrt sum2 names=adder,second
loadrt and2 names=gate
addf gate fast
addf adder servo
addf second servo
net total adder.out => second.in0
start
"""


def decoded(path):
    """The fields of a protobuf file as nested dictionaries: number -> list of values."""
    text = subprocess.run(
        ["protoc", "--decode_raw"], input=path.read_bytes(), stdout=subprocess.PIPE, check=True
    ).stdout.decode()
    root = {}
    stack = [root]
    for line in text.splitlines():
        line = line.strip()
        if line == "}":
            stack.pop()
        elif line.endswith(" {"):
            stack[-1].setdefault(int(line[:-2]), []).append({})
            stack.append(stack[-1][int(line[:-2])][-1])
        else:
            number, value = line.split(": ", 1)
            stack[-1].setdefault(int(number), []).append(
                value.strip('"') if value.startswith('"') else int(value, 0)
            )
    return root


def only(message, *path):
    for field in path:
        message = message[field][0]
    return message


class Timeline:
    """Replays the packets as a viewer does: names by their interned numbers, slices by their tracks."""

    def __init__(self, path):
        self.names, self.tracks, self.slices, self.instants, self.counters, self.switches = (
            {},
            {},
            [],
            [],
            [],
            0,
        )
        open_slices, cleared = {}, False
        for packet in decoded(path)[1]:
            flags = packet.get(13, [0])[0]
            if 59 in packet:
                assert flags & 1 and only(packet, 59, 58) == 3, "times are CLOCK_MONOTONIC"
                cleared = True
            if 60 in packet:
                described = only(packet, 60)
                thread = described.get(4, [{}])[0]
                self.tracks[described[1][0]] = thread.get(5, described.get(2, [""]))[0]
            if 1 in packet:
                self.switches += len(only(packet, 1).get(2, []))
            if 11 not in packet:
                continue
            assert cleared and flags & 2 and packet[10] == [1]
            for data in packet.get(12, []):
                for name in data[2]:
                    self.names[name[1][0]] = name[2][0]
            event, time = only(packet, 11), packet[8][0]
            track = event[11][0]
            assert track in self.tracks, "described before its first event"
            kind = event[9][0]
            annotations = {one[10][0]: one.get(3, one.get(6))[0] for one in event.get(4, [])}
            if kind == 1:
                open_slices.setdefault(track, []).append(
                    (self.names[event[10][0]], time, annotations)
                )
            elif kind == 2:
                name, begin, notes = open_slices[track].pop()
                assert begin <= time
                above = open_slices[track][-1] if open_slices[track] else None
                self.slices.append(
                    (self.tracks[track], name, begin, time, notes, above and above[0])
                )
            elif kind == 3:
                self.instants.append(
                    (self.tracks[track], self.names[event[10][0]], time, annotations)
                )
            else:
                self.counters.append((self.tracks[track], time, event[30][0]))
        assert not any(open_slices.values()), "every slice has an end"


@unittest.skipUnless(shutil.which("protoc"), "protobuf-compiler is not installed")
class Trace(Case):
    def setUp(self):
        super().setUp()
        stall = (
            f"loadrt stall names=slow file={self.folder}/log\nsetp slow.ms 20\naddf slow servo\n"
        )
        self.machine = self.start(
            "run", self.write("a.hal", MACHINE.replace("net total", stall + "net total"))
        )

    def trace(self, *words):
        out = self.good("trace", "t.pftrace", *words)
        return out, Timeline(self.folder / "t.pftrace")

    def test_cycles_hold_their_functions_in_order(self):
        out, timeline = self.trace("--for", "300ms")
        self.assertRegex(
            out,
            r"wrote t.pftrace: \d+ cycles, \d+ function calls, \d+ overruns?, 0 events lost; open it in https://ui.perfetto.dev\n",
        )
        self.assertLessEqual({"fast", "servo"}, set(timeline.tracks.values()))
        cycles = [s for s in timeline.slices if s[0] == "servo" and s[1] == "cycle"]
        self.assertGreater(len(cycles), 5)
        numbers = [s[4]["cycle"] for s in cycles]
        self.assertEqual(sorted(set(numbers)), numbers)
        inner = [s for s in timeline.slices if s[0] == "servo" and s[5] == "cycle"]
        self.assertEqual({"adder", "second", "slow"}, {s[1] for s in inner})
        for cycle in cycles:
            within = [s for s in inner if cycle[2] <= s[2] and s[3] <= cycle[3]]
            self.assertEqual(
                ["adder", "second", "slow"],
                [s[1] for s in within],
                "in the order of the thread, each once in a cycle",
            )
            self.assertLessEqual(within[0][3], within[1][2])
        fast = sum(s[1] == "cycle" and s[0] == "fast" for s in timeline.slices)
        self.assertGreater(fast, 3 * len(cycles))
        self.assertLessEqual(
            {"servo wake-up latency", "servo execution time"}, {c[0] for c in timeline.counters}
        )

    def test_an_edit_is_a_slice_and_an_entry(self):
        editing = threading.Timer(0.2, lambda: self.shell("net", "late", "gate.out"))
        editing.start()
        _, timeline = self.trace("--for", "800ms")
        editing.join()
        self.assertTrue(any(s[1] == "take new plan" for s in timeline.slices))
        self.assertTrue(
            any(
                name == "edit" and "net late gate.out" in notes["text"]
                for _, name, _, notes in timeline.instants
            ),
            timeline.instants,
        )

    def test_the_ring_is_written_after_an_overrun(self):
        tracer = subprocess.Popen(
            ["hal", "trace", "t.pftrace", "--on-overrun", "--keep", "1s"],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, tracer)
        time.sleep(0.3)  # of what is kept before it
        mode = 3
        while (
            tracer.poll() is None
        ):  # a busy host may have been late before: each time is a new overrun
            self.shell("setp", "slow.mode", str(mode))
            mode = 7 - mode
            time.sleep(0.4)
        out, error = tracer.communicate()
        self.assertEqual(("", 0), (error, tracer.returncode))
        self.assertRegex(
            out, r"(?m)^cycle \d+ of '\w+' ended \S+ m?s after it was due \(period \S+ ms\)$"
        )
        timeline = Timeline(self.folder / "t.pftrace")
        late = [notes for track, name, _, notes in timeline.instants if name == "overrun"]
        self.assertTrue(late)
        self.assertTrue(
            any(s[1] == "cycle" and s[4]["cycle"] == late[0]["cycle"] for s in timeline.slices)
        )
        self.assertGreater(
            sum(s[1] == "cycle" for s in timeline.slices), 20, "what was before it is in the file"
        )

    def test_the_summary_names_the_function_that_made_a_cycle_late(self):
        timer = threading.Timer(0.3, lambda: self.shell("setp", "slow.mode", "3"))
        timer.start()
        out, timeline = self.trace("--for", "1s")
        timer.join()
        self.assertRegex(
            out,
            r"latest end: cycle \d+ of 'servo', \S+ ms after it was due: wake-up latency \S+ \w+, execution \S+ ms, of it 20.\d ms in slow\n",
        )
        longest = max((s for s in timeline.slices if s[1] == "slow"), key=lambda s: s[3] - s[2])
        self.assertGreaterEqual(longest[3] - longest[2], 20_000_000)
        self.assertTrue(
            any(
                name == "missed periods" and notes["periods"] >= 3
                for _, name, _, notes in timeline.instants
            )
        )

    def test_without_an_overrun_or_fault_nothing_is_written(self):
        self.assertRegex(
            self.good("trace", "none.pftrace", "--on-fault", "--for", "200ms"),
            r"^no fault in \d+ cycles; nothing was written\n$",
        )
        self.assertFalse((self.folder / "none.pftrace").exists())

    def test_one_client_at_a_time_and_again_afterwards(self):
        self.trace("--for", "100ms")
        _, timeline = self.trace("--for", "100ms")
        self.assertTrue(any(s[1] == "adder" for s in timeline.slices), "functions are named again")

    def test_errors(self):
        self.assertEqual(
            "hal trace: --keep needs --on-overrun or --on-fault\n",
            self.bad("trace", "a.pftrace", "--keep", "1s"),
        )
        self.assertEqual(
            "hal trace: --after needs --on-overrun or --on-fault\n",
            self.bad("trace", "a.pftrace", "--after", "1s"),
        )
        self.assertRegex(
            self.bad("trace", "/nowhere/a.pftrace"),
            r"^hal trace: cannot write '/nowhere/a.pftrace': No such file or directory\n$",
        )
        self.assertEqual(
            "hal trace: unexpected argument 'b'; type: hal trace a\n", self.bad("trace", "a", "b")
        )

    def test_what_cannot_be_written_is_known_at_the_start(self):
        self.start("run", self.write("m.hal", MACHINE))
        self.assertEqual(
            "hal trace: cannot write '/nowhere/t.pftrace': No such file or directory\n",
            self.bad("trace", "/nowhere/t.pftrace", "--on-fault"),
        )
        self.assertEqual(
            "hal trace: --for 0 traces nothing; use a time like 10s\n",
            self.bad("trace", "t.pftrace", "--for", "0s"),
        )
        self.assertEqual(
            "hal trace: cannot write '/dev/full': No space left on device; the file is empty\n",
            self.bad("trace", "/dev/full", "--for", "10s"),
        )

    def test_a_ring_that_kept_nothing_leaves_no_file_and_replaces_none(self):
        self.start("run", self.write("m.hal", MACHINE))
        self.write("old.pftrace", "kept")
        for name in ("new.pftrace", "old.pftrace"):
            self.assertIn(
                "nothing was written", self.good("trace", name, "--on-fault", "--for", "100ms")
            )
        self.assertFalse((self.folder / "new.pftrace").exists())
        self.assertEqual("kept", (self.folder / "old.pftrace").read_text())

    def end_of_trace(self, number):
        """What the command prints, and its exit status, when its machine ends by that signal."""
        tracer = subprocess.Popen(
            [HAL, "trace", "end.pftrace"],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        wait_until(
            lambda: (self.folder / "end.pftrace").exists()
            and (self.folder / "end.pftrace").stat().st_size > 1000,
            "it traces",
        )
        self.machine.send_signal(number)
        return tracer.communicate(timeout=TIMEOUT)[1], tracer.returncode

    def test_a_machine_that_ends_in_order_ends_the_trace(self):
        self.assertEqual(("", 0), self.end_of_trace(signal.SIGTERM))

    def test_a_machine_that_is_killed_is_reported(self):
        self.assertEqual(
            ("hal trace: instance 'default' was killed\n", 1), self.end_of_trace(signal.SIGKILL)
        )


if __name__ == "__main__":
    unittest.main()
