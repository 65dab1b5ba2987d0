# SPDX-License-Identifier: MIT
# packages: canopen
"""hal can and hal canopen: a bus by hand, between processes over udp: on this machine, and from captures."""
import json
import os
import pty
import random
import re
import select
import subprocess
import threading
import time
import unittest

from harness import HAL, TIMEOUT, Case

CAPTURE = """(1000.000000) can0 000#0102
(1000.001000) can0 080#
(1000.002000) can0 182#1122334455667788
(1000.003000) can0 602#4018100100000000
(1000.004000) can0 582#4318100192010200
(1000.005000) can0 582#8018100511000906
(1000.006000) can0 702#05
(1000.007000) can0 082#3081110000000000
(1000.008000) can0 7E5#0401000000000000
(1000.009000) can0 18FF0001#00
(1000.010000) can0 100#0000000064320000
(1000.011000) can0 100#000000006432
(1000.012000) can0 123##1AABB
(1000.013000) can0 701#R
(1000.014000) can0 702#00
(1000.015000) can0 602#C612100020000000
(1000.016000) can0 582#A4121000027F0000
(1000.017000) can0 602#0101020304050607
(1000.018000) can0 602#8208090A0B0C0D0E
(1000.019000) can0 582#A202020000000000
"""

DUMPED = """    0.000000  rx       000  [2] 01 02                    NMT start: node 2
    0.001000  rx       080  [0]                          SYNC
    0.002000  rx       182  [8] 11 22 33 44 55 66 77 88  TPDO1 of node 2
    0.003000  rx       602  [8] 40 18 10 01 00 00 00 00  SDO to node 2: read 1018:1
    0.004000  rx       582  [8] 43 18 10 01 92 01 02 00  SDO from node 2: read 1018:1 = 0x00020192 (131474)
    0.005000  rx       582  [8] 80 18 10 05 11 00 09 06  SDO from node 2: abort 1018:5: sub-index does not exist (0x06090011)
    0.006000  rx       702  [1] 05                       heartbeat of node 2: operational
    0.007000  rx       082  [8] 30 81 11 00 00 00 00 00  EMCY of node 2: life guard or heartbeat error (0x8130), error register 0x11
    0.008000  rx       7E5  [8] 04 01 00 00 00 00 00 00  LSS master: switch all to state 0x1
    0.009000  rx  18FF0001  [1] 00
    0.010000  rx       100  [8] 00 00 00 00 64 32 00 00  TIME: wrong length; expected: 6 bytes
    0.011000  rx       100  [6] 00 00 00 00 64 32        TIME 2019-04-27 00:00:00.000
    0.012000  rx       123  [2] FD+ AA BB
    0.013000  rx       701  [0] remote request, 0 bytes  node guarding: asks node 1
    0.014000  rx       702  [1] 00                       boot-up of node 2
    0.015000  rx       602  [8] C6 12 10 00 20 00 00 00  SDO to node 2: write 1012:0 in blocks, 32 bytes
    0.016000  rx       582  [8] A4 12 10 00 02 7F 00 00  SDO from node 2: ready for 1012:0 in blocks of 2
    0.017000  rx       602  [8] 01 01 02 03 04 05 06 07  SDO to node 2: block segment 1
    0.018000  rx       602  [8] 82 08 09 0A 0B 0C 0D 0E  SDO to node 2: block segment 2, the last
    0.019000  rx       582  [8] A2 02 02 00 00 00 00 00  SDO from node 2: block received up to segment 2, next has 2
"""


class Can(Case):
    def setUp(self):
        super().setUp()
        place = random.Random(os.urandom(8))  # tests run side by side: each has its own bus
        self.bus = f"udp:239.{place.randrange(1, 255)}.{place.randrange(256)}.{place.randrange(1, 255)}%lo:{place.randrange(20000, 60000)}"

    def listener(self, *words):
        """Starts a command that listens, and waits until it does."""
        process = subprocess.Popen(
            ["hal", "can", *map(str, words)],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, process)
        self.assertIn("listening on", process.stderr.readline())
        return process

    def result(self, process):
        out, error = process.communicate(timeout=2 * TIMEOUT)
        self.assertEqual(0, process.returncode, error)
        return out, error

    def bad_can(self, *words):
        return self.bad("can", *words)


