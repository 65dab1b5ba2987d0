# SPDX-License-Identifier: MIT
# packages: canopen
"""hal node: simulated CANopen devices as processes, looked at by hal can over udp: on this machine."""
import json
import os
import random
import re
import signal
import struct
import subprocess
import unittest
import zlib

from harness import HAL, Case, wait_until


class Node(Case):
    def setUp(self):
        super().setUp()
        place = random.Random(os.urandom(8))  # tests run side by side: each has its own bus
        self.bus = f"udp:239.{place.randrange(1, 255)}.{place.randrange(256)}.{place.randrange(1, 255)}%lo:{place.randrange(20000, 60000)}"
        self.said = {}

    def node(self, kind, *words):
        """Starts a device and waits until it is on the bus."""
        name = self.folder / f"{kind}-{len(self.said)}.txt"
        with open(name, "w", encoding="utf-8") as out:
            process = subprocess.Popen(
                ["hal", "node", kind, "--link", self.bus, *map(str, words)],
                executable=str(HAL),
                cwd=self.folder,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.PIPE,
                text=True,
            )
        self.addCleanup(self.end, process)
        self.said[process] = name
        wait_until(
            lambda: " s  " in name.read_text() or process.poll() is not None, "the device boots"
        )
        if process.poll() is not None:
            self.fail(process.communicate()[1])
        return process

    def expect(self, process, text):
        wait_until(
            lambda: text in self.said[process].read_text(),
            f"{text!r} in {self.said[process].read_text()!r}",
        )

    def ended(self, process):
        """Sends Ctrl-C and returns the whole output."""
        process.send_signal(signal.SIGINT)
        error = process.communicate(timeout=60)[1]
        self.assertEqual((0, ""), (process.returncode, error))
        return self.said[process].read_text()

    def read(self, node, place, kind):
        """The value of an object."""
        return json.loads(
            self.good("can", "sdo", "read", self.bus, node, place, "--type", kind, "--json")
        )["value"]

    def write_object(self, node, place, kind, *value):
        self.good("can", "sdo", "write", self.bus, node, place, *value, "--type", kind)


