# SPDX-License-Identifier: MIT
# packages: canopen
"""Machines on buses, executed again from their journal: what links gave them, and the order of the calls on a bus in memory."""

import os
import random
import re
import shutil
import signal
import subprocess
import sys
import unittest

from harness import HAL, ROOT, SANITIZED, Case, needs_package, wait_until

AXIS = ROOT / "halfiles" / "canopen-axis"

# The master and its drive are in two threads, on a bus that loses frames. Real-time threads of other
# tests on the same CPU must not starve one of them, nor may a host that is suspended for 100 ms stop it.
TWO_THREADS = """loadrt threads name1=fast period1=500000 policy1=other supervise1=60s name2=servo period2=1000000 policy2=other supervise2=60s
loadrt canopen config=axis.canopen
loadrt canopen_drive link=sim:axis id=2
loadrt can_faults link=sim:axis faults=loss:every=50
addf canopen.0.receive servo
addf canopen.0.transmit servo
addf canopen-drive.0.update fast
addf can-faults.0.update fast
"""

# Masters in two threads share one link. With short periods they often want it at the same time.
SHARED_LINK = """loadrt threads name1=fast period1=100000 supervise1=60s name2=servo period2=200000 supervise2=60s
loadrt canopen config=axis.canopen,io.canopen,more.canopen
loadrt canopen_drive link=sim:axis id=2
loadrt canopen_io link=sim:axis id=3,4
addf canopen.0.receive servo
addf canopen.0.transmit servo
addf canopen.1.receive fast
addf canopen.1.transmit fast
addf canopen.2.receive servo
addf canopen.2.transmit servo
addf canopen-drive.0.update fast
addf canopen-io.0.update servo
addf canopen-io.1.update fast
"""

IO = """[bus]
link = sim:axis
bitrate = 1M
sync = 1ms
reset-at-start = no
[node {id} io]
device = cia401
tpdo1 = read-inputs-1
rpdo1 = write-outputs-1
"""

# Its thread is in a call on the bus most of the time. With a sanitizer it takes ten times as long, and so does writing the journal.
BUSY_BUS = f"""loadrt threads name1=servo period1={1000000 if SANITIZED else 100000}
loadrt can_traffic names=a,b,c,d link=sim:busy one_node=1 id=0x200 messages=20
addf a.update servo
addf b.update servo
addf c.update servo
addf d.update servo
start
"""

# The only node of its bus: nothing acknowledges its frames.
LONELY = """loadrt threads name1=servo period1=1000000
loadrt can_traffic names=a link=sim:lonely id=0x200 messages=20 one_node=1
addf a.update servo
start
"""

DRIVE = """loadrt threads name1=servo period1=1000000
loadrt canopen_drive link={bus} id=2
addf canopen-drive.0.update servo
"""

# What no journal reproduces: other frames are sent.
SENDER = """loadrt threads name1=servo period1=1000000
loadrt unrecorded
loadrt conv_float_s32 names=whole
loadrt can_send link={bus} fields=value:s32
addf unrecorded.0 servo
addf whole servo
addf can-send.0.update servo
net value unrecorded.0.out => whole.in
net number whole.out => can-send.0.value
setp can-send.0.on-change TRUE
"""

STATION = """loadrt threads name1=servo period1=1000000
loadrt tdma link=eth:{port} config=cnc.tdma station={station}
addf tdma.0.receive servo
addf tdma.0.transmit servo
"""

