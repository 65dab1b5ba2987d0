# SPDX-License-Identifier: MIT
# packages: modbus
"""How soon after the end of a machine the stop telegram of a drive is complete on a line of 19 200 baud: ten kinds of ends.
HALCYON_MODBUS_ENDS=1000 makes a thousand ends instead of thirty. Prints the times; only a stop telegram that does not come fails.
"""

import os
import random
import signal
import subprocess
import time
import unittest

from harness import HAL, Case, Terminal, wait_until
from modbus_drive import RUN, STOP, Drive

ENDS = int(os.environ.get("HALCYON_MODBUS_ENDS", "30"))
REACH_MS = 150
BAUD = 19200
THINKING = 0.005  # of the drive

CONFIGURATION = f"""[bus]
baud = {BAUD}
[slave 1 spindle]
profile = delta-ms300
every = 20ms
"""
NETLIST = """loadrt threads name1=servo period1=1000000
loadrt modbus config=spindle.modbus link=serial:line
loadrt stall names=s file=stall.txt
addf modbus.0.receive servo
addf s servo
addf modbus.0.transmit servo
setp modbus.0.spindle.speed-cmd 12000
start
"""


class Ends(Case):
    def setUp(self):
        super().setUp()
        self.write("spindle.modbus", CONFIGURATION)
        self.write("spindle.hal", NETLIST)
        self.drive = Drive(str(self.folder / "line"), BAUD, THINKING)
        self.addCleanup(self.drive.close)
        self.random = random.Random(1)

    # --- The ten kinds. Each returns when it began.

    def by_shell(self, *lines):
        """By commands of a shell that is connected before."""
        self.pause()
        since = time.monotonic()
        self.shell_input("\n".join(lines))
        return since

    def by_console(self):
        """By leaving the shell in which the machine was started."""
        self.pause()
        since = time.monotonic()
        self.machine.stdin.write("exit\n")
        self.machine.stdin.flush()
        return since

    def by_signal(self, number):
        self.pause()
        since = time.monotonic()
        self.machine.send_signal(number)
        return since

    def closed_terminal(self):
        self.pause()
        since = time.monotonic()
        os.close(self.terminal.descriptor)
        self.terminal.descriptor = os.open("/dev/null", os.O_RDWR)
        return since

    KINDS = {
        "exit": by_console,
        "unload": lambda self: self.by_shell(
            "delf modbus.0.receive servo", "delf modbus.0.transmit servo", "unloadrt modbus"
        ),
        "stop": lambda self: self.by_shell("stop"),
        "e-stop": lambda self: self.by_shell("setp modbus.0.estop TRUE"),
        "fault": lambda self: self.by_shell("setp s.mode 5"),
        "thread that hangs": lambda self: self.by_shell("setp s.mode 1"),
        "SIGSTOP": lambda self: self.by_signal(signal.SIGSTOP),
        "SIGSEGV": lambda self: self.by_signal(signal.SIGSEGV),
        "SIGKILL": lambda self: self.by_signal(signal.SIGKILL),
        "closed terminal": closed_terminal,
    }

    # --- A machine that turns its spindle

    def start_machine(self, kind):
        self.machine = self.terminal = None
        if kind == "closed terminal":
            self.terminal = Terminal(self, "run", "spindle.hal")
        else:
            self.machine = self.start("run", "-I", "spindle.hal", stdin=subprocess.PIPE)
        wait_until(lambda: self.value("modbus.0.spindle.online") == "TRUE", "the drive is online")
        self.connection = subprocess.Popen(
            [HAL, "shell"],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self.edge_at = 0.0
        wait_until(self.drive_runs, "the drive runs")

    def shell_input(self, line):
        self.connection.stdin.write(line + "\n")
        self.connection.stdin.flush()

    def drive_runs(self):
        """Whether the drive runs. On a busy machine the guardian may stop it before: it needs another edge then."""
        if time.monotonic() > self.edge_at:
            self.shell_input("setp modbus.0.spindle.run FALSE\nsetp modbus.0.spindle.run TRUE")
            self.edge_at = time.monotonic() + 3.0
        return self.drive.registers[0x2000] == RUN

    def pause(self):
        """Any moment of the exchange is as likely as another one."""
        time.sleep(self.random.uniform(0.02, 0.08))

    def end_machine(self):
        self.connection.kill()
        self.connection.communicate()
        if self.terminal:
            os.waitpid(self.terminal.process, 0)
            self.terminal.status = 0
        else:
            self.end(self.machine, signal.SIGKILL)

    def stop_time(self, since):
        """Seconds until the stop telegram was complete on the line, as the last command."""
        wait_until(lambda: self.drive.registers[0x2000] == 1, "the drive is stopped")
        commands = [(when, f) for when, f in self.drive.writes if f[2:4] == STOP[2:4]]
        self.assertEqual(STOP, commands[-1][1])
        return next(when for when, f in commands if when >= since and f == STOP) - since

    def test_stop_telegram_is_complete_after_each_end(self):
        times = {kind: [] for kind in self.KINDS}
        for number in range(ENDS):
            kind = list(self.KINDS)[number % len(self.KINDS)]
            self.drive.writes.clear()
            self.start_machine(kind)
            since = self.KINDS[kind](self)
            with self.subTest(kind=kind, number=number):
                times[kind].append(1e3 * self.stop_time(since))
            self.end_machine()
            wait_until(lambda: self.drive.registers[0x2000] == 1, "the drive stays stopped")
        report(times)


def report(times):
    everything = sorted(time for kind in times.values() for time in kind)
    soon = sum(time <= REACH_MS for time in everything)
    print(f"\n{'end':<18}{'ends':>6}{'min':>8}{'p50':>8}{'p99':>8}{'max':>8} ms")
    for kind, some in [*times.items(), ("all", everything)]:
        if not some:
            continue
        some = sorted(some)
        shown = [some[0], some[len(some) // 2], some[len(some) * 99 // 100], some[-1]]
        print(f"{kind:<18}{len(some):>6}" + "".join(f"{value:8.1f}" for value in shown))
    print(f"{soon} of {ENDS} stop telegrams complete within {REACH_MS} ms")


if __name__ == "__main__":
    unittest.main()