class Dump(Can):
    def test_frames_in_words(self):
        self.write("c.log", CAPTURE)
        done = self.run_program("can", "dump", "replay:c.log?bitrate=500k")
        self.assertEqual(DUMPED, done.stdout)
        self.assertRegex(
            done.stderr,
            r"listening on replay:c\.log \(capture, 500000 bit/s\); press Ctrl-C to end\n20 frames in \S+ s, bus load \S+ %, 0 errors, 0 lost\n$",
        )

    def test_json_is_a_line_each_and_statistics(self):
        self.write("c.log", CAPTURE)
        *frames, last = [
            json.loads(line)
            for line in self.run_program(
                "can", "dump", "replay:c.log", "--json"
            ).stdout.splitlines()
        ]
        self.assertEqual(20, len(frames))
        self.assertEqual(
            {
                "time": 0.006,
                "direction": "rx",
                "id": 0x702,
                "extended": False,
                "length": 1,
                "data": "05",
                "meaning": "heartbeat of node 2: operational",
            },
            frames[6],
        )
        self.assertTrue(frames[9]["extended"] and frames[12]["fd"] and frames[13]["remote"])
        self.assertEqual(
            (20, None, 0),
            tuple(last["statistics"][key] for key in ("frames", "load_percent", "lost")),
        )

    def test_error_frames_are_counted_as_errors(self):
        self.write(
            "errors.log",
            "(0.00) can0 702#00\n(0.01) can0 20000080#0000000000000000\n(0.02) can0 080#\n",
        )
        done = self.run_program("can", "dump", "replay:errors.log")
        self.assertEqual(3, done.stdout.count("\n"))
        self.assertRegex(done.stderr, r"\n2 frames in .*, 1 errors, 0 lost\n$")
        statistics = json.loads(
            self.run_program("can", "dump", "replay:errors.log", "--json").stdout.splitlines()[-1]
        )["statistics"]
        self.assertEqual((2, 1), (statistics["frames"], statistics["errors"]))

    def test_a_remote_request_in_place_of_a_data_frame_is_named(self):
        self.write("remote.log", "(0.00) can0 602#R8\n(0.01) can0 602#40\n(0.02) can0 702#0506\n")
        self.assertEqual(
            [
                "SDO to node 2: remote request; expected: a data frame",
                "SDO to node 2: wrong length; expected: 8 bytes",
                "heartbeat of node 2: wrong length; expected: 1 byte",
            ],
            [
                line.rsplit("  ", 1)[1]
                for line in self.run_program("can", "dump", "replay:remote.log").stdout.splitlines()
            ],
        )

    def test_a_line_that_may_be_cut_off_is_no_frame(self):
        self.write("cut.log", "(0.00) can0 702#00\n(0.01) can0 201#0F00D007")
        sentence = "line 2: the last line has no end of line: its frame may be cut off; remove it, or end it if it is complete"
        self.assertIn(sentence, self.bad_can("dump", "replay:cut.log"))
        self.assertIn(sentence, self.bad_can("replay", "cut.log", self.bus))

    def test_the_flags_of_fd_frames(self):
        self.write("fd.log", "".join(f"(0.0{n}) can0 123##{n}AABB\n" for n in range(4)))
        done = self.run_program("can", "dump", "replay:fd.log")
        self.assertEqual(
            ["[2] FD AA BB", "[2] FD+ AA BB", "[2] FD ESI AA BB", "[2] FD+ ESI AA BB"],
            [line[line.index("[") :] for line in done.stdout.splitlines()],
        )
        *frames, _ = [
            json.loads(line)
            for line in self.run_program(
                "can", "dump", "replay:fd.log", "--json", "--count", 2
            ).stdout.splitlines()
        ]
        self.assertEqual(
            [(True, False, False), (True, True, False)],
            [(f["fd"], f["bit_rate_switch"], f["error_state"]) for f in frames],
        )

    def test_a_file_that_is_not_a_log_is_named(self):
        self.write("screen.txt", "  can0  123   [2]  01 02\n")
        self.assertIn(
            "line 1: terminal format of candump, without times; record with: candump -L, or candump -ta",
            self.bad_can("dump", "replay:screen.txt"),
        )
        self.write(
            "timed.txt",
            "(1436509052.249713)  can0  12300001   [2]  01 02\n (1436509052.349713)  can0  12400001   [2]  remote request\n",
        )
        self.assertEqual(
            "    0.000000  rx  12300001  [2] 01 02\n    0.100000  rx  12400001  [2] remote request, 2 bytes\n",
            self.run_program("can", "dump", "replay:timed.txt").stdout,
        )

    def test_filter_count_and_end_of_capture(self):
        self.write("c.log", CAPTURE)
        self.assertEqual(
            7,
            self.run_program(
                "can", "dump", "replay:c.log", "--filter", "582", "--filter", "700/780"
            ).stdout.count("\n"),
        )
        self.assertEqual(
            1,
            self.run_program(
                "can", "dump", "replay:c.log", "--filter", "18FF0000/1FFF0000"
            ).stdout.count("\n"),
        )
        self.assertEqual(
            3, self.run_program("can", "dump", "replay:c.log", "-n", "3").stdout.count("\n")
        )

    def test_wrong_words(self):
        self.write("c.log", CAPTURE)
        self.assertEqual(
            "hal can dump: invalid filter 'xyz'; write an identifier in hex, 181, or one with a mask, 180/780\n",
            self.bad_can("dump", "replay:c.log", "--filter", "xyz"),
        )
        self.assertEqual(
            "hal can dump: 'bus' is not the address of a CAN bus; write "
            "can:can0 for an interface of this machine, sim:NAME for a bus in memory, "
            "udp:239.74.163.2:43113 for a bus in UDP datagrams, slcan:/dev/ttyACM0 for an adapter "
            "on a serial line, cane:enp3s0 for CAN in Ethernet frames, scocan:NODE for the slots "
            "of a node or replay:FILE for a recorded bus\n",
            self.bad_can("dump", "bus"),
        )
        self.assertEqual(
            "hal can dump: 'sim:arm' is a bus in memory, which other programs cannot open; while its machine runs, bridge it to one that they can: "
            "hal shell loadrt can_bridge a=sim:arm b=udp:239.74.163.2:43113, hal shell addf can-bridge.0.update THREAD, and here "
            "udp:239.74.163.2:43113\n",
            self.bad_can("dump", "sim:arm"),
        )
        self.assertIn(
            "hal can dump: 'more' is not the address of a CAN bus; ",
            self.bad_can("dump", "replay:c.log", "more"),
        )
        self.assertEqual(
            "hal can dump: invalid --time 'utc'; write relative, delta or absolute\n",
            self.bad_can("dump", "replay:c.log", "--time", "utc"),
        )
        self.assertEqual(
            "hal: unknown command 'can dmp'; did you mean 'can dump'?\n", self.bad_can("dmp")
        )
        self.assertEqual(
            "hal: unknown command 'can qqqqqqqq'; type: hal help can\n", self.bad_can("qqqqqqqq")
        )

    def test_times_relative_delta_and_absolute(self):
        self.write("c.log", CAPTURE)
        times = {
            form: [
                line.split()[0]
                for line in self.run_program(
                    "can", "dump", "replay:c.log", "-n", "3", "--time", form
                ).stdout.splitlines()
            ]
            for form in ("relative", "delta", "absolute")
        }
        self.assertEqual(
            {
                "relative": ["0.000000", "0.001000", "0.002000"],
                "delta": ["0.000000", "0.001000", "0.001000"],
                "absolute": ["1000.000000", "1000.001000", "1000.002000"],
            },
            times,
        )
        filtered = self.run_program(
            "can", "dump", "replay:c.log", "--filter", "702", "--time", "absolute"
        ).stdout.splitlines()
        self.assertEqual(["1000.006000", "1000.014000"], [line.split()[0] for line in filtered])
        frames = [
            json.loads(line)
            for line in self.run_program(
                "can", "dump", "replay:c.log", "--json", "--time", "absolute"
            ).stdout.splitlines()
        ]
        self.assertEqual(1000.006, frames[6]["time"])

    def test_absolute_time_of_a_live_bus_is_the_time_of_day(self):
        before = time.time()
        dump = self.listener("dump", self.bus, "-n", 1, "--time", "absolute")
        self.good("can", "send", self.bus, "123#00")
        self.assertTrue(before <= float(self.result(dump)[0].split()[0]) <= time.time())

    def test_several_buses_in_one_dump(self):
        other = self.bus[:-1] + str((int(self.bus[-1]) + 1) % 10)
        dump = self.listener("dump", self.bus, other, "-n", 4, "--json")
        for bus, frame in (
            (self.bus, "101#01"),
            (other, "102#02"),
            (self.bus, "103#03"),
            (other, "104#04"),
        ):
            self.good("can", "send", bus, frame)
        *frames, first, second = [json.loads(line) for line in self.result(dump)[0].splitlines()]
        here, there = self.bus[len("udp:") :], other[len("udp:") :]
        self.assertEqual(
            [(here, 0x101), (there, 0x102), (here, 0x103), (there, 0x104)],
            [(f["bus"], f["id"]) for f in frames],
        )
        self.assertEqual(
            [(here, 2), (there, 2)],
            [(s["statistics"]["bus"], s["statistics"]["frames"]) for s in (first, second)],
        )

    def test_several_captures_with_a_column_of_their_names(self):
        self.write("c.log", CAPTURE)
        self.write("second.log", CAPTURE)
        done = self.run_program("can", "dump", "replay:c.log", "replay:second.log?bitrate=500k")
        rows = [line.split()[1] for line in done.stdout.splitlines()]
        self.assertEqual((20, 20), (rows.count("c.log"), rows.count("second.log")))
        self.assertIn(
            "listening on replay:c.log (capture), replay:second.log (capture, 500000 bit/s); press Ctrl-C to end\n",
            done.stderr,
        )
        self.assertRegex(done.stderr, r"\nc\.log: 20 frames in .*\nsecond\.log: 20 frames in ")


