# SPDX-License-Identifier: MIT
# packages: ethercat
"""hal doctor --interface: findings, the round trip over a veth pair, and settings that are restored however the program ends."""

import ctypes
import fcntl
import json
import os
import signal
import socket
import struct
import subprocess
import unittest
from pathlib import Path

import ethercat_line
from harness import HAL, TIMEOUT, Case, wait_until

SIOCETHTOOL = 0x8946
GETTERS = {"gro": 0x2B, "gso": 0x23, "tso": 0x1E}
SETTERS = {"gro": 0x2C, "gso": 0x24, "tso": 0x1F}
LOAD = "servo\ndigital_in bits=8\n"


def driver(command, value=0):
    """The answer of the driver of m0 to a request of linux/ethtool.h with one value."""
    request = ctypes.create_string_buffer(struct.pack("II", command, value), 8)
    wrapped = struct.pack("16sP", b"m0", ctypes.addressof(request)) + bytes(16)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as wire:
        fcntl.ioctl(wire, SIOCETHTOOL, wrapped)
    return struct.unpack("II", request.raw)[1]


def settings():
    return {name: driver(command) for name, command in GETTERS.items()}


class DoctorInterface(Case):
    def setUp(self):
        super().setUp()
        driver(SETTERS["gro"], 1)
        self.settings = settings()
        self.assertEqual({"gro": 1, "gso": 1, "tso": 1}, self.settings)

    def hold(self):
        """A program that holds the changed settings."""
        program = subprocess.Popen(
            [HAL, "doctor", "--interface", "m0", "--seconds", "0.02", "--try", "--hold"],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(program.stdout.close)
        for line in program.stdout:
            if "until Ctrl-C" in line:
                break
        self.assertEqual({"gro": 0, "gso": 0, "tso": 0}, settings())
        return program

    def restored(self):
        wait_until(lambda: settings() == self.settings, "the settings are restored")

    def test_findings_have_the_command_to_type(self):
        text = self.good("doctor", "--interface", "m0", "--seconds", "0")
        for subject in ("driver", "link", "other traffic", "gro", "gso", "tso", "interrupts"):
            self.assertRegex(text, rf"(?m)^(good|fair|poor)  {subject} ")
        self.assertIn("try: sudo ethtool -K m0 gro off\n", text)
        self.assertEqual(self.settings, settings())

    def test_segments_of_TCP_matter_beside_an_address(self):
        command = ("ip", "addr", "add", "192.0.2.1/32", "dev", "m0")
        subprocess.run(command, check=True)
        self.addCleanup(subprocess.run, ["ip", "addr", "flush", "dev", "m0"], check=True)
        text = self.good("doctor", "--interface", "m0", "--seconds", "0")
        self.assertIn("try: sudo ip addr flush dev m0\n", text)
        self.assertRegex(text, r"(?m)^fair  tso .*bursts")

    def test_an_interface_that_is_down(self):
        subprocess.run(["ip", "link", "set", "m0", "down"], check=True)
        self.addCleanup(wait_until, lambda: ethercat_line.up("m0"), "m0 is up")
        self.addCleanup(subprocess.run, ["ip", "link", "set", "m0", "up"], check=True)
        text = self.good("doctor", "--interface", "m0", "--seconds", "0.05")
        self.assertIn("try: sudo ip link set m0 up\n", text)
        self.assertIn("not measured: cannot send: Network is down\n", text)

    def test_without_slaves_nothing_is_measured(self):
        report = json.loads(self.good("doctor", "--interface", "m0", "--seconds", "0.5", "--json"))
        self.assertIn("no frame returns on m0", report["round_trip"]["problem"])

    def test_the_effect_of_each_change_is_measured_and_all_are_restored(self):
        with ethercat_line.line(HAL, LOAD):
            words = ("doctor", "--interface", "m0", "--seconds", "0.05")
            trip = json.loads(self.good(*words, "--json"))["round_trip"]
            report = json.loads(self.good(*words, "--try", "--json"))
            shown = self.good(*words, "--try")
        self.assertGreater(trip["frames"], trip["lost"])
        self.assertTrue(0 < trip["p50_ns"] <= trip["p99_ns"] <= trip["max_ns"], trip)
        rows = report["trial"]
        self.assertEqual(["", "gro", "gso", "tso"], [row["changed"] for row in rows])
        for row in rows:
            self.assertGreater(row["p50_ns"], 0, row)
        self.assertRegex(shown, r"(?m)^  as it is .* s +\d+$|^  as it is +\d.*s +\d+$")
        self.assertRegex(shown, r"(?m)^  then tso +\d")
        self.assertTrue(shown.endswith("restored\n"), shown)
        self.assertEqual(self.settings, settings())

    def test_settings_are_restored_after_the_end_by_a_signal(self):
        program = self.hold()
        program.send_signal(signal.SIGINT)
        self.assertIn("restored\n", program.stdout.read())
        self.assertEqual(0, program.wait(TIMEOUT))
        self.assertEqual(self.settings, settings())

    def test_settings_are_restored_after_SIGKILL(self):
        program = self.hold()
        program.kill()
        program.wait(TIMEOUT)
        self.restored()

    def sysfs(self):
        """The folder of m0 in sysfs, which shows the interfaces of the network it was mounted in."""
        folder = Path("/sys/class/net/m0")
        if not folder.exists():
            mounted = subprocess.run(
                ["mount", "-t", "sysfs", "sysfs", "/sys"], capture_output=True, text=True
            )
            if mounted.returncode != 0:
                self.skipTest("sysfs cannot be mounted here: " + mounted.stderr.strip())
            self.addCleanup(subprocess.run, ["umount", "/sys"], check=True)
        return folder

    def test_postponed_frames_are_changed_and_restored_after_SIGKILL(self):
        files = {"gro_flush_timeout": "20000", "napi_defer_hard_irqs": "2"}
        folder = self.sysfs()
        for name, value in files.items():
            if not (folder / name).exists():
                self.skipTest(f"this kernel has no {name}")
            (folder / name).write_text(value)
            self.addCleanup((folder / name).write_text, "0")

        def present():
            return {name: (folder / name).read_text().strip() for name in files}

        self.assertEqual(files, present())
        text = self.good("doctor", "--interface", "m0", "--seconds", "0")
        self.assertIn(f"try: echo 0 | sudo tee {folder}/gro_flush_timeout\n", text)
        self.assertEqual(files, present())
        program = self.hold()
        self.assertEqual({name: "0" for name in files}, present())
        program.kill()
        program.wait(TIMEOUT)
        wait_until(lambda: present() == files, "the files are restored")
        self.restored()

    def test_settings_are_restored_when_the_observer_was_killed(self):
        program = self.hold()
        children = Path(f"/proc/{program.pid}/task/{program.pid}/children").read_text().split()
        self.assertEqual(1, len(children), children)
        os.kill(int(children[0]), signal.SIGKILL)
        program.send_signal(signal.SIGTERM)
        self.assertIn("restored\n", program.stdout.read())
        self.assertEqual(0, program.wait(TIMEOUT))
        self.assertEqual(self.settings, settings())

    def test_without_privileges_the_command_to_type_is_named(self):
        def limited(withheld, *more):
            done = subprocess.run(
                ["setpriv", f"--bounding-set={withheld}", "--inh-caps=-all", HAL, "doctor"]
                + ["--interface", "m0", "--seconds", "0.05", *more],
                env=self.environment,
                capture_output=True,
                text=True,
                timeout=TIMEOUT,
            )
            return done.returncode, done.stdout, done.stderr

        code, _, problem = limited("-net_admin", "--try")
        self.assertEqual(1, code)
        self.assertEqual(
            "hal doctor: settings are changed by root (CAP_NET_ADMIN) only; type: sudo hal doctor --interface m0 --try\n",
            problem,
        )
        code, text, _ = limited("-net_raw")
        self.assertEqual(0, code)
        self.assertIn("not measured: raw frames are denied; type: ", text)
        self.assertEqual(self.settings, settings())

    def test_a_running_master_is_not_disturbed(self):
        with socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(0x88A4)) as master:
            master.bind(("m0", 0x88A4))
            self.assertEqual(
                "hal doctor: a program uses m0 for EtherCAT; stop it first: some changes interrupt the link\n",
                self.bad("doctor", "--interface", "m0", "--try"),
            )
            text = self.good("doctor", "--interface", "m0")
            self.assertIn("not measured: a program uses the interface for EtherCAT\n", text)

    def test_wrong_words(self):
        self.assertRegex(
            self.bad("doctor", "--interface", "nope"),
            r"^hal doctor: no interface 'nope'; this computer has .*m0",
        )
        self.assertEqual(
            "hal doctor: --hold applies to --try\n",
            self.bad("doctor", "--interface", "m0", "--hold"),
        )
        self.assertEqual(
            "hal doctor: --cpu, --udp, --try and --hold apply to --interface NAME\n",
            self.bad("doctor", "--try"),
        )
        self.assertIn(
            "cannot be combined with --udp",
            self.bad("doctor", "--interface", "m0", "--udp", "--try"),
        )

    def test_card_that_is_reached_by_ip_needs_an_address(self):
        subprocess.run(["ip", "addr", "add", "10.77.0.1/24", "dev", "m0"], check=True)
        try:
            raw = self.good("doctor", "--interface", "m0", "--seconds", "0")
            self.assertIn("try: sudo ip addr flush dev m0", raw)
            udp = self.good("doctor", "--interface", "m0", "--udp")
            self.assertIn("good  other traffic   an IP address, which the card needs", udp)
            self.assertNotIn("ip addr flush", udp)
            self.assertNotIn("round trip", udp)
        finally:
            subprocess.run(["ip", "addr", "flush", "dev", "m0"], check=True)


if __name__ == "__main__":
    ethercat_line.network()
    unittest.main()
