# SPDX-License-Identifier: MIT
# packages: canopen ethercat scocan tdma
"""Buses after every kind of stop: an exception, a hang, a process without CPU, a lost partner. `operational` is FALSE meanwhile, the bus
returns by itself once the thread runs again, and an axis needs another edge of its enable."""
import os
import random
import re
import signal
import socket
import subprocess
import unittest

from harness import HAL, ROOT, SANITIZED, Case, wait_until

HALFILES = ROOT / "halfiles"
THROW = "setp s.mode 5\nadvance 100ms\n"
RESET = "sets reset-button TRUE\nadvance 100ms\nsets reset-button FALSE\n"
# of the README of each machine: the bus, what is on, how to lose a node and how it returns, how to switch on again
MACHINES = {
    "ethercat-servo/servo.hal": (
        "ethercat.0.all-op",
        "right-on",
        "setp ethercat-segment.0.slave-1.power {}",
        ("FALSE", "TRUE"),
        "sets on FALSE\nadvance 100ms\nsets on TRUE\n",
    ),
    "ethercat-cnc/cnc.hal": (
        "ethercat.0.all-op",
        "machine-on",
        "setp ethercat-segment.0.slave-1.power {}",
        ("FALSE", "TRUE"),
        RESET,
    ),
    "canopen-axis/axis.hal": (
        "canopen.0.operational",
        "x-active",
        "setp canopen-drive.0.power {}",
        ("FALSE", "TRUE"),
        "sets x-on FALSE\nadvance 100ms\nsets x-on TRUE\n",
    ),
    "canopen-arm/arm.hal": (
        "canopen.0.operational",
        "all-following",
        "setp canopen-drive.2.power {}",
        ("FALSE", "TRUE"),
        RESET,
    ),
    "canopen-robot/robot.hal": (
        "canopen.0.operational",
        "moving",
        "setp canopen-drive.0.fault-no-heartbeat {}",
        ("1", "0"),
        "setp boot-wait.in FALSE\nadvance 100ms\nsetp boot-wait.in TRUE\n",
    ),
    "ethernet-cnc/cnc.hal": (
        "canopen.0.operational",
        "machine-on",
        "setp y-node.power {}",
        ("FALSE", "TRUE"),
        RESET,
    ),
    "ethernet-furuta/furuta.hal": (
        "canopen.0.operational",
        "motor-enable",
        "setp canopen-axis-io.0.power {}",
        ("FALSE", "TRUE"),
        RESET,
    ),
}