class Send(Can):
    def test_frames_arrive_as_they_are_written(self):
        dump = self.listener("dump", self.bus, "-n", 5, "--json")
        self.good(
            "can",
            "send",
            self.bus,
            "123#1122AABB",
            "18FF0001#",
            "321#R4",
            "5A1#11.22.33",
            "123##1" + "0A" * 12,
        )
        *frames, _ = [json.loads(line) for line in self.result(dump)[0].splitlines()]
        self.assertEqual(
            [
                (0x123, "1122AABB"),
                (0x18FF0001, ""),
                (0x321, ""),
                (0x5A1, "112233"),
                (0x123, "0A" * 12),
            ],
            [(f["id"], f["data"]) for f in frames],
        )
        self.assertTrue(frames[2]["remote"] and frames[2]["length"] == 4 and frames[4]["fd"])

    def test_again_and_again(self):
        dump = self.listener("dump", self.bus, "-n", 10)
        done = self.run_program(
            "can", "send", self.bus, "080#", "181#00", "--every", "5ms", "--count", "5"
        )
        self.assertEqual(0, done.returncode)
        self.assertRegex(done.stderr, r"^10 frames in \S+ s\n$")
        self.assertEqual(
            ["080", "181"] * 5, [line.split()[2] for line in self.result(dump)[0].splitlines()]
        )

    def test_over_a_serial_line(self):
        """The other end of the line is a stock adapter: it is opened, gets the frame, is closed."""
        ours, theirs = pty.openpty()
        self.addCleanup(os.close, ours)
        self.addCleanup(os.close, theirs)
        heard, ended = bytearray(), threading.Event()

        def adapter():
            while not ended.is_set():
                if select.select([ours], [], [], 0.05)[0]:
                    heard.extend(os.read(ours, 4096))
                    os.write(ours, b"\r")

        thread = threading.Thread(target=adapter)
        thread.start()
        try:
            self.good(
                "can",
                "send",
                f"slcan:{os.ttyname(theirs)}?bitrate=500k",
                "123#1122AABB",
                "18FF0001#01",
            )
        finally:
            ended.set()
            thread.join()
        self.assertIn(b"t12341122AABB\r", heard)
        self.assertIn(b"T18FF0001101\r", heard)

    def test_wrong_frames_are_named(self):
        for frame, text in (
            ("123", "invalid frame '123': write IDENTIFIER#DATA, such as 123#1122AABB"),
            (
                "12#00",
                "invalid frame '12#00': invalid identifier '12'; write three hex digits up to 7FF, or eight up to 1FFFFFFF for an extended one",
            ),
            (
                "800#00",
                "invalid frame '800#00': invalid identifier '800'; write three hex digits up to 7FF, or eight up to 1FFFFFFF for an extended one",
            ),
            (
                "123#1",
                "invalid frame '123#1': after #, write up to 8 bytes of two hex digits, or R and the requested length; CAN FD is written ##",
            ),
            (
                "123##0" + "00" * 9,
                f"invalid frame '123##0{'00' * 9}': after ##, write one digit of flags (1: data at the data rate) and 0-8, 12, 16, 20, "
                "24, 32, 48 or 64 bytes",
            ),
        ):
            self.assertEqual(
                f"hal can send: {text}\n", self.bad_can("send", self.bus, "080#", frame)
            )
        self.assertEqual(
            "hal can send: missing frame; type: hal can send ADDRESS 123#1122AABB\n",
            self.bad_can("send", self.bus),
        )
        self.assertEqual(
            "hal can send: --for and --count limit the repetition of --every; add --every 10ms\n",
            self.bad_can("send", self.bus, "080#", "--for", "1s"),
        )

    def test_nmt(self):
        dump = self.listener("dump", self.bus, "-n", 3, "--json")
        for words in (("start", "all"), ("reset-comm", "5"), ("preop", "0x7f")):
            self.good("can", "nmt", self.bus, *words)
        self.assertEqual(
            ["0100", "8205", "807F"],
            [json.loads(line).get("data") for line in self.result(dump)[0].splitlines()[:3]],
        )
        self.assertEqual(
            "hal can nmt: unknown command 'strt'; did you mean 'start'?\n",
            self.bad_can("nmt", self.bus, "strt", "1"),
        )
        self.assertEqual(
            "hal can nmt: invalid node '128'; write 1..127, or all\n",
            self.bad_can("nmt", self.bus, "start", "128"),
        )
        self.assertEqual(
            "hal can nmt: expected ADDRESS COMMAND NODE; type: hal can nmt ADDRESS start|stop|preop|reset|reset-comm NODE|all\n",
            self.bad_can("nmt", self.bus, "start"),
        )