class Devices(Node):
    def test_says_what_it_is_what_happens_and_how_it_ends(self):
        io = self.node("io", "--id", 5, "--heartbeat", 20, "--set", "in-3=1")
        scan = self.good("can", "scan", self.bus, "--for", "1s")
        self.assertRegex(
            scan,
            r"   5  pre-operational  0x000F0191  0x0048414C  0x00000401  0x00010000  0x00000001  ",
        )
        self.good("can", "nmt", self.bus, "start", "5")
        self.expect(io, "operational\n")
        self.good("can", "send", self.bus, "205#8100000000000000")
        self.expect(io, "outputs 10000001")
        self.good("can", "nmt", self.bus, "stop", "5")
        self.expect(io, "stopped\n")
        text = self.ended(io)
        first, *rest = text.splitlines()
        self.assertEqual(
            f"io, node 5 on {self.bus} (CAN over UDP multicast): CiA 401, 64 digital inputs, 64 outputs, 12 analogue inputs and 12 outputs; "
            "press Ctrl-C to end",
            re.sub(r"on \S+ \([^)]*\)", f"on {self.bus} (CAN over UDP multicast)", first),
        )
        self.assertRegex(rest[0], r"^ +0\.\d{3} s  pre-operational$")
        self.assertRegex(
            text,
            r"\n\d+\.\d s: \d+ frames sent, \d+ received, 0 dropped, 0 lost in transit, 0 lost here, 0 rejected; [1-9]\d* SDO transfers, 0 aborted; [1-9]\d* PDOs sent\n"
            r"outputs 0{64}, at their error values\n$",
        )

    def test_world_around_it_is_set_now_and_later(self):
        io = self.node("io", "--id", 5, "--set", "in-0=1", "--set", "analog-in-1=5@0.1s", "--start")
        self.expect(io, "operational\n")
        wait_until(lambda: self.read(5, "6401:2", "i16") == 16384, "the analogue input comes")
        self.assertEqual(1, self.read(5, "6000:1", "u8"))

    def test_drive_is_enabled(self):
        drive = self.node("drive", "--id", 2, "--axes", 2, "--motor", "endless:1")
        self.good("can", "nmt", self.bus, "start", "2")
        self.expect(
            drive,
            "axis 0 switch on disabled, profile position; axis 1 switch on disabled, profile position",
        )
        for command, state in (
            ("6", "ready to switch on"),
            ("7", "switched on"),
            ("0xf", "operation enabled"),
        ):
            self.write_object(2, "6840:0", "u16", command)
            self.expect(
                drive,
                f"axis 0 switch on disabled, profile position; axis 1 {state}, profile position",
            )

    def test_each_change_has_a_line_with_its_time(self):
        drive = self.node("drive", "--id", 2, "--axes", 1, "--motor", "endless:1")
        self.good("can", "nmt", self.bus, "start", "2")
        for command in ("6", "7", "0xf"):
            self.write_object(2, "6040:0", "u16", command)
        self.expect(drive, "operation enabled")
        text = self.ended(drive)
        for state in ("ready to switch on", "switched on", "operation enabled"):
            self.assertRegex(text, rf"(?m)^ +\d+\.\d{{3}} s  {state}, profile position$")

    def test_force_sensor_reads_what_acts_on_it(self):
        self.node("jr3", "--set", "fz=-20")
        wait_until(lambda: abs(self.read(80, "6130:3", "r32") + 20) < 0.05, "the force is measured")

    def test_a_recorded_line_is_played(self):
        self.good("node", "jr3", "--record", "line.bin", "--for", "50ms")
        self.assertEqual(13750, os.path.getsize(self.folder / "line.bin"))
        jr3 = self.node("jr3", "--stream", "line.bin", "--id", "0x51")
        wait_until(lambda: self.read(81, "2203:0", "u32") > 1000, "packets are decoded")
        self.assertIn("not calibrated yet, F", self.ended(jr3))

    def test_program_is_updated_and_kept(self):
        image = subprocess.run(
            ["hal", "node", "bootloader", "--make-image", "2.1"],
            executable=str(HAL),
            env=self.environment,
            stdout=subprocess.PIPE,
            check=True,
        ).stdout
        (self.folder / "image.bin").write_bytes(image)
        self.assertEqual(
            (b"HLCP", 0x302, 0x20001, len(image) - 20, zlib.crc32(image[20:])),
            struct.unpack_from("<4sIIII", image),
        )
        device = self.node("bootloader", "--id", 4, "--flash", "flash.bin")
        self.expect(device, "program 1.0 runs")
        self.write_object(4, "1f51:1", "u8", "0")
        self.expect(device, "bootloader; flash: no error")
        self.write_object(4, "1f51:1", "u8", "3")
        wait_until(lambda: self.read(4, "1f57:1", "u32") == 2, "the flash is clear")
        self.good(
            "can",
            "sdo",
            "write",
            self.bus,
            4,
            "1f50:1",
            "--from",
            "image.bin",
            "--type",
            "domain",
            "--block",
        )
        self.assertEqual(zlib.crc32(image), self.read(4, "1f56:1", "u32"))
        self.write_object(4, "1f51:1", "u8", "1")
        self.expect(device, "program 2.1 runs")
        self.assertEqual(0x20001, self.read(4, "1018:3", "u32"))
        device.kill()  # it was kept at once
        device.wait()
        self.assertEqual(image, (self.folder / "flash.bin").read_bytes())
        again = self.node("bootloader", "--id", 4, "--flash", "flash.bin")
        self.expect(again, "program 2.1 runs")

    def test_a_flash_that_cannot_be_kept_is_said(self):
        self.assertEqual(
            "hal node bootloader: cannot create 'nowhere/flash.bin': missing folder; type: mkdir -p nowhere\n",
            self.bad(
                "node", "bootloader", "--link", self.bus, "--id", 4, "--flash", "nowhere/flash.bin"
            ),
        )
        (self.folder / "nowhere").mkdir()
        device = self.node("bootloader", "--id", 4, "--flash", "nowhere/flash.bin")
        (self.folder / "nowhere").rmdir()
        self.write_object(4, "1f51:1", "u8", "0")
        self.expect(device, "bootloader; flash: no error")
        self.write_object(4, "1f51:1", "u8", "3")
        self.assertEqual(
            "hal node bootloader: cannot write 'nowhere/flash.bin': No such file or directory\n",
            device.communicate(timeout=60)[1],
        )
        self.assertEqual(1, device.returncode)

    def test_faults(self):
        self.node(
            "io",
            "--id",
            5,
            "--fault",
            "wrong-revision",
            "--fault",
            "no-heartbeat",
            "--heartbeat",
            "10",
        )
        self.assertRegex(
            self.good("can", "scan", self.bus, "--for", "1s"),
            r"   5  no heartbeat  .*0x000100FF  0x00000001",
        )
        late = self.node("io", "--id", 6, "--fault", "late-sdo:time=50ms")
        self.read(6, "1000:0", "u32")
        self.assertRegex(self.ended(late), r"\nfault late-sdo: \d+ times\n")

    def test_a_node_id_comes_from_an_LSS_master(self):
        io = self.node("io", "--id", "none", "--serial", 9)
        self.good(
            "can",
            "send",
            self.bus,
            "7E5#0401000000000000",
            "7E5#1107000000000000",
            "7E5#0400000000000000",
        )
        self.expect(io, "pre-operational\n")
        self.assertRegex(self.good("can", "scan", self.bus, "--for", "1s"), r"   7  .*0x00000009")

    def test_EDS_is_without_defect(self):
        for kind in ("drive", "io", "jr3", "bootloader"):
            self.write(f"{kind}.eds", self.good("node", kind, "--eds"))
            done = self.run_program("can", "eds", "check", f"{kind}.eds")
            self.assertEqual(0, done.returncode)
            self.assertRegex(
                done.stderr,
                rf"^{kind}\.eds: Halcyon .* by Halcyon; \d+ objects, \d+ entries, \d RPDOs, \d TPDOs?; 0 warnings, 0 notes\n$",
            )
        self.write("eight.eds", self.good("node", "drive", "--axes", "8", "--eds"))
        self.assertRegex(
            self.run_program("can", "eds", "check", "eight.eds").stderr,
            r"56 RPDOs, 56 TPDOs; 0 warnings, 0 notes",
        )


