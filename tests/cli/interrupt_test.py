# SPDX-License-Identifier: MIT
"""Every command that runs until its end is requested does end: by Ctrl-C, and as a service manager or a closed terminal requests it."""
import signal
import subprocess
import unittest
from pathlib import Path

from harness import HAL, TIMEOUT, Case, wait_until
from web import PANEL

COMMANDS = {
    "watch": ["sum2.0.out", "--for", "1h"],
    "meter": ["sum2.0.out", "--for", "1h"],
    "record": ["r.mcap", "sum2.0.out"],
    "trace": ["t.pftrace"],
    "panel": ["--port", "0"],
}
NETLIST = """loadrt threads name1=servo period1=1000000
loadrt sum2
addf sum2.0 servo
start
"""


def takes(process, number):
    """Whether the command waits for the signal itself; before, the signal would end it in any case."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    blocked = int(
        next(line for line in status.splitlines() if line.startswith("SigBlk:")).split()[1], 16
    )
    return blocked >> (number - 1) & 1


class Interrupt(Case):
    def test_each_command_ends_by_each_signal(self):
        self.start("run", self.write("m.hal", NETLIST))
        for command, words in COMMANDS.items():
            if command == "panel" and not PANEL.exists():
                continue
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                with self.subTest(command=command, signal=number.name):
                    process = subprocess.Popen(
                        [HAL, command, *words],
                        cwd=self.folder,
                        env=self.environment,
                        stdin=subprocess.DEVNULL,
                        stdout=subprocess.PIPE,
                        stderr=subprocess.STDOUT,
                        text=True,
                    )
                    try:
                        wait_until(
                            lambda: process.poll() is not None or takes(process, number),
                            "the command waits",
                        )
                        self.assertIsNone(
                            process.poll(), process.poll() is not None and process.stdout.read()
                        )
                        process.send_signal(number)
                        process.communicate(timeout=TIMEOUT)
                    finally:
                        if process.poll() is None:
                            process.kill()
                            process.communicate()
                    self.assertGreaterEqual(process.returncode, 0)

    def test_an_interrupted_replay_reports_how_much_was_replayed(self):
        self.write(
            "abs.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt abs\naddf abs.0 servo\nnet a => abs.0.in\nnet b abs.0.out\n",
        )
        self.write("run.csv", "time_s,a,b\n0,0,0\n1e9,0,0\n")
        process = subprocess.Popen(
            [HAL, "replay", "run.csv", "abs.hal", "--tolerance", "1"],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            # the warning about the gap is the last thing before the replay
            while line := process.stderr.readline():
                if "the netlist runs all that time" in line:
                    break
            process.send_signal(signal.SIGTERM)
            out, _ = process.communicate(timeout=TIMEOUT)
        finally:
            if process.poll() is None:
                process.kill()
                process.communicate()
        self.assertEqual(1, process.returncode)
        self.assertRegex(
            out,
            r"(?m)^interrupted after \S+ s of 1e\+09 s of recording: 1 input driven, 1 value compared",
        )


if __name__ == "__main__":
    unittest.main()