class RecordAndReplay(Can):
    def test_a_recording_is_what_was_replayed(self):
        self.write("c.log", CAPTURE)
        for name in ("copy.log", "copy.pcapng"):
            record = self.listener("record", self.bus, name, "-n", 20)
            done = self.run_program("can", "replay", "c.log", self.bus, "--speed", "2")
            self.assertRegex(done.stderr, r"^20 frames in \S+ s\n$")
            self.assertEqual(f"20 frames in {name}, 0 lost\n", self.result(record)[1])
            copied = self.run_program("can", "dump", "replay:" + name).stdout
            self.assertEqual(
                [line[14:] for line in DUMPED.splitlines()],
                [line[14:] for line in copied.splitlines()],
            )

    def test_wrong_words(self):
        self.write("c.log", CAPTURE)
        self.write("text.log", "nothing\n")
        self.assertEqual(
            "hal can record: unknown format of 'c.txt'; write a name that ends in .log (candump) or .pcapng (Wireshark)\n",
            self.bad_can("record", self.bus, "c.txt"),
        )
        self.assertEqual(
            "hal can replay: invalid --speed; write a factor above 0: 1 as recorded, 2 twice as fast\n",
            self.bad_can("replay", "c.log", self.bus, "--speed", "0"),
        )
        self.assertEqual(
            "hal can replay: --speed: 'fast' is not a number; see: hal help can replay\n",
            self.bad_can("replay", "c.log", self.bus, "--speed", "fast"),
        )
        self.assertIn("text.log", self.bad_can("replay", "text.log", self.bus))
        self.assertIn("none.log", self.bad_can("replay", "none.log", self.bus))
        self.assertEqual(
            "hal can replay: cannot send to 'replay:c.log': it is a capture\n",
            self.bad_can("replay", "c.log", "replay:c.log"),
        )