NETWORK = """[bus]
link = sim:house
sync = cycle
[node 2 drive]
eds = drive.eds
rpdo1 = 0x6040:0, 0x607a:0
tpdo1 = 0x6041:0, 0x6064:0
[node 5 io]
eds = io.eds
[node 80 force]
eds = jr3.eds
tpdo2 = default
tpdo4 = default
[node 4 updated]
eds = bootloader.eds
revision = any
"""
HOUSE = """loadrt threads name1=bus period1=1000000
loadrt canopen config=house.canopen
loadrt canopen_drive link=sim:house id=2
loadrt canopen_io link=sim:house id=5
loadrt canopen_jr3 link=sim:house id=80
loadrt canopen_bootloader link=sim:house id=4
addf canopen.0.receive bus
addf canopen.0.transmit bus
addf canopen-drive.0.update bus
addf canopen-io.0.update bus
addf canopen-jr3.0.update bus
addf canopen-bootloader.0.update bus
setp canopen-io.0.in-63 TRUE
setp canopen-jr3.0.fx 30
start
advance 1s
getp canopen.0.operational
getp canopen.0.nodes-operational
getp canopen.0.io.read-input-8-bit-input-block-8-7
getp canopen.0.force.ai-process-value-16-bit-fx
getp canopen.0.drive.statusword
"""


