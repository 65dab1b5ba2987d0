# SPDX-License-Identifier: MIT
"""Large machines take time in proportion to their size: the processor time of n and of 4 n is compared, never a time with a limit.

Work in proportion to n gives a ratio of 4, work in proportion to its square 16. What both do whatever the size is, starting the program, is
measured by itself and subtracted; of several runs the shortest counts, since other programs on the host only add to it.
"""
import json
import os
import socket
import subprocess
import unittest
from pathlib import Path

from harness import HAL, SANITIZED, SERVO, Case

LARGE = 60_000
LIMIT = 8  # half way, by factors, between 4 and 16
RUNS = 3


@unittest.skipIf(SANITIZED, "a sanitizer's own work is what would be measured")
class Scaling(Case):
    def cost(self, *words):
        """Processor time of a run of hal, in seconds."""
        process = subprocess.Popen(
            ["hal", *map(str, words)],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
        )
        error = process.stderr.read()
        process.stderr.close()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        self.assertEqual(0, process.returncode, error[-2000:])
        return usage.ru_utime + usage.ru_stime

    def compare(self, what, measure, most=LARGE):
        """`measure(n)` gives seconds of processor time."""
        base, small, large = (min(measure(n) for _ in range(RUNS)) for n in (1, most // 4, most))
        ratio = (large - base) / max(small - base, 0.05)  # the clock's ticks are 0.01 s
        print(
            f"{what}: {most // 4} {small - base:.2f} s, {most} {large - base:.2f} s, ratio {ratio:.1f}",
            flush=True,
        )
        self.assertLess(ratio, LIMIT, what)

    def test_check_of_many_instances(self):
        def measure(n):
            return self.cost(
                "check",
                self.write(
                    "a.hal",
                    f"loadrt threads name1=servo period1=1000000\nloadrt and2 count={n}\n"
                    + "".join(f"addf and2.{i} servo\n" for i in range(n)),
                ),
            )

        self.compare("check", measure)

    def test_instances_in_a_chain_of_nets(self):
        def measure(n):
            return self.cost(
                "check",
                self.write(
                    "a.hal",
                    f"loadrt threads name1=servo period1=1000000\nloadrt not count={n}\n"
                    + "".join(f"addf not.{i} servo\n" for i in range(n))
                    + "".join(f"net s{i} not.{i}.out => not.{i + 1}.in\n" for i in range(n - 1)),
                ),
            )

        self.compare("nets", measure)

    def test_addf_auto_of_many_functions(self):
        def measure(n):
            return self.cost(
                "sim",
                "-q",
                self.write(
                    "a.hal",
                    f"loadrt threads name1=servo period1=1000000\nloadrt not count={n}\n"
                    + "".join(
                        f"net s{i} not.{i}.out => not.{i + 1}.in\n" for i in range(n - 2, -1, -1)
                    )
                    + "addf --auto servo\n",
                ),
            )

        self.compare("addf --auto", measure)

    def test_one_request_with_many_pins(self):
        def measure(n):
            machine = self.start("run", self.write("a.hal", SERVO))
            stat = Path(f"/proc/{machine.pid}/task")

            def used():  # in nanoseconds
                return {
                    task: int((task / "schedstat").read_text().split()[0])
                    for task in stat.iterdir()
                }

            client = socket.socket(socket.AF_UNIX)
            client.settimeout(120)
            client.connect(str(self.folder / "halcyon/default.sock"))
            lines = client.makefile("r")
            lines.readline()
            before = used()
            pins = [{"name": f"p{i}", "type": "float", "dir": "out"} for i in range(n)]
            client.sendall(json.dumps({"component": "many", "pins": pins}).encode() + b"\n")
            answer = json.loads(lines.readline())
            self.assertTrue(answer["ok"], answer)
            # of the thread that serves the connection: the real-time thread works on meanwhile
            cost = max(now - before.get(task, 0) for task, now in used().items()) / 1e9
            lines.close()
            client.close()
            self.end(machine)
            return cost

        self.compare("pins of a request", measure)


if __name__ == "__main__":
    unittest.main()