class Load(Can):
    def test_table_by_identifier(self):
        self.write("c.log", CAPTURE)
        done = self.run_program("can", "load", "replay:c.log?bitrate=125k")
        self.assertEqual(0, done.returncode)
        rows = {line[:8].strip(): line for line in done.stdout.splitlines()}
        self.assertIn("TPDO1 of node 2", rows["182"])
        self.assertGreater(float(rows["all"].split()[-1]), 0)
        self.assertIn(
            "load unknown without a bit rate; add ?bitrate=500k to the address",
            self.run_program("can", "load", "replay:c.log").stderr,
        )


class Scan(Can):
    def test_nodes_by_heartbeat_and_by_asking(self):
        """A made-up node 5 answers over the bus through the program's own dump and send."""
        device = self.listener("dump", self.bus, "--json")
        values = {
            "00100000": "92010200",
            "18100100": "44332211",
            "18100200": "02000000",
            "18100300": "03000000",
        }

        def serve():
            for line in device.stdout:
                frame = json.loads(line)
                if frame.get("id") != 0x605 or frame["direction"] != "rx":
                    continue
                what = frame["data"][2:8]
                value = next((v for key, v in values.items() if key.startswith(what)), None)
                answer = "585#43" + what + value if value else "585#80" + what + "11000906"
                self.run_program("can", "send", self.bus, answer, "705#7F")

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            text = self.good("can", "scan", self.bus, "--for", "3s")
        finally:
            self.end(device)
            thread.join()
        self.assertEqual(
            "node  state            type        vendor      product     revision    serial\n"
            "   5  pre-operational  0x00020192  0x11223344  0x00000002  0x00000003  -           402 drive\n",
            text,
        )

    def test_nobody_there(self):
        self.assertEqual(
            "hal can scan: no node responded within 0.2 s; the bus is active, 0 frames of others received; check bit rate and wiring\n",
            self.bad_can("scan", self.bus, "--for", "200ms"),
        )


if __name__ == "__main__":
    unittest.main()