class Masters(Node):
    def test_our_master_is_configured_from_the_EDS_of_each(self):
        for kind in ("drive", "io", "jr3", "bootloader"):
            self.write(f"{kind}.eds", self.good("node", kind, "--eds"))
        self.write("house.canopen", NETWORK)
        self.write("house.hal", HOUSE)
        self.good("canopen", "check", "house.canopen")
        done = self.run_program("sim", "house.hal")
        self.assertEqual(0, done.returncode, done.stderr)
        operational, nodes, last_input, force, statusword = done.stdout.split()
        self.assertEqual(
            ("TRUE", "4", "TRUE", 0x250),
            (operational, nodes, last_input, int(statusword, 0)),
            done.stderr,
        )
        self.assertLess(abs(int(force) - 3000), 5)


class WrongWords(Node):
    def test_each_says_what_to_type(self):
        cases = {
            (
                "io",
            ): "missing --link; add --link udp:239.74.163.2:43113, or can:can0, slcan:/dev/ttyACM0; see: hal help node io",
            (
                "io",
                "--link",
                self.bus,
            ): "missing --id: use --id 5, or --id none to wait for an LSS master",
            (
                "io",
                "--link",
                self.bus,
                "--id",
                "128",
            ): "invalid --id '128'; write 1..127, 0x50, or none to wait for an LSS master",
            (
                "io",
                "--link",
                "bus",
                "--id",
                "5",
            ): "'bus' is not the address of a CAN bus; write "
            "can:can0 for an interface of this machine, sim:NAME for a bus in memory, "
            "udp:239.74.163.2:43113 for a bus in UDP datagrams, slcan:/dev/ttyACM0 for an adapter "
            "on a serial line, cane:enp3s0 for CAN in Ethernet frames, scocan:NODE for the slots "
            "of a node or replay:FILE for a recorded bus",
            (
                "io",
                "--link",
                self.bus,
                "--id",
                "5",
                "--set",
                "in-64=1",
            ): "unknown value 'in-64' in --set; write one of: in-0 … in-63, analog-in-0 … analog-in-11",
            (
                "io",
                "--link",
                self.bus,
                "--id",
                "5",
                "--set",
                "in-6",
            ): "invalid --set 'in-6'; write NAME=VALUE, or NAME=VALUE@2s for later",
            (
                "bootloader",
                "--link",
                self.bus,
                "--id",
                "5",
                "--set",
                "a=1",
            ): "invalid --set: a bootloader has no settable values",
            ("bootloader", "--make-image", "2"): "invalid version '2'; write 2.1",
            (
                "drive",
                "--link",
                self.bus,
                "--id",
                "5",
                "--motor",
                "weight:3",
            ): "invalid motor parameter 'weight:3'; write NAME:VALUE, as in inertia:1e-4; names: resolution, endless, inertia, viscous-friction, "
            "coulomb-friction, rated-torque, peak-torque, rated-current, rated-voltage, highest-speed, start, negative-limit, positive-limit, "
            "negative-stop, positive-stop, home-from, home-to, brake-torque",
            (
                "jr3",
                "--record",
                "line.bin",
            ): "missing --for; add --for 2s, the calibration takes 1.02 s",
            (
                "jr3",
                "--link",
                self.bus,
                "--stream",
                "none.bin",
            ): "cannot read 'none.bin': No such file or directory",
            (
                "io",
                "--link",
                self.bus,
                "--id",
                "5",
                "--fault",
                "mute:every=0",
            ): "invalid property 'every=0' of fault mute; write every=3, from=5s or for=1s",
        }
        for words, message in cases.items():
            self.assertEqual(f"hal node {words[0]}: {message}\n", self.bad("node", *words))
        self.assertIn(
            "--axes: Value 9 not in range 1 to 8", self.bad("node", "drive", "--axes", "9")
        )
        self.assertEqual(
            "hal: unknown command 'node drve'; did you mean 'node drive'?\n",
            self.bad("node", "drve"),
        )
        self.assertIn(
            "unknown fault 'lat-sdo'; use one of: mute, deaf, ",
            self.bad("node", "io", "--link", self.bus, "--id", "5", "--fault", "lat-sdo"),
        )

    def test_faults_are_listed(self):
        text = self.good("node", "faults")
        self.assertIn("late-sdo        every SDO response is delayed by `time`; time=700ms\n", text)
        self.assertEqual(32, text.count("\n"))


if __name__ == "__main__":
    unittest.main()
