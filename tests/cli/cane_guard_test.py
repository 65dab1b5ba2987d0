# SPDX-License-Identifier: MIT
# packages: canopen tdma
"""A foreign station on the segment, with raw frames: forged NMT, SYNC and set-points are rejected and named, in every format; syncs of another
schedule from a lower address do not take the segment off; what an event timer of a cycle sends is on the wire in every cycle."""
import itertools
import re
import socket
import struct
import subprocess
import sys
import unittest

from harness import HAL, wait_until
from segment import Segment, enter

CELL = """cycle 5000
speed 1000
guard 400
lost 200
rounds 10

master:
name m
slot 0 500 1/1 800

slave:
name x
slot 0 2500 1/1 800
"""

MASTER = """loadrt threads name1=servo period1=5000000
loadrt tdma link=eth:wire0 config=cell.tdma station=m
loadrt canopen config=cell.canopen
addf tdma.0.receive servo
addf canopen.0.receive servo
addf canopen.0.transmit servo
addf tdma.0.transmit servo
"""

CANOPEN = """[bus]
link = cane:wire0?slot=0{format}
sync = cycle
heartbeat = 100ms

[node 6 io]
device = cia401
heartbeat = 100ms
silence = 2s
tpdo1 = read-inputs-1
rpdo1 = write-outputs-1
rpdo1.transmission = event
rpdo1.event-timer = 5ms
"""

LOWEST = "02:00:00:00:00:01"


def crc16(data, crc=0xFFFF):
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x1021) & 0xFFFF if crc & 0x8000 else crc << 1
    return crc


def address(text):
    return bytes.fromhex(text.replace(":", ""))


def packed(source, messages, sequence):
    """A frame `cane:` accepts, of a session of its own."""
    head = b"\xff" * 6 + address(source) + b"\x90\x23"
    start = struct.pack("<BBBBHH", 0xEC, 1, len(messages), 0xEC, 0x1234, sequence)
    body = b"".join(struct.pack("<H", cob | len(data) << 12) + data for cob, data in messages)
    return head + start + struct.pack("<H", crc16(body, crc16(head + start))) + body


def single(source, cob, data):
    return b"\xff" * 6 + address(source) + b"\x90\x23" + struct.pack(">IB", cob, len(data)) + data


def sync(source, cycle, stamp):
    return (
        b"\xff" * 6
        + address(source)
        + struct.pack(">HHBBHHIQQ", 0x9021, 1, 2, 0, 0x0201, 0, cycle, stamp, stamp)
    )


SEND = """
import socket, sys, time
s = socket.socket(socket.AF_PACKET, socket.SOCK_RAW)
s.bind(("wire0", 0))
for line in sys.stdin:
    wait, frame = line.split()
    time.sleep(float(wait))
    s.send(bytes.fromhex(frame).ljust(60, b"\\0"))
"""


