# SPDX-License-Identifier: MIT
"""Measures the page of `hal panel` in headless Chromium: panel.py HAL [SECONDS [OTHER_HAL]]. Prints a figure per line, with its target.
With OTHER_HAL, the panel of another build shows the same machine to the same browser, in turn with that of HAL.

The browser draws without a GPU, so that its CPU time contains what a GPU would do. CPU times are those of all processes of the browser
and of hal-panel; the machine is not part of them. The first picture has the values of a thread.
"""

import os
import re
import statistics
import subprocess
import sys
import time
from pathlib import Path

os.environ["HAL_BIN"] = sys.argv[1]
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cli"))
import harness  # noqa: E402
from web import Browser, have_browser, request, start_panel  # noqa: E402

SECONDS = float(sys.argv[2]) if len(sys.argv) > 2 else 10
OTHER = Path(sys.argv[3]).resolve() if len(sys.argv) > 3 else None
NAMES = [f"wave{i}" for i in range(16)]
NETLIST = (
    f"loadrt threads name1=servo period1=100000\nloadrt siggen names={','.join(NAMES)}\n"
    + "".join(
        f"setp {name}.frequency {3 + i}\naddf {name}.update servo\nnet {name}-sine {name}.sine\n"
        for i, name in enumerate(NAMES)
    )
    + "start\n"
)
FILE = r"""(?:href|src)="([\w.]+)"|(?:from |import\()'\./([\w.]+)'"""
FIRST_PICTURE = """(() => {
    const look = () => {
        const cycles = document.querySelector('[data-thread] .figures dd:nth-of-type(2)')?.textContent;
        if (cycles > 0) requestAnimationFrame(() => { window.firstPicture = performance.now(); });
        else requestAnimationFrame(look);
    };
    requestAnimationFrame(look);
})()"""


class Bench(harness.Case):
    def runTest(self):
        pass


def ticks(group):
    """CPU seconds of the processes of a process group."""
    sum_ = 0
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[2]) == group:
            sum_ += int(fields[11]) + int(fields[12])
    return sum_ / os.sysconf("SC_CLK_TCK")


def process_s(pid):
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def row(what, unit, figure, goal=""):
    print(
        f"{what:62} {figure:9.4g} {unit:3} {f'target {goal}' if goal else ''}".rstrip(), flush=True
    )


def start_other(case):
    """The panel of the other build; (process, port)."""
    process = subprocess.Popen(
        [str(OTHER), "panel", "--port", "0"],
        cwd=case.folder,
        env=case.environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    case.addCleanup(lambda: (process.kill(), process.communicate()))
    for line in process.stdout:
        if found := re.match(r"http://[^/]*?:(\d+)/", line):
            return process, int(found[1])
    raise AssertionError(f"{OTHER} panel has ended")


def first_picture(browser, ports):
    script = browser.call("Page.addScriptToEvaluateOnNewDocument", source=FIRST_PICTURE)
    times = {port: [] for port in ports}
    for port in ports * 7:
        browser.open("about:blank")
        browser.wait("location.href === 'about:blank'")
        browser.open(f"http://localhost:{port}/#/overview")
        times[port].append(browser.wait("window.firstPicture"))
    # On another view it would look for its picture in every frame.
    browser.call("Page.removeScriptToEvaluateOnNewDocument", **script)
    for port, build in zip(ports, ("", ", other build")):
        median = statistics.median(times[port])
        row(f"page to first picture, median of 7{build}", "ms", median, "<= 300")
        row("the slowest of them", "ms", max(times[port]))


def page_size(port):
    """KB of all files that the page can load."""
    waiting, seen = ["/"], {}
    while waiting:
        path = waiting.pop()
        if path not in seen:
            body = request(port, path)[2]
            seen[path] = len(body)
            waiting += [
                "/" + name for found in re.findall(FILE, body.decode()) for name in found if name
            ]
    row(f"page, {len(seen)} files", "kB", sum(seen.values()) / 1000, "<= 200")


def floor(browser):
    """What an empty canvas of the scope's size costs in this browser."""
    browser.open("about:blank")
    browser.wait("location.href === 'about:blank'")
    browser.evaluate("""(() => {
        const canvas = document.createElement('canvas'), draw = canvas.getContext('2d');
        document.body.append(canvas);
        [canvas.width, canvas.height] = [innerWidth - 16, innerHeight - 100];
        let x = 0;
        const look = () => { draw.clearRect(0, 0, canvas.width, canvas.height); draw.fillRect(x++ % 100, 9, 9, 9); requestAnimationFrame(look); };
        look();
    })()""")
    time.sleep(2)
    cpu, begun = ticks(browser.process.pid), time.monotonic()
    time.sleep(SECONDS)
    row(
        "CPU of the browser with an empty canvas, 60 frames/s",
        "%",
        100 * (ticks(browser.process.pid) - cpu) / (time.monotonic() - begun),
    )


def scope(browser, port, panel, build=""):
    channels = ",".join(f"{name}-sine:1:{3.5 - 7 * i / 15:.3g}" for i, name in enumerate(NAMES))
    for mode, query in (
        ("roll", "mode=roll"),
        ("triggered", f"mode=normal&trigger={NAMES[0]}-sine&edge=rising&level=0"),
    ):
        browser.open("about:blank")
        browser.wait("location.href === 'about:blank'")
        browser.open(f"http://localhost:{port}/#/scope?ch={channels}&base=0.1&{query}")
        browser.wait("window.halcyonScope?.rows > 20000")
        time.sleep(5)  # a browser that has just started is busy with its own pages
        before = browser.evaluate(
            "({...halcyonScope, store: null, at: performance.now(), bytes: halcyon.stats.bytes})"
        )
        cpu, server = ticks(browser.process.pid), process_s(panel.pid)
        time.sleep(SECONDS)
        after = browser.evaluate(
            "({...halcyonScope, store: null, at: performance.now(), bytes: halcyon.stats.bytes})"
        )
        cpu, server = ticks(browser.process.pid) - cpu, process_s(panel.pid) - server
        passed = (after["at"] - before["at"]) / 1000
        row(
            f"scope, 16 channels at 10 kHz, {mode}: frames per second{build}",
            "",
            (after["frames"] - before["frames"]) / passed,
            ">= 18" if mode == "roll" else "",
        )
        row(f"rows per second in the page, {mode}", "", (after["rows"] - before["rows"]) / passed)
        row(f"lost rows, {mode}", "", after["lost"] - before["lost"], "<= 0")
        row(f"cycles that the machine missed itself, {mode}", "", after["gaps"] - before["gaps"])
        row(
            f"CPU of the browser and hal-panel, {mode}{build}",
            "%",
            100 * (cpu + server) / passed,
            "<= 30",
        )
        row(f"of which hal-panel, {mode}", "%", 100 * server / passed)


def main():
    if not have_browser():
        print("no browser: install the Debian package chromium")
        sys.exit(77)
    case = Bench()
    case.setUp()
    try:
        case.start("run", case.write("bench.hal", NETLIST))
        panel, port, _ = start_panel(case)
        browser = Browser(case)
        page_size(port)
        if not OTHER:
            first_picture(browser, [port])
            floor(browser)
            return scope(browser, port, panel)
        other, other_port = start_other(case)
        first_picture(browser, [port, other_port])
        floor(browser)
        for _ in range(3):
            scope(browser, port, panel)
            scope(browser, other_port, other, ", other build")
    finally:
        case.doCleanups()


main()
