# SPDX-License-Identifier: MIT
# packages: ethercat
"""hal node ethercat: a line of emulated slaves on a veth pair, with our master at the other end; each is killed in turn."""

import json
import os
import re
import signal
import subprocess
import unittest

import ethercat_line
from harness import HAL, ROOT, SANITIZED, Case, machines_elsewhere, wait_until
from own_network import VARIABLE, own_network

MACHINE = ROOT / "halfiles/ethercat-servo"


def prefer():
    """Gives the emulated devices the real-time priority for want of which a busy host loses their frames. Devices of their own never wait."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(60))
    except PermissionError:
        pass


class Line(Case):
    """The cycle is ten times as long as the machine's: ten lost cycles make a slave lost, and a busy host stalls a process for 10 ms."""

    def setUp(self):
        super().setUp()
        if os.environ.get(VARIABLE) != "1":
            self.skipTest(
                "no network namespaces here; run it as root, or where user namespaces are allowed"
            )
        if SANITIZED:
            self.skipTest("a master under a sanitizer misses its cycles")
        if not ethercat_line.veth():
            self.skipTest("no veth pairs here")
        self.addCleanup(subprocess.run, ["ip", "link", "delete", "m0"])
        self.write("servo.line", (MACHINE / "servo.line").read_text())
        self.write(
            "servo.ethercat",
            (MACHINE / "servo.ethercat")
            .read_text()
            .replace("sim:servo", "eth:m0")
            .replace("cycle = 1ms", "cycle = 10ms"),
        )
        self.write(
            "servo.hal",
            "".join(
                line.replace("period1=1000000", "period1=10000000")
                for line in (MACHINE / "servo.hal").read_text().splitlines(True)
                if "ethercat_segment" not in line and "ethercat-segment" not in line
            ),
        )
        self.logs = {}

    def start(self, *words, **how):
        log = f"{len(self.logs)}.txt"
        process = self.start_logged(*words, log=log, **how)
        self.addCleanup(self.end, process)
        self.logs[process] = self.folder / log
        return process

    @staticmethod
    def end(process, number=signal.SIGTERM):
        if process.poll() is None:
            process.send_signal(number)
        return process.wait(60)

    def said(self, process):
        return self.logs[process].read_text()

    def expect(self, process, pattern, times=1):
        wait_until(
            lambda: len(re.findall(pattern, self.said(process))) >= times
            or process.poll() is not None,
            f"{pattern} in {self.said(process)}",
        )
        self.assertGreaterEqual(
            len(re.findall(pattern, self.said(process))), times, self.said(process)
        )

    def node(self, *words):
        node = self.start(
            "node", "ethercat", "servo.line", "--link", "eth:s0", *words, preexec_fn=prefer
        )
        self.expect(node, "press Ctrl-C to end")
        return node

    def machine(self):
        return self.start("run", "--name", "servo", "--no-picture", "servo.hal")

    def pin(self, name):
        return self.run_program("shell", "--name", "servo", "-s", "getp", name).stdout.strip()

    def both(self, pin, value):
        wait_until(
            lambda: all(self.pin(pin.replace("*", axis)) == value for axis in ("left", "right")),
            f"{pin} is {value}",
        )

    def test_dump_shows_what_a_command_does(self):
        self.node()
        dump = self.start("ethercat", "dump", "eth:m0")
        filtered = self.start("ethercat", "dump", "eth:m0", "--filter", "nothing has this")
        wait_until(
            lambda: self.good("ethercat", "upload", "eth:m0", "-p", "1", "0x1018", "1")
            and " CoE SDO uploaded 0x1018:1" in self.said(dump),
            "dump shows it",
        )
        self.bad("ethercat", "upload", "eth:m0", "-p", "1", "0x2fff", "0")
        self.expect(
            dump,
            r"  <-  FPRD station 0x1002 1100  \[256\] 0A 00 .* WKC 1  CoE SDO abort 0x2FFF:0: 0x06020000, object does not exist in the object dictionary\n",
        )
        self.expect(
            dump, r"  <-  BWR  all slaves 0120  \[2\] 11 00  WKC 2  AL control: INIT, acknowledge\n"
        )
        self.expect(
            dump, r"  <-  FPWR station 0x1002 0120  \[2\] 02 00  WKC 1  AL control: PRE-OP\n"
        )
        self.assertEqual((0, 0, ""), (self.end(dump), self.end(filtered), self.said(filtered)))

    def test_commands_by_position_leave_a_running_master_alone(self):
        machine = None
        try:
            self.write(
                "servo.ethercat",
                (self.folder / "servo.ethercat")
                .read_text()
                .replace("cycle = 10ms", "cycle = 10ms\nsync-window = 1ms"),
            )
            self.node()
            machine = self.machine()
            self.look_beside(machine)
        except AssertionError:
            said = self.said(machine) if machine is not None else ""
            if "does not answer" in said and "another EtherCAT master" not in said:
                self.skipTest("this host is too busy: the line missed the frames of ten cycles")
            raise

    def look_beside(self, machine):
        self.both("ethercat.0.*.operational", "TRUE")
        self.both("*.active", "TRUE")
        self.assertEqual("0    OP\n1    OP\n", self.good("ethercat", "states", "eth:m0"))
        self.assertRegex(
            self.good("ethercat", "slaves", "eth:m0"),
            r"^0 +0:0 +OP +\+ Halcyon servo\n1 +0:1 +OP +\+ Halcyon servo\n$",
        )
        self.assertRegex(
            self.good("ethercat", "scan", "eth:m0"),
            r"^0  OP  Halcyon servo  .*\n  1  OP  Halcyon servo  at port 1 of slave 0  delay [1-9]\d* ns\n$",
        )
        self.assertEqual(
            "0x08 0x00\n", self.good("ethercat", "reg-read", "eth:m0", "-p", "1", "0x130")
        )
        self.assertIn("6040:0 UINT, 16 bit", self.good("ethercat", "pdos", "eth:m0"))
        image = json.loads(self.good("ethercat", "sii-read", "eth:m0", "-p", "1", "--json"))[
            "bytes"
        ].split()
        self.assertEqual(["0xff", "0xff", "0xff", "0x00"], image[16:20], "the vendor, at word 8")
        self.assertIn(
            "no port has counted errors of its own\n", self.good("ethercat", "crc", "eth:m0")
        )
        rows = json.loads(self.good("ethercat", "dc", "eth:m0", "--json"))
        self.assertEqual([(0, True), (1, True)], [(row["position"], row["sync"]) for row in rows])
        self.assertEqual(0, rows[0]["delay_ns"])
        self.assertGreater(rows[1]["delay_ns"], 0)
        self.assertTrue(all(abs(row["deviation_ns"]) < 1_000_000 for row in rows), rows)
        for command, words in (
            ("upload", ("-p", "1", "0x1000", "0")),
            ("states", ("PREOP",)),
            ("foe-read", ("-p", "1", "x")),
        ):
            self.assertIn(
                "another EtherCAT master is active on eth:m0, and this command changes states; stop it, or, for objects, use its mailbox gateway: "
                "gateway:127.0.0.1 instead of eth:m0\n",
                self.bad("ethercat", command, "eth:m0", *words),
            )
        self.both("ethercat.0.*.operational", "TRUE")
        self.assertEqual(
            ["TRUE"] * 2, [self.pin("left.active"), self.pin("right.active")], self.said(machine)
        )
        self.assertNotIn("another EtherCAT master", self.said(machine))

    def test_dc_shows_clocks_that_run_apart(self):
        self.write(
            "servo.ethercat",
            (self.folder / "servo.ethercat").read_text().replace("dc      = sync0\n", ""),
        )
        self.node("--fault", "1:drift=500")
        self.machine()
        self.both("ethercat.0.*.operational", "TRUE")
        rows = json.loads(self.good("ethercat", "dc", "eth:m0", "--json"))
        self.assertEqual(
            [False, False], [row["sync"] for row in rows], "no SYNC without dc in the configuration"
        )
        self.assertRegex(
            self.good("ethercat", "dc", "eth:m0"),
            r"^0  deviation -?\d+ ns  delay \d+ ns  SYNC off  Halcyon servo\n1  deviation ",
        )

    def test_crc_names_the_cable_with_errors(self):
        self.write("servo.line", "coupler\nservo\nservo\n")
        self.node("--fault", "2:corrupt-every=41")
        for _ in range(3):
            self.run_program("ethercat", "scan", "eth:m0")
        report = self.good("ethercat", "crc", "eth:m0")
        self.assertRegex(report, r"(?m)^ +2 +0 +[1-9]\d* +0 +0 +0$")
        self.assertIn("      check the cable between slave 2 port 0 and slave 1 port 1\n", report)
        self.assertEqual(1, report.count("check the cable"), report)
        self.assertEqual(
            ["check the cable between slave 2 port 0 and slave 1 port 1"],
            json.loads(self.good("ethercat", "crc", "eth:m0", "--json"))["cables"],
        )

    def test_firmware_is_written_in_BOOT(self):
        self.write("servo.line", "servo\nmailbox_device\n")
        self.node()
        (self.folder / "new").write_bytes(bytes(range(256)) * 20)
        write = ["ethercat", "foe-write", "eth:m0", "-p", "1", "new", "firmware"]
        self.assertIn(
            "slave 1: file 'firmware': the slave ends the transfer with FoE error 0x8008 (allowed in BOOT only)",
            self.bad(*write, "--password", "0x1234"),
        )
        self.assertIn(
            "slave 1: file 'firmware': the slave ends the transfer with FoE error 0x800A (no rights (wrong password))",
            self.bad(*write, "--boot"),
        )
        self.assertEqual(
            "slave 1: 'firmware' written, 5120 bytes\n",
            self.good(*write, "--boot", "--password", "0x1234"),
        )
        self.assertRegex(self.good("ethercat", "states", "eth:m0"), r"(?m)^1 +PRE-OP$")
        read = json.loads(
            self.good(
                "ethercat",
                "foe-read",
                "eth:m0",
                "-p",
                "1",
                "firmware",
                "--boot",
                "--password",
                "0x1234",
                "--json",
            )
        )
        self.assertEqual(bytes(range(256)) * 20, bytes(int(b, 16) for b in read["bytes"].split()))
        self.assertEqual(
            "hal ethercat foe-write: slave 0: its EEPROM has no mailbox for BOOT; it takes its firmware in PRE-OP (without --boot), or by a tool of its "
            "maker\n",
            self.bad("ethercat", "foe-write", "eth:m0", "-p", "0", "new", "firmware", "--boot"),
        )

    def test_watchdogs_turn_outputs_off_when_the_master_is_killed_and_a_new_one_reaches_OP(self):
        node = self.node()
        self.assertRegex(
            self.said(node),
            r"^EtherCAT line of 2 slaves on eth:s0 \(raw Ethernet\); press Ctrl-C to end\n   0  servo\n   1  servo\n",
        )
        machine = self.machine()
        self.both("*.active", "TRUE")
        for slave in "01":
            self.expect(node, rf"slave {slave} \(servo\): OP\n")
        machine.kill()
        machine.wait()
        for slave in "01":
            self.expect(node, rf"slave {slave} \(servo\): SAFE-OP, error 0x001B: ")
        operational = len(re.findall(r"slave 0 \(servo\): OP\n", self.said(node)))
        self.machine()
        self.expect(node, r"slave 0 \(servo\): OP\n", operational + 1)
        self.both("*.active", "TRUE")
        self.assertEqual(0, self.end(node, signal.SIGINT))
        self.assertRegex(
            self.said(node), r"\n\d+\.\d s: [1-9]\d* frames passed, [1-9]\d* sent, \d+ lost here\n$"
        )

    def test_machine_reports_a_killed_line_and_starts_it_again(self):
        node, machine = self.node(), self.machine()
        self.both("*.active", "TRUE")
        node.kill()
        node.wait()
        self.both("*.active", "FALSE")
        self.both("ethercat.0.*.operational", "FALSE")
        for axis in ("left", "right"):
            self.expect(machine, rf"slave \d \({axis}\)")
        self.node()
        self.both("ethercat.0.*.operational", "TRUE")
        self.assertEqual(
            ["FALSE"] * 2,
            [self.pin("left.active"), self.pin("right.active")],
            "an axis stays off until it is switched on again",
        )

    def test_ends_by_itself_and_on_SIGTERM(self):
        self.assertRegex(
            self.good("node", "ethercat", "servo.line", "--link", "eth:s0", "--for", "50ms"),
            r"\n0\.\d s: 0 frames passed, 0 sent, 0 lost here\n$",
        )
        self.assertEqual(0, self.end(self.node(), signal.SIGTERM))

    def test_an_interface_that_is_missing(self):
        self.assertIn(
            "nothere", self.bad("node", "ethercat", "servo.line", "--link", "eth:nothere")
        )