# Links of the fast thread send in the slots of stations of the other one.
SLOTS_OF_ANOTHER_THREAD = """loadrt threads name1=fast period1=200000 policy1=other supervise1=60s name2=servo period2=1000000 policy2=other supervise2=60s
loadrt tdma link=sim:cell/clock,sim:cell/a,sim:cell/b station=clock,a,b schedule="master:; name clock; cycle 1000; slave:; name a; slot 0 300; slave:; name b; slot 0 600"
loadrt can_traffic names=much link=cane:sim:cell/a?slot=0 id=0x200 messages=20 one_node=1
loadrt can_traffic names=little link=cane:sim:cell/b?slot=0 id=0x300 messages=2 one_node=1
setp much.period 0.0004
setp little.period 0.0013
addf tdma.0.receive servo
addf tdma.1.receive servo
addf tdma.2.receive servo
addf much.update fast
addf little.update fast
addf tdma.0.transmit servo
addf tdma.1.transmit servo
addf tdma.2.transmit servo
start
"""

# Nodes of SCoCAN are in one thread, and links that send in their slots in another one.
TABLE = "bitrate 1M; cycle 10ms; node clock A sync; node a A; node b A; mode 0 run; 0 sync; 2 private a 0x10A"
SLOTS_OF_A_NODE = f"""loadrt threads name1=fast period1=200000 policy1=other supervise1=60s name2=servo period2=600000 policy2=other supervise2=60s
loadrt scocan_sync link=sim:robot node=clock table="{TABLE}"
loadrt scocan link=sim:robot,sim:robot node=a,b table="{TABLE}"
loadrt can_traffic names=much link=scocan:a one_node=1 id=0x200 messages=8
loadrt can_traffic names=little link=scocan:b one_node=1 id=0x300 messages=2
loadrt can_receive link=scocan:a,scocan:b id=0x301,0x201 fields=n:u32,m:u32
setp much.period 0.004
setp little.period 0.0013
addf scocan-sync.0.receive servo
addf scocan.0.receive servo
addf scocan.1.receive servo
addf much.update fast
addf can-receive.0.update fast
addf can-receive.1.update servo
addf little.update fast
addf scocan-sync.0.transmit servo
addf scocan.0.transmit servo
addf scocan.1.transmit servo
start
"""


