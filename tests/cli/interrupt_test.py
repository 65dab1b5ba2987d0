# SPDX-License-Identifier: MIT
"""Every command that runs until its end is requested does end: by Ctrl-C, and as a service manager or a closed terminal requests it."""
import os
import signal
import subprocess
import unittest
from pathlib import Path

from harness import HAL, SERVO, TIMEOUT, Case, wait_until

COMMANDS = {
    "watch": ["sum2.0.out", "--for", "1h"],
    "meter": ["sum2.0.out", "--for", "1h"],
    "scope": ["sum2.0.out", "--trigger", "sum2.0.out > 1e9", "--csv", "never.csv"],
    "record": ["r.mcap", "sum2.0.out"],
    "trace": ["t.pftrace"],
    "panel": ["--port", "0"],
}
NETLIST = """loadrt threads name1=servo period1=1000000
loadrt sum2
addf sum2.0 servo
start
"""


def connected(process):
    """Whether the command talks to the instance, or waits for browsers."""
    try:
        return any(os.readlink(descriptor).startswith("socket:") for descriptor in Path(f"/proc/{process.pid}/fd").iterdir())
    except FileNotFoundError:  # closed meanwhile
        return False


class Interrupt(Case):
    def test_each_command_ends_by_each_signal(self):
        self.start("run", self.write("m.hal", NETLIST))
        for command, words in COMMANDS.items():
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                with self.subTest(command=command, signal=number.name):
                    process = subprocess.Popen([HAL, command, *words], cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL,
                                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
                    try:
                        wait_until(lambda: process.poll() is not None or connected(process), "the command runs")
                        self.assertIsNone(process.poll(), process.poll() is not None and process.stdout.read())
                        process.send_signal(number)
                        process.communicate(timeout=TIMEOUT)
                    finally:
                        if process.poll() is None:
                            process.kill()
                            process.communicate()
                    self.assertIn(process.returncode, (0, 1, -number))


if __name__ == "__main__":
    unittest.main()