class BringUp(Case):
    def run_script(self, *words):
        machines, read_only = machines_elsewhere(self.folder)
        done = subprocess.run(
            [*read_only, machines / "ethercat-servo/bring-up", *words],
            cwd=self.folder,
            env={**self.environment, "HAL": str(HAL), "TMPDIR": str(self.folder)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=120,
        )
        if done.returncode == 77 or "not to be had" in done.stdout:
            self.skipTest("no network namespaces here: " + done.stdout.strip())
        return done

    def test_drives_are_on_over_two_namespaces(self):
        if SANITIZED:
            self.skipTest("a master under a sanitizer misses its cycles")
        done = self.run_script("1")
        self.assertRegex(
            done.stdout, r"bring-up: after \d+ s: left drive on: TRUE, right drive on: TRUE\n"
        )
        if done.returncode != 0:  # possible on a busy machine, with the reason
            return self.assertIn(
                "a drive is off: it was lost, or missed the frames of ten cycles", done.stdout
            )
        self.assertRegex(
            done.stdout,
            r"at the end: drives on: TRUE; velocity -?\d+ and -?\d+ counts/s; clocks within \d+ ns; frames sent [1-9]\d*, lost \d+; ",
        )

    def test_an_unexpected_word(self):
        done = self.run_script("fast")
        self.assertEqual(
            (1, "bring-up: invalid argument 'fast'; write bring-up [SECONDS]\n"),
            (done.returncode, done.stdout),
        )


class WrongWords(Case):
    def test_each_prints_what_to_type(self):
        self.write("good.line", "servo\n")
        self.write("bad.line", "coupler\nservoo axes=2\nservo axes=9\n")
        self.write("empty.line", "# nothing\n")
        say = "hal node ethercat: "
        self.assertEqual(
            say
            + "missing --link; add --link eth:enp3s0, the interface towards the master, or --link udp:127.0.0.1 for one on this machine\n",
            self.bad("node", "ethercat", "good.line"),
        )
        self.assertEqual(
            say + "cannot read 'none.line': No such file or directory\n",
            self.bad("node", "ethercat", "none.line", "--link", "eth:m0"),
        )
        first, second = self.bad("node", "ethercat", "bad.line", "--link", "eth:m0").splitlines()
        self.assertRegex(
            first,
            r"^hal node ethercat: bad\.line:2:1: unknown device 'servoo'; use one of: coupler, digital_in, ",
        )
        self.assertRegex(
            second,
            r"^hal node ethercat: bad\.line:3:7: invalid value '9' of axes; use 1\.\.8; options of servo: ",
        )
        self.assertEqual(
            say + "empty.line: the line has no device; write one device per line\n",
            self.bad("node", "ethercat", "empty.line", "--link", "eth:m0"),
        )
        fault = lambda text: self.bad(
            "node", "ethercat", "good.line", "--link", "eth:m0", "--fault", text
        )
        self.assertEqual(
            say + "invalid --fault 'corrupt'; write --fault 1:corrupt-every=9\n", fault("corrupt")
        )
        self.assertEqual(
            say + "--fault 1:drift=1: no slave 1; the last one of 1 is 0\n", fault("1:drift=1")
        )
        self.assertEqual(
            say + "--fault 0:drift=x: invalid drift 'x'; write -1000..1000 ppm\n",
            fault("0:drift=x"),
        )
        self.assertEqual(
            say + "--fault 0:lose-every=0: invalid number '0'; write 1..1000000000\n",
            fault("0:lose-every=0"),
        )
        self.assertEqual(
            say
            + "--fault 0:loose-every=2: unknown fault 'loose-every'; write one of: lose-every, corrupt-every, double-every, noise-every, drift\n",
            fault("0:loose-every=2"),
        )
        self.assertEqual(
            say
            + "'sim:line' is a segment in memory, which other programs cannot open; write --link eth:enp3s0, or emulate the line in the "
            "netlist of the master: loadrt ethercat_segment link=sim:line\n",
            self.bad("node", "ethercat", "good.line", "--link", "sim:line"),
        )


if __name__ == "__main__":
    own_network()
    unittest.main()