class AfterAnException(Case):
    """On the virtual clock: every run is the same."""

    def sim(self, text, *options):
        self.write("a.hal", text)
        done = self.run_program("sim", *options, "a.hal")
        self.assertEqual(0, done.returncode, done.stdout + done.stderr)
        return done.stdout.splitlines()

    def machine(self, name, bus, drive, enable):
        pins = [f"{bus}.operational", f"{drive}.enabled", f"{drive}.fault"]
        ask = "".join(f"getp {pin}\n" for pin in pins)
        before, stopped, back, on = (
            self.sim(
                f"source {HALFILES / name}\nloadrt stall names=s\naddf s servo-thread\nadvance 1s\n"
                + ask
                + THROW
                + ask
                + "start\nadvance 1s\n"
                + ask
                + f"sets {enable} FALSE\nadvance 200ms\nsets {enable} TRUE\nadvance 500ms\n"
                + ask
            )[3 * n : 3 * n + 3]
            for n in range(4)
        )
        self.assertEqual(["TRUE", "TRUE", "FALSE"], before, "before")
        self.assertEqual(["FALSE", "FALSE", "FALSE"], stopped, "stopped")
        self.assertEqual(["TRUE", "FALSE", "FALSE"], back, "after start")
        self.assertEqual(["TRUE", "TRUE", "FALSE"], on, "after another edge of enable")

    def test_ethercat(self):
        self.machine("ethercat-servo/servo.hal", "ethercat.0.left", "left", "on")

    def test_canopen(self):
        self.machine("canopen-axis/axis.hal", "canopen.0.x", "x", "x-on")

    def test_the_ways_back_of_the_machines(self):
        for name, (bus, on, loss, (lost, there), switch_on) in MACHINES.items():
            ask = f"getp {bus}\ngets {on}\n"
            with self.subTest(name):
                answers = self.sim(
                    f"source {HALFILES / name}\nadvance 5s\n{ask}"
                    f"stop\nadvance 1s\nstart\nadvance 5s\n{ask}{switch_on}advance 5s\n{ask}"
                    f"{loss.format(lost)}\nadvance 1s\n{ask}{loss.format(there)}\nadvance 5s\n{ask}{switch_on}advance 5s\n{ask}"
                )
                self.assertEqual(["TRUE", "TRUE"], answers[0:2], "at first")
                self.assertEqual(["TRUE", "FALSE"], answers[2:4], "after stop and start")
                self.assertEqual(["TRUE", "TRUE"], answers[4:6], "switched on again")
                self.assertEqual(["FALSE", "FALSE"], answers[6:8], "a node is lost")
                self.assertEqual(["TRUE", "FALSE"], answers[8:10], "it is back")
                self.assertEqual(
                    ["TRUE", "TRUE"], answers[10:12], "switched on again after the loss"
                )

    def test_the_way_back_of_the_robot_on_time_slots(self):
        ask = "getp scocan.1.running\ngetp estop.ok-out\n"
        switch_on = "setp estop.reset TRUE\nadvance 100ms\nsetp estop.reset FALSE\nadvance 1s\n"
        answers = self.sim(
            f"source {HALFILES / 'yair/yair.hal'}\nadvance 300ms\n{switch_on}{ask}"
            f"stop\nadvance 1s\n{ask}start\nadvance 3s\n{ask}{switch_on}{ask}"
            f"sets emergency TRUE\nadvance 500ms\nsets emergency FALSE\nadvance 500ms\n{ask}{switch_on}{ask}",
            "-i",
            HALFILES / "yair/yair.ini",
        )
        self.assertEqual(
            [
                "TRUE",
                "TRUE",
                "FALSE",
                "FALSE",
                "TRUE",
                "FALSE",
                "TRUE",
                "TRUE",
                "TRUE",
                "FALSE",
                "TRUE",
                "TRUE",
            ],
            answers,
        )

    def test_a_tdma_master_listens_before_it_leads_again(self):
        answers = self.sim(
            "loadrt threads name1=alone period1=1000000 name2=servo period2=1000000\n"
            'loadrt tdma link=sim:cell/master,sim:cell/first,sim:cell/x station=master,first,x schedule="master:; cycle 1000; slot 0 100; '
            'backup-master:; name first; backup-offset 60; slot 0 200; slave:; name x; slot 0 300"\nloadrt stall names=s\n'
            "addf tdma.0.receive alone\naddf s alone\naddf tdma.0.transmit alone\n"
            "addf tdma.1.receive servo\naddf tdma.2.receive servo\naddf tdma.1.transmit servo\naddf tdma.2.transmit servo\n"
            "start\nadvance 1s\ngetp tdma.0.leading\n"
            + THROW
            + "getp tdma.0.leading\ngetp tdma.0.running\ngetp tdma.1.leading\ngetp tdma.2.running\nadvance 60s\n"
            "start\nadvance 1ms\ngetp tdma.0.leading\nadvance 2s\n"
            "getp tdma.0.leading\ngetp tdma.1.leading\ngetp tdma.2.running\ngetp tdma.2.losses\ngetp tdma.1.losses\n"
        )
        self.assertEqual(
            ["TRUE", "FALSE", "FALSE", "TRUE", "TRUE", "FALSE", "TRUE", "FALSE", "TRUE", "0", "0"],
            answers,
        )

    def test_a_scocan_sync_node_listens_before_it_leads_again(self):
        table = (
            'table="node clock A sync; node spare A backup 1; node motor A; mode 0 run; 0 sync; 2 private motor 0x10A; '
            'message position 0x10A fields a:s32"'
        )
        answers = self.sim(
            "loadrt threads name1=alone period1=500000 name2=bus period2=500000\n"
            f"loadrt scocan_sync link=sim:robot,sim:robot node=clock,spare {table}\nloadrt scocan link=sim:robot node=motor {table}\n"
            "loadrt stall names=s\naddf scocan-sync.0.receive alone\naddf s alone\naddf scocan-sync.0.transmit alone\n"
            "addf scocan-sync.1.receive bus\naddf scocan.0.receive bus\naddf scocan-sync.1.transmit bus\naddf scocan.0.transmit bus\n"
            "start\nadvance 1s\ngetp scocan-sync.0.leading\n"
            + THROW
            + "getp scocan-sync.0.leading\ngetp scocan-sync.0.running\ngetp scocan-sync.1.leading\ngetp scocan.0.running\nadvance 60s\n"
            "start\nadvance 1ms\ngetp scocan-sync.0.leading\nadvance 2s\n"
            "getp scocan-sync.0.leading\ngetp scocan-sync.1.leading\ngetp scocan.0.running\ngetp scocan.0.foreign\n"
        )
        self.assertEqual(
            ["TRUE", "FALSE", "FALSE", "TRUE", "TRUE", "FALSE", "TRUE", "FALSE", "TRUE", "0"],
            answers,
        )