class ExactReplayOfBuses(Case):
    def setUp(self):
        super().setUp()
        dice = random.Random(os.urandom(8))  # tests run side by side: each has its own bus
        group = f"239.{dice.randrange(1, 255)}.{dice.randrange(256)}.{dice.randrange(1, 255)}"
        self.bus = f"udp:{group}%lo:{dice.randrange(20000, 60000)}"

    def configure(self, bus):
        return self.write(
            "axis.canopen", (AXIS / "axis.canopen").read_text().replace("sim:axis", bus)
        )

    def load_cpus(self):
        for _ in range(2):
            busy = subprocess.Popen([sys.executable, "-c", "while True: pass"])
            self.addCleanup(busy.wait)
            self.addCleanup(busy.kill)

    def wait_for(self, pin, value):
        wait_until(lambda: self.shell("getp", pin).stdout.strip() == value, f"{pin} {value}")

    def wait_for_cycles(self, thread, count):
        start = int(self.shell("getp", f"{thread}.threadbeat").stdout)
        wait_until(
            lambda: int(self.shell("getp", f"{thread}.threadbeat").stdout) >= start + count,
            f"{count} cycles",
        )

    def finish(self, machine, status=0):
        out, error = self.end(machine)
        self.assertEqual(status, machine.returncode, out + error)

    def replay(self, status=0):
        done = self.run_program("replay", "--exact", "run.mcap")
        self.assertEqual(status, done.returncode, done.stdout + done.stderr)
        self.assertNotIn("opens again", done.stderr)
        return done.stdout

    def test_two_threads_share_a_bus_in_memory(self):
        self.configure("sim:axis")
        self.load_cpus()
        machine = self.start(
            "run",
            self.write("a.hal", TWO_THREADS),
            "--journal",
            "run.mcap",
            "--values",
            "canopen.0.x.*,canopen-drive.0.*,can-faults.0.*",
        )
        self.wait_for("canopen.0.nodes-operational", "1")
        self.wait_for_cycles("servo", 1000)
        self.finish(machine)
        text = self.replay()
        self.assertRegex(text, r"\nno difference, \d{5,} values compared\n$")
        self.assertGreater(int(re.match(r"(\d+) cycles of 2 threads", text)[1]), 2000)

    def test_two_threads_share_the_link_of_their_masters(self):
        self.configure("sim:axis")
        self.write("io.canopen", IO.format(id=3))
        self.write("more.canopen", IO.format(id=4))
        self.load_cpus()
        machine = self.start(
            "run",
            self.write("a.hal", SHARED_LINK),
            "--journal",
            "run.mcap",
            "--values",
            "canopen.*",
        )
        for number in range(3):
            self.wait_for(f"canopen.{number}.nodes-operational", "1")
        self.wait_for_cycles("servo", 20_000)
        self.finish(machine)
        text = self.replay()
        self.assertRegex(text, r"\nno difference, \d{5,} values compared\n$")
        self.assertGreater(int(re.match(r"(\d+) cycles of 2 threads", text)[1]), 40_000)

    def test_a_bus_in_memory_is_opened_and_closed_while_a_thread_uses_it(self):
        self.load_cpus()
        machine = self.start(
            "run", self.write("a.hal", BUSY_BUS), "--journal", "run.mcap", "--values", "*"
        )
        self.wait_for_cycles("servo", 100)
        pull = """loadrt can_faults link=sim:busy victim=0
addf can-faults.0.update servo
setp can-faults.0.cut TRUE
unloadrt can_faults
"""
        self.good("shell", given=pull * 60)
        self.wait_for_cycles("servo", 100)
        self.finish(machine)
        text = self.replay()
        self.assertRegex(text, r"\nno difference, \d{4,} values compared\n$")
        self.assertRegex(text, r"^\d+ cycles of 1 thread, \d{3} edits")

    def reject_edits(self):
        """Runs a machine whose bus gets further nodes with edits that are rejected or rolled back."""
        # nobody acknowledges the frames of the only node, until there is another one
        machine = self.start(
            "run", self.write("a.hal", LONELY), "--journal", "run.mcap", "--values", "*"
        )
        self.wait_for_cycles("servo", 100)
        others = "loadrt can_traffic names=b link=sim:lonely id=0x100\n"
        for end in ("loadrt can_send link=can:none-such id=5\ncommit", "nonsense\ncommit", "abort"):
            for _ in range(3):
                done = self.run_program("shell", given=f"begin\n{others}{end}\n")
                self.assertEqual("abort" not in end, done.returncode != 0, done.stderr)
                self.wait_for_cycles("servo", 20)
        self.assertGreater(int(self.shell("getp", "a.sent").stdout), 0)
        self.wait_for_cycles("servo", 100)
        self.finish(machine)

    def test_edits_that_use_a_bus_in_memory_and_are_rejected(self):
        self.reject_edits()
        self.assertRegex(self.replay(), r"\nno difference, \d{4,} values compared\n$")

    @unittest.skipIf(SANITIZED, "the heap of a sanitizer has no state")
    def test_a_test_and_a_state_behind_rejected_edits(self):
        self.reject_edits()
        for part in range(1, 10):
            at = ["--until", f"{part * 0.05:.2f}s"]
            self.good(
                "replay", "--exact", "run.mcap", *at, "--show", "a.sent", "--as-test", f"t{part}"
            )
            self.assertIn("1 value, 0 not as expected\n", self.good("replay", f"t{part}"))
            self.assertEqual(0, self.run_program("check", f"t{part}/test.hal").returncode)
            self.good("replay", "--exact", "run.mcap", *at, "--cut", f"rest{part}.mcap")
            self.assertIn("\nno difference\n", self.good("replay", "--exact", f"rest{part}.mcap"))

    @unittest.skipIf(SANITIZED, "a sanitizer has the functions of the clock and of files")
    def test_a_master_whose_node_is_killed(self):
        self.configure(self.bus)
        lines = [
            line.replace("servo-thread", "servo")
            for line in (AXIS / "axis.hal").read_text().splitlines(True)
            if "canopen_drive" not in line and "canopen-drive" not in line
        ]
        drive_file = self.write("drive.hal", DRIVE.format(bus=self.bus))

        def start_drive(name):
            return self.start("run", "--name", name, drive_file, instance=name)

        drive = start_drive("drive")
        machine = self.start(
            "run", self.write("a.hal", "".join(lines)), "--journal", "run.mcap", "--values", "x*"
        )
        self.wait_for("canopen.0.nodes-operational", "1")
        self.wait_for_cycles("servo", 300)
        drive.send_signal(signal.SIGKILL)
        drive.wait()
        self.wait_for("canopen.0.nodes-operational", "0")
        start_drive("other")
        self.wait_for("canopen.0.nodes-operational", "1")
        self.say("stop")  # its outputs are made safe, which sends frames
        self.say("start")
        self.wait_for_cycles("servo", 300)
        self.finish(machine)
        # the configuration is the one of then
        self.write("axis.canopen", "[bus]\nlink = can:nowhere\n")
        self.assertRegex(self.replay(), r"\nno difference, \d{5,} values compared\n$")
        (self.folder / "axis.canopen").unlink()
        self.replay()

    def test_other_frames_are_a_difference(self):
        machine = self.start(
            "run", self.write("a.hal", SENDER.format(bus=self.bus)), "--journal", "run.mcap"
        )
        wait_until(lambda: int(self.value("can-send.0.sent")) > 20, "frames")
        self.finish(machine)
        self.assertRegex(
            self.replay(status=1),
            r"first difference: cycle \d+ of thread 'servo' at \S+ s sends other frames on udp:",
        )

    def run_spindle(self, link, nodes=""):
        """Runs a spindle that starts, loses its line and stops."""
        folder = ROOT / "halfiles" / "modbus-spindle"
        settings = (folder / "spindle.modbus").read_text()
        self.write("spindle.modbus", settings.replace("sim:spindle", link))
        netlist = (folder / "spindle.hal").read_text()
        for line in ("loadrt modbus_node config=spindle.modbus\n", "addf modbus-node.0 servo\n"):
            netlist = netlist.replace(line, line if not nodes else "")
        machine = self.start(
            "run", self.write("a.hal", netlist), "--journal", "run.mcap", "--values", "*"
        )
        self.wait_for("modbus.0.online", "TRUE")
        wait_until(lambda: self.value("modbus.0.spindle.age") != "inf", "the speed is read")
        self.good("shell", given="sets speed-wish 9000\nsets start-button TRUE\n")
        self.wait_for("modbus.0.spindle.at-speed", "TRUE")
        self.wait_for("modbus.0.coolant.pump", "TRUE")
        self.lose_line(nodes)
        self.wait_for("modbus.0.online", "FALSE")
        self.wait_for_cycles("servo", 100)
        self.finish(machine, status=1)  # no slave has acknowledged its stop

    def lose_line(self, nodes):
        if nodes:
            nodes.kill()
            nodes.wait()
        else:
            self.good("shell", given="setp modbus-node.0.silence TRUE\n")

    @needs_package("modbus")
    def test_a_line_of_modbus_in_memory(self):
        self.run_spindle("sim:spindle")
        self.assertRegex(self.replay(), r"\nno difference, \d{5,} values compared\n$")

    @needs_package("modbus")
    def test_a_guarded_line_of_modbus_is_not_opened_again(self):
        settings = ROOT / "halfiles" / "modbus-spindle" / "spindle.modbus"
        port = self.folder / "port"
        nodes = self.start("node", "modbus", settings, "--link", f"pty:{port}", loaded=False)
        wait_until(port.exists, "the port of the nodes")
        self.run_spindle(f"serial:{port}", nodes)
        self.assertRegex(self.replay(), r"\nno difference, \d{5,} values compared\n$")

    @needs_package("tdma")
    @unittest.skipIf(SANITIZED, "a station under a sanitizer misses its slots")
    def test_slots_of_a_station_in_another_thread(self):
        machine = self.start(
            "run",
            self.write("a.hal", SLOTS_OF_ANOTHER_THREAD),
            *("--journal", "run.mcap", "--values", "*"),
        )
        for sender in ("much", "little"):
            wait_until(lambda: int(self.value(f"{sender}.sent")) > 300, f"frames of {sender}")
        self.wait_for_cycles("servo", 1000)
        self.good("shell", given="stop\nstart\n")
        self.wait_for_cycles("servo", 300)
        self.finish(machine)
        self.assertRegex(self.replay(), r"\nno difference, \d{5,} values compared\n$")

    @needs_package("scocan")
    def test_slots_of_a_node_in_another_thread(self):
        machine = self.start(
            "run",
            self.write("a.hal", SLOTS_OF_A_NODE),
            *("--journal", "run.mcap", "--values", "*"),
        )
        for receiver in ("can-receive.0", "can-receive.1"):
            pin = f"{receiver}.received"
            wait_until(lambda: int(self.value(pin)) > 300, f"frames of {receiver}")
        self.good("shell", given="stop\nstart\n")
        self.wait_for_cycles("servo", 1000)
        self.good("shell", given="unloadrt scocan.0\n")
        self.wait_for_cycles("fast", 300)
        self.finish(machine)
        self.assertRegex(self.replay(), r"\nno difference, \d{5,} values compared\n$")

    @needs_package("tdma")
    @unittest.skipIf(os.geteuid() != 0, "needs network namespaces: run it as root")
    def test_a_station_whose_cable_is_pulled(self):
        if SANITIZED:
            self.skipTest("a station under a sanitizer misses its slots")
        namespace = subprocess.Popen(
            ["unshare", "--net", "sh", "-c", "echo; exec sleep 600"], stdout=subprocess.PIPE
        )
        self.addCleanup(namespace.stdout.close)
        self.addCleanup(namespace.wait)
        self.addCleanup(namespace.kill)
        if not namespace.stdout.readline():
            self.skipTest("no network namespaces here")
        within = ["nsenter", "--net", "--target", str(namespace.pid)]

        def ip(*words):
            return subprocess.run([*within, "ip", *words], capture_output=True, text=True)

        if ip("link", "add", "m0", "type", "veth", "peer", "name", "m1").returncode != 0:
            self.skipTest("no veth pairs here")
        for port in ("m0", "m1"):
            self.assertEqual(0, ip("link", "set", port, "up").returncode)
        shutil.copy(ROOT / "halfiles" / "ethernet-cnc" / "cnc.tdma", self.folder)
        for name, port, station in (("clock", "m0", "clock"), ("default", "m1", "control")):
            text = STATION.format(port=port, station=station)
            machine = self.start_within(
                within, name, self.write(f"{name}.hal", text), "--journal", f"{name}.mcap"
            )
        self.wait_for("tdma.0.running", "TRUE")
        self.wait_for_cycles("servo", 300)
        ip("link", "set", "m0", "down")
        self.wait_for("tdma.0.link-up", "FALSE")
        ip("link", "set", "m0", "up")
        self.wait_for("tdma.0.link-up", "TRUE")
        self.wait_for_cycles("servo", 300)
        self.finish(machine)
        (self.folder / "default.mcap").rename(self.folder / "run.mcap")
        self.assertIn("\nno difference\n", self.replay())

    def start_within(self, within, name, *words):
        machine = subprocess.Popen(
            [*within, str(HAL), "run", "--name", name, *map(str, words)],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, machine)

        def runs():
            if machine.poll() is not None:
                raise AssertionError("it ended: " + "".join(machine.communicate()))
            return self.value("servo.threadbeat", instance=name) not in ("", "0")

        wait_until(runs, f"the machine '{name}' runs")
        return machine


if __name__ == "__main__":
    unittest.main()
