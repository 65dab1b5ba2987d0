# SPDX-License-Identifier: MIT
# packages: ethercat
"""EtherCAT in UDP datagrams: a master and an emulated line as two processes of an ordinary user, without privileges and interfaces."""
import json
import os
import re
import shutil
import signal
import subprocess
import unittest

from harness import HAL, ROOT, SANITIZED, Case, free_port, wait_until

MACHINE = ROOT / "halfiles/ethercat-servo"
UNPRIVILEGED = ("setpriv", "--bounding-set=-all", "--inh-caps=-all")


class Udp(Case):
    def setUp(self):
        super().setUp()
        if SANITIZED:
            self.skipTest("a master under a sanitizer misses its cycles")
        self.link = f"udp:127.0.0.1:{free_port()}"
        self.write("servo.line", (MACHINE / "servo.line").read_text())
        self.write(
            "servo.ethercat",
            (MACHINE / "servo.ethercat").read_text().replace("sim:servo", self.link),
        )
        self.write(
            "servo.hal",
            "".join(
                line
                for line in (MACHINE / "servo.hal").read_text().splitlines(True)
                if "ethercat_segment" not in line and "ethercat-segment" not in line
            ),
        )
        self.logs = {}

    def begin(self, *words):
        log = self.folder / f"{len(self.logs)}.txt"
        before = UNPRIVILEGED if shutil.which("setpriv") and os.geteuid() == 0 else ()
        with open(log, "w", encoding="utf-8") as out:
            process = subprocess.Popen(
                [*before, str(HAL), *words],
                cwd=self.folder,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
                text=True,
            )
        self.addCleanup(self.finish, process)
        self.logs[process] = log
        return process

    @staticmethod
    def finish(process, number=signal.SIGTERM):
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

    def node(self):
        node = self.begin("node", "ethercat", "servo.line", "--link", self.link)
        self.expect(node, "press Ctrl-C to end")
        return node

    def machine(self):
        return self.begin("run", "--name", "servo", "--no-picture", "servo.hal")

    def pin(self, name):
        return self.run_program("shell", "--name", "servo", "-s", "getp", name).stdout.strip()

    def both(self, pin, value):
        wait_until(
            lambda: all(self.pin(pin.replace("*", axis)) == value for axis in ("left", "right")),
            f"{pin} is {value}",
        )

    def test_drives_are_operated_by_another_process_and_again_after_it_was_killed(self):
        node, machine = self.node(), self.machine()
        self.assertRegex(
            self.said(node),
            rf"^EtherCAT line of 2 slaves on {self.link} \(frames in UDP datagrams\); press Ctrl-C to end\n",
        )
        self.both("*.active", "TRUE")
        for slave in "01":
            self.expect(node, rf"slave {slave} \(servo\): OP\n")
        scan = json.loads(self.good("ethercat", "slaves", self.link, "--json"))
        self.assertEqual(2, len(scan))
        dump = self.begin("ethercat", "dump", self.link, "--count", "3")
        self.assertEqual(
            0, self.finish(dump, 0) if dump.poll() is None else dump.returncode, self.said(dump)
        )
        self.assertEqual(3, len(re.findall(r"  <-  ", self.said(dump))), self.said(dump))

        node.kill()
        node.wait()
        self.expect(
            machine,
            rf"{self.link} has no link: no program listens there; emulate a line, as in: hal node ethercat FILE --link {self.link}\n",
        )
        self.both("ethercat.0.*.operational", "FALSE")
        node = self.node()
        self.expect(machine, rf"{self.link} has a link again\n")
        self.both("ethercat.0.*.operational", "TRUE")
        self.assertEqual(0, self.finish(node, signal.SIGINT))
        self.assertRegex(
            self.said(node), r"\n\d+\.\d s: [1-9]\d* frames passed, [1-9]\d* sent, \d+ lost here\n$"
        )

    def test_commands_work_without_a_machine(self):
        self.write("servo.line", "servo alias=5\nmailbox_device\n")
        self.node()
        self.assertEqual(
            "0        5:0   INIT     + Halcyon servo\n1        5:1   INIT     + Halcyon mailbox_device\n",
            self.good("ethercat", "slaves", self.link),
        )
        self.assertRegex(
            self.good("ethercat", "upload", self.link, "-p", "0", "0x1018", "1"), "^0x00ffffff "
        )
        self.assertIn("PRE-OP", self.good("ethercat", "states", self.link))

    def test_a_long_line_is_scanned_in_few_frames(self):
        self.write("servo.line", "coupler\n" + "servo alias=7\n" * 29)
        node = self.node()
        slaves = json.loads(self.good("ethercat", "slaves", self.link, "--json"))
        scanned = json.loads(self.good("ethercat", "scan", self.link, "--json"))
        self.assertEqual(
            (["Halcyon coupler"] + ["Halcyon servo"] * 29, ["INIT"] * 30, [0] + [7] * 29),
            tuple([slave[key] for slave in slaves] for key in ("name", "state", "alias")),
        )
        self.assertEqual([0xFFFFFF] * 30, [slave["vendor"] for slave in slaves])
        self.assertEqual([None, *range(29)], [slave["parent"] for slave in scanned])
        self.finish(node)
        frames = int(re.search(r"(\d+) frames passed", self.said(node))[1])
        self.assertLess(frames, 3000, "both together; one datagram in a frame takes 20000")

    def test_a_second_master_is_named(self):
        self.node()
        self.machine()
        self.both("*.active", "TRUE")
        self.assertEqual(
            f"hal ethercat upload: another EtherCAT master is active on {self.link}, and this command changes states; stop it, or, for objects, use its "
            f"mailbox gateway: gateway:127.0.0.1 instead of {self.link}\n",
            self.bad("ethercat", "upload", self.link, "-p", "0", "0x1018", "1"),
        )

    def test_errors_name_what_to_type(self):
        say = "hal node ethercat: "
        self.assertEqual(
            f"hal ethercat slaves: {self.link} has no link: no program listens there; emulate a line, as in: hal node ethercat FILE --link {self.link}\n",
            self.bad("ethercat", "slaves", self.link),
        )
        self.assertEqual(
            say
            + "udp:192.0.2.1: 192.0.2.1 is not an address of this machine; to listen on all of them, write udp:0.0.0.0\n",
            self.bad("node", "ethercat", "servo.line", "--link", "udp:192.0.2.1"),
        )
        self.node()
        self.assertEqual(
            say
            + f"{self.link}: cannot listen on {self.link[4:]}: Address already in use; to find the program that does: ss -ulpn\n",
            self.bad("node", "ethercat", "servo.line", "--link", self.link),
        )