class Live(Case):
    """On the system's clock, with the processes and signals of the system."""

    def setUp(self):
        super().setUp()
        if SANITIZED:
            self.skipTest("a master under a sanitizer misses its cycles")
        self.logs = {}

    def begin(self, *words):
        log = self.folder / f"{len(self.logs)}.txt"
        with open(log, "w", encoding="utf-8") as out:
            process = subprocess.Popen(
                [str(HAL), *words],
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
    def finish(process):
        if process.poll() is None:
            process.send_signal(signal.SIGCONT)
            process.send_signal(signal.SIGTERM)
        return process.wait(60)

    def said(self, process):
        return self.logs[process].read_text()

    def expect(self, process, pattern, times=1):
        wait_until(
            lambda: len(re.findall(pattern, self.said(process))) >= times,
            f"{pattern} in {self.said(process)}",
        )

    @staticmethod
    def kill(process):
        process.kill()
        process.wait(60)

    def switch_on(self, enable, *axes):
        """Switches on as the READMEs describe, and again where a busy host lost a drive in between."""

        def are_on():
            self.say("sets", enable, "FALSE")
            beat = int(self.value("servo-thread.threadbeat"))
            wait_until(
                lambda: int(self.value("servo-thread.threadbeat")) > beat + 1, "a cycle sees it"
            )
            self.say("sets", enable, "TRUE")
            for axis in axes:
                wait_until(
                    lambda: "TRUE" in (self.value(f"{axis}.active"), self.value(f"{axis}.fault")),
                    f"{axis} is on, or reports why not",
                )
            return all(self.value(f"{axis}.active") == "TRUE" for axis in axes)

        wait_until(are_on, f"{axes} are on")

    def slaves_are(self, node, state):
        """Waits until the newest line about each slave of a `hal node ethercat` is that state, without an error."""

        def newest(slave):
            return (re.findall(rf"slave {slave} \(servo\): (.*)\n", self.said(node)) or [""])[-1]

        for slave in "01":
            wait_until(
                lambda: newest(slave) == state, f"slave {slave} is in {state}: {self.said(node)}"
            )

    def all_are(self, pins, value):
        for pin in pins:
            self.comes(pin, value)

    def say(self, *words):
        """As in Case, and again while a thread gets no CPU time on a busy host: an edit that it does not take is withdrawn."""
        done = wait_until(
            lambda: (result := self.shell(*words))
            and not re.search(r"\[(silent|starved|hung)-thread\]", result.stderr)
            and result,
            f"{words} takes effect",
        )
        self.assertEqual((0, ""), (done.returncode, done.stderr), done.stdout)
        return done.stdout

    def start_again(self, pins):
        """Starts the threads until the pins are TRUE, and again where a busy host has stopped a thread in between."""

        def are_true():
            if self.shell("start").returncode != 0:
                return False  # the function has not returned yet, or the thread gets no CPU time
            return all(self.value(pin) == "TRUE" for pin in pins)

        wait_until(are_true, f"{pins} are TRUE after start")

    def suspend(self, process):
        """Stops a process until the machine has noticed that it had no CPU."""
        process.send_signal(signal.SIGSTOP)
        with self.assertRaises(subprocess.TimeoutExpired):
            process.wait(0.4)  # longer than the limit of 100 ms
        process.send_signal(signal.SIGCONT)

    def hung(self, times):
        wait_until(
            lambda: len(
                re.findall(
                    "hung-thread|starved-thread", self.shell("--json", "show", "fault").stdout
                )
            )
            >= times,
            "the hang is a fault",
        )

    def throws(self):
        """Waits for the exception of `s`. A thread that a busy host has stopped before is started, as its functions do not run."""

        def has_thrown():
            is_stopped = float(self.value("s.out")) < 0
            if "threw an exception" in self.shell("show", "fault").stdout:
                return True
            if is_stopped:
                self.shell("start")
            return False

        wait_until(has_thrown, "the exception is a fault")

    def after_every_stop(self, name, bus, drive, enable):
        operational, on = [f"{b}.operational" for b in bus], [f"{d}.enabled" for d in drive]

        def comes_back():
            self.start_again(operational)
            for pin in on:
                self.assertEqual("FALSE", self.value(pin), pin)
            for d in drive:
                self.assertEqual("FALSE", self.value(f"{d}.fault"), d)
            self.switch_on(enable, *drive)

        self.write(
            "a.hal", f"source {HALFILES / name}\nloadrt stall names=s\naddf s servo-thread\n"
        )
        machine = self.begin("run", "--no-picture", "a.hal")
        self.all_are(on, "TRUE")

        self.say("stop")
        self.all_are(operational + on, "FALSE")
        comes_back()

        self.suspend(machine)
        self.hung(1)
        self.all_are(operational + on, "FALSE")
        comes_back()

        self.say("setp", "s.ms", "400")
        self.say("setp", "s.mode", "4")
        self.hung(2)
        self.all_are(operational + on, "FALSE")
        comes_back()

        self.say("setp", "s.mode", "5")
        self.throws()
        self.all_are(operational + on, "FALSE")
        comes_back()

    def test_ethercat(self):
        self.after_every_stop(
            "ethercat-servo/servo.hal",
            ["ethercat.0.left", "ethercat.0.right"],
            ["left", "right"],
            "on",
        )

    def test_canopen(self):
        self.after_every_stop("canopen-axis/axis.hal", ["canopen.0.x"], ["x"], "x-on")

    def stations(self, text, leading, running):
        self.write("a.hal", text + "loadrt stall names=s\naddf s servo\nstart\n")
        machine = self.begin("run", "--no-picture", "a.hal")
        self.all_are([leading, *running], "TRUE")
        self.say("stop")
        self.all_are([leading, *running], "FALSE")
        self.start_again([leading, *running])
        self.suspend(machine)
        self.hung(1)
        self.all_are([leading, *running], "FALSE")
        self.start_again([leading, *running])
        self.say("setp", "s.ms", "400")
        self.say("setp", "s.mode", "4")
        self.hung(2)
        self.all_are([leading, *running], "FALSE")
        self.start_again([leading, *running])

    def test_tdma(self):
        self.stations(
            "loadrt threads name1=servo period1=1000000\n"
            'loadrt tdma link=sim:cell/master,sim:cell/x station=master,x schedule="master:; cycle 1000; lost 20; slot 0 100; slave:; name x; slot 0 200"\n'
            "addf tdma.0.receive servo\naddf tdma.1.receive servo\naddf tdma.0.transmit servo\naddf tdma.1.transmit servo\n",
            "tdma.0.leading",
            ["tdma.0.running", "tdma.1.running"],
        )

    def test_scocan(self):
        table = 'table="node clock A sync; node motor A; mode 0 run; 0 sync; 2 private motor 0x10A; message position 0x10A fields a:s32"'
        self.stations(
            "loadrt threads name1=servo period1=500000\n"
            f"loadrt scocan_sync link=sim:robot node=clock {table}\nloadrt scocan link=sim:robot node=motor {table}\n"
            "addf scocan-sync.0.receive servo\naddf scocan.0.receive servo\naddf scocan-sync.0.transmit servo\n"
            "addf scocan.0.transmit servo\n",
            "scocan-sync.0.leading",
            ["scocan-sync.0.running", "scocan.0.running"],
        )

    def test_ethercat_drives_in_another_process(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            link = f"udp:127.0.0.1:{probe.getsockname()[1]}"
        servo = HALFILES / "ethercat-servo"
        self.write("servo.line", (servo / "servo.line").read_text())
        # without watchdogs and SYNC signals: what takes a drive out of OP is the master
        self.write(
            "servo.ethercat",
            (servo / "servo.ethercat")
            .read_text()
            .replace("sim:servo", link)
            .replace("dc      = sync0\n", "outputs.watchdog = no\n")
            # slow: the drives have no real-time priority on a busy host
            .replace("cycle = 1ms\n", "cycle = 10ms\nframe-timeout = 200ms\n"),
        )
        self.write(
            "servo.hal",
            "".join(
                line
                for line in (servo / "servo.hal")
                .read_text()
                .replace("=1000000", "=10000000")
                .splitlines(True)
                if "ethercat_segment" not in line and "ethercat-segment" not in line
            ),
        )
        node = self.begin("node", "ethercat", "servo.line", "--link", link)
        self.expect(node, "press Ctrl-C to end")
        machine = self.begin("run", "--no-picture", "servo.hal")
        operational = ["ethercat.0.left.operational", "ethercat.0.right.operational"]
        on = ["left.active", "right.active"]
        self.all_are(operational, "TRUE")
        self.switch_on("on", "left", "right")
        self.slaves_are(node, "OP")

        self.say("stop")
        self.slaves_are(node, "SAFE-OP")  # without an error: as commanded
        self.start_again(operational)
        self.slaves_are(node, "OP")

        self.suspend(machine)
        self.slaves_are(node, "SAFE-OP")
        self.start_again(operational)
        self.slaves_are(node, "OP")
        self.switch_on("on", "left", "right")

        # the drives are gone for a while: a fault of the axes, and the way back of the README
        node.send_signal(signal.SIGSTOP)
        self.all_are(operational + on, "FALSE")
        self.all_are(["left.fault", "right.fault"], "TRUE")
        node.send_signal(signal.SIGCONT)
        self.all_are(operational, "TRUE")
        self.switch_on("on", "left", "right")

        # the master is killed, and another one started
        self.kill(machine)
        self.begin("run", "--no-picture", "servo.hal")
        self.all_are(operational, "TRUE")
        self.switch_on("on", "left", "right")

    def test_a_canopen_drive_in_another_process(self):
        place = random.Random(os.urandom(8))
        bus = f"udp:239.{place.randrange(1, 255)}.{place.randrange(256)}.{place.randrange(1, 255)}%lo:{place.randrange(20000, 60000)}"
        axis = HALFILES / "canopen-axis"
        # slow and at rest: the drive has no real-time priority on a busy host
        self.write(
            "axis.canopen",
            (axis / "axis.canopen").read_text().replace("sim:axis", bus).replace("50ms", "1s"),
        )
        self.write(
            "axis.hal",
            "".join(
                line
                for line in (axis / "axis.hal")
                .read_text()
                .replace("amplitude        50", "amplitude 0")
                .splitlines(True)
                if "canopen_drive" not in line and "canopen-drive" not in line
            ),
        )
        node = self.begin("node", "drive", "--id", "2", "--link", bus)
        self.expect(node, "pre-operational")
        machine = self.begin("run", "--no-picture", "axis.hal")
        self.comes("x.active", "TRUE")

        self.say("stop")
        self.expect(node, "pre-operational", 2)  # commanded at once
        self.start_again(["canopen.0.x.operational"])
        self.assertEqual("FALSE", self.value("x.enabled"))
        self.switch_on("x-on", "x")

        self.suspend(machine)
        self.hung(1)
        self.all_are(
            ["canopen.0.operational", "canopen.0.x.operational", "canopen.0.x.online", "x.enabled"],
            "FALSE",
        )
        self.start_again(["canopen.0.x.operational"])
        self.assertEqual("FALSE", self.value("x.enabled"))
        self.switch_on("x-on", "x")

        # the drive is gone for a while
        node.send_signal(signal.SIGSTOP)
        self.all_are(["canopen.0.x.operational", "x.enabled"], "FALSE")
        self.comes("x.fault", "TRUE")
        node.send_signal(signal.SIGCONT)
        self.comes("canopen.0.x.operational", "TRUE")
        self.switch_on("x-on", "x")

        # the master is killed, and another one started
        self.kill(machine)
        self.begin("run", "--no-picture", "axis.hal")
        self.comes("canopen.0.x.operational", "TRUE")
        self.switch_on("x-on", "x")


if __name__ == "__main__":
    unittest.main()
