# SPDX-License-Identifier: MIT
"""Measures `hal lsp`: lsp.py HAL. Prints a figure per line, with its target.

A keystroke is a change of one character and the diagnostics of the new text. The wall time contains the client; the CPU time is that of the
server, and does not depend on what else this computer runs.
"""

import os
import statistics
import sys
import time
from pathlib import Path

os.environ["HAL_BIN"] = sys.argv[1]
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cli"))
import harness  # noqa: E402
from lsp_client import Client  # noqa: E402

ROUNDS = 15


class Bench(harness.Case):
    def runTest(self):
        pass


def row(what, unit, figure, goal=""):
    print(
        f"{what:62} {figure:9.4g} {unit:3} {f'target {goal}' if goal else ''}".rstrip(), flush=True
    )


def cpu_s(process):
    """CPU seconds of all threads, in nanosecond resolution."""
    return (
        sum(
            int(path.read_text().split()[0])
            for path in Path(f"/proc/{process}/task").glob("*/schedstat")
        )
        / 1e9
    )


def netlist(nets, lines):
    """A chain of adders; `lines`: one line for each function."""
    chain = [f"net s{i} sum2.{i}.out => sum2.{i + 1}.in0" for i in range(nets)]
    order = [f"addf sum2.{i} servo" for i in range(nets)] if lines else ["addf --auto servo"]
    return "\n".join(["newthread servo 1ms", f"loadrt sum2 count={nets + 1}", *chain, *order, ""])


def keystrokes(case, what, text, goal):
    client = Client(case.environment, case.folder)
    case.addCleanup(client.kill)
    begun = time.monotonic()
    name = client.open(case.write("bench.hal", text))
    client.diagnostics(name)
    row(f"{what}: opened", "ms", 1000 * (time.monotonic() - begun))
    wall, cpu = [], []
    for number in range(ROUNDS):
        time.sleep(0.3)  # a person types; meanwhile the server frees the netlist before
        change = (5, 0, 5, 0, "#") if number % 2 == 0 else (5, 0, 5, 1, "")
        begun, cpu_begun = time.monotonic(), cpu_s(client.process.pid)
        client.change(name, change)
        client.diagnostics(name)
        wall.append(1000 * (time.monotonic() - begun))
        cpu.append(1000 * (cpu_s(client.process.pid) - cpu_begun))
    row(f"{what}: diagnostics after a keystroke, median", "ms", statistics.median(wall), goal)
    row(f"{what}: the same, CPU time of the server", "ms", statistics.median(cpu))
    for method in ("completion", "hover"):
        begun = time.monotonic()
        client.at(name, 5, 6, method)
        row(f"{what}: {method}", "ms", 1000 * (time.monotonic() - begun))
    client.quit()


def main():
    case = Bench()
    case.setUp()
    try:
        keystrokes(case, "2000 lines", netlist(999, True), "<= 50")
        keystrokes(case, "20 000 nets", netlist(20_000, False), "<= 200")
    finally:
        case.doCleanups()


main()