class Capture(Case):
    """The frames of a capture are listed, and its slaves answer a master."""

    def setUp(self):
        super().setUp()
        self.write(
            "record.hal",
            "loadrt threads name1=bus period1=1000000\nloadrt ethercat_segment devices=servo link=sim:line\n"
            "loadrt ethercat config=one.ethercat\nloadrt segment_record link=sim:line file=seen.pcapng\n"
            "addf ethercat.0.receive bus\naddf ethercat.0.transmit bus\naddf ethercat-segment.0.update bus\naddf segment-record.0.update bus\n"
            "start\nadvance 500ms\n",
        )
        self.write(
            "one.ethercat",
            "[bus]\nlink = sim:line\ncycle = 1ms\n[slave 0 x]\nvendor = 0x00ffffff\ndevice = cia402\noutputs = 6040 607A\ninputs = 6041 6064\n",
        )
        self.run_program("sim", "record.hal")
        self.assertTrue((self.folder / "seen.pcapng").stat().st_size > 1000)

    def test_dump_lists_it_at_once_or_at_its_times(self):
        at_once = self.good("ethercat", "dump", "seen.pcapng", "--count", "20")
        self.assertEqual(20, len(at_once.splitlines()))
        self.assertEqual(
            [line.split("  ", 2)[-1] for line in at_once.splitlines()],
            [
                line.split("  ", 2)[-1]
                for line in self.good(
                    "ethercat", "dump", "replay:seen.pcapng", "--count", "20"
                ).splitlines()
            ],
        )

    def test_dump_states_the_direction_in_a_capture(self):
        lines = self.good("ethercat", "dump", "seen.pcapng", "--count", "20").splitlines()
        self.assertEqual(10 * ["->", "<-"], [line.split()[1] for line in lines])

    def test_the_slaves_of_a_capture_answer_a_master(self):
        self.write(
            "again.hal",
            "loadrt threads name1=bus period1=1000000\nloadrt ethercat config=one.ethercat link=replay:seen.pcapng\n"
            "addf ethercat.0.receive bus\naddf ethercat.0.transmit bus\nstart\nadvance 2s\ngetp ethercat.0.x.operational\n",
        )
        done = self.run_program("sim", "again.hal")
        self.assertEqual("TRUE\n", done.stdout, done.stderr)
        self.assertIn("on replay:seen.pcapng\n", done.stderr)

    def test_a_capture_without_answers_is_rejected(self):
        self.write(
            "other.hal",
            "loadrt threads name1=bus period1=1000000\nloadrt segment_record link=sim:net0/recorder file=other.pcapng\n"
            'loadrt tdma link=sim:net0/master station=master schedule="master:; cycle 1000; slot 0 100"\n'
            "addf tdma.0.receive bus\naddf tdma.0.transmit bus\naddf segment-record.0.update bus\nstart\nadvance 50ms\n",
        )
        self.run_program("sim", "other.hal")
        self.write(
            "none.hal",
            "loadrt threads name1=bus period1=1000000\nloadrt ethercat config=one.ethercat link=replay:other.pcapng\n"
            "addf ethercat.0.receive bus\naddf ethercat.0.transmit bus\nstart\n",
        )
        self.assertIn(
            "'ethercat.0' (ethercat) cannot start: other.pcapng has no EtherCAT frame that returned from slaves; capture both "
            "directions at the interface of the master: tcpdump -i eth0 -w bus.pcap ether proto 0x88a4 [start-failed]\n",
            self.bad("sim", "none.hal"),
        )

    def test_a_master_and_a_line_need_somebody_at_the_other_end(self):
        words = "replay:seen.pcapng is a capture, whose slaves answer a master only; to see what is in it: hal ethercat dump FILE"
        self.assertEqual(
            f"hal ethercat scan: {words}\n", self.bad("ethercat", "scan", "replay:seen.pcapng")
        )
        self.write("a.line", "servo\n")
        self.assertEqual(
            "hal node ethercat: 'replay:seen.pcapng' is a capture, which no master can reach; write --link eth:enp3s0 or --link udp:127.0.0.1\n",
            self.bad("node", "ethercat", "a.line", "--link", "replay:seen.pcapng"),
        )


if __name__ == "__main__":
    unittest.main()