class Stranger(Segment):
    names = ("m", "x", "s")

    def begin(self, format=""):
        self.write("cell.tdma", CELL)
        self.write("cell.canopen", CANOPEN.format(format=format))
        ip = ["ip", "-n", "s", "link", "set", "wire0"]
        subprocess.run([*ip, "down"], check=True)
        subprocess.run([*ip, "address", LOWEST], check=True)
        subprocess.run([*ip, "up"], check=True)
        self.station("m", MASTER)
        log = self.logs.setdefault("x", self.folder / "x.log")
        with open(log, "a") as out:
            process = subprocess.Popen(
                [
                    "ip",
                    "netns",
                    "exec",
                    "x",
                    HAL,
                    "node",
                    "io",
                    "--link",
                    "cane:wire0" + ("?" + format[1:] if format else ""),
                    "--id",
                    "6",
                    "--tdma",
                    "cell.tdma",
                    "--station",
                    "x",
                ],
                cwd=self.folder,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
            )
        self.addCleanup(self.stop, process)
        wait_until(
            lambda: self.shell_value("m", "canopen.0.io.operational") == "TRUE",
            "the node is operational",
        )

    def shell_value(self, name, pin):
        return self.at(
            name, HAL, "shell", "--name", f"test-{name}", "-s", "getp", pin, env=self.environment
        ).stdout.strip()

    def send(self, frames, pause=0.001):
        text = "".join(f"{pause} {frame.hex()}\n" for frame in frames)
        done = self.at("s", sys.executable, "-c", SEND, input=text)
        self.assertEqual("", done.stdout)

    def stays_operational(self):
        before = self.number("m", "cycle")
        wait_until(lambda: self.number("m", "cycle") > before + 200, "a second passes")
        self.assertEqual("TRUE", self.shell_value("m", "canopen.0.io.operational"))

    def test_forged_commands_in_packed_frames(self):
        self.begin()
        self.send(
            [packed(LOWEST, [(0x000, bytes([2, 0]))], n) for n in range(20)]
        )  # NMT stop, all nodes
        self.send(
            [packed(LOWEST, [(0x080, b""), (0x206, b"\xff")], 100 + n) for n in range(20)]
        )  # SYNC and a set-point
        self.stays_operational()
        self.assertRegex(
            self.said("x"),
            rf"rejected NMT command \(000h\) from {LOWEST}: not in a slot of that station|"
            rf"rejected NMT command \(000h\) from {LOWEST}: not the master",
        )
        self.assertNotIn("stopped", self.said("x"))

    def test_status_shows_the_stations(self):
        self.begin()
        done = self.at("m", HAL, "tdma", "status", "--name", "test-m", env=self.environment)
        self.assertEqual(0, done.returncode, done.stdout)
        # Every request of the boot left in its slot: none had to be repeated after a timeout of half a second.
        self.assertLess(self.number("m", "frames-late"), 20)
        self.assertRegex(
            done.stdout, r"tdma\.0: running as master, cycle \d+; own clock [-+.\d]+ ppm"
        )
        self.assertRegex(done.stdout, r"(?m)^x +online +\d+\.\d s +[1-9]\d* ")
        print(done.stdout, file=sys.stderr)
        wrong = self.at("m", HAL, "tdma", "status", "--name", "nobody", env=self.environment)
        self.assertEqual(1, wrong.returncode)

    def test_forged_commands_in_single_frames(self):
        self.begin("&format=single")
        self.send([single(LOWEST, 0x000, bytes([2, 0])) for _ in range(20)])
        self.stays_operational()
        self.assertRegex(self.said("x"), rf"rejected NMT command \(000h\) from {LOWEST}")
        self.assertNotIn("stopped", self.said("x"))

    def test_commands_in_the_masters_name_outside_of_its_slot(self):
        self.begin()
        master = self.mac("m")
        self.send([packed(master, [(0x000, bytes([2, 0]))], n) for n in range(300)], 0.0037)
        self.assertRegex(
            self.said("x"),
            rf"rejected NMT command \(000h\) from {master}: not in a slot of that station",
        )

    def test_syncs_of_a_lower_address(self):
        self.begin()
        self.send([sync(LOWEST, n, 10**15 + n * 5_000_000) for n in range(999)], 0.004)
        self.send(
            [
                b"\xff" * 6
                + address(LOWEST)
                + bytes.fromhex("9021")
                + bytes((n * k) % 256 for k in range(46))
                for n in range(200)
            ]
        )
        self.assertEqual(
            ["TRUE", "3"], [self.shell_value("m", "tdma.0." + pin) for pin in ("leading", "state")]
        )
        self.stays_operational()
        self.assertIn(f"second master on the segment: {LOWEST} ", self.said("m"))
        self.assertNotIn("stepped down", self.said("m"))
        wait_until(
            lambda: f"the second master {LOWEST} is gone" in self.said("m"), "its end is reported"
        )

    def test_an_event_timer_of_a_cycle_sends_in_every_cycle(self):
        self.begin()
        program = (
            "import socket, time\ns = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))\ns.bind(('wire0', 3))\n"
            "end = time.time() + 4\ns.settimeout(0.5)\n"
            "while time.time() < end:\n    f = s.recv(2048)\n    print(f.hex(), flush=True)\n"
        )
        frames = [
            bytes.fromhex(line)
            for line in self.at("s", sys.executable, "-c", program).stdout.split()
        ]
        has_it = []  # of each cycle
        for frame in frames:
            if (
                frame[12:14] != b"\x90\x23"
                or frame[6:12] != address(self.mac("m"))
                or frame[14] != 0xEC
            ):
                continue
            body, cobs = frame[24:], []
            for _ in range(frame[16]):
                first = struct.unpack("<H", body[:2])[0]
                cobs.append(first & 0x7FF)
                body = body[2 + (first >> 12) :]
            if 0x080 in cobs:
                has_it.append(0x206 in cobs)
        print(f"{len(has_it)} SYNCs, {sum(has_it)} with the RPDO", file=sys.stderr)
        self.assertGreater(sum(has_it), 100)
        # A busy machine may lose the node for as long as it takes to boot again; a cycle that is skipped stands alone.
        skipped = [len(list(cycles)) for has, cycles in itertools.groupby(has_it) if not has]
        self.assertLessEqual(sum(1 for length in skipped if length < 10), 2, skipped)


if __name__ == "__main__":
    enter()
    unittest.main()
