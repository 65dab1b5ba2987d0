#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Photographs the views of the panel for docs/panel.md and the README: pictures.py [Pictures.VIEW ...], on a computer with chromium.

Each picture is of a good run: a machine that has missed a period or has a fault is started again, up to ATTEMPTS times. The pictures
depend on time and browser, so no test compares them. Look at each one before you commit it."""
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/cli"))
from harness import wait_until  # noqa: E402
from panel_page import Page, main  # noqa: E402
from past_panel import journal_incident, start_past  # noqa: E402
from web import start_panel  # noqa: E402

ATTEMPTS, WIDTH = 40, 1080
PENDULUM = ROOT / "halfiles/furuta/swing-up.hal"
AXES = ROOT / "halfiles/ethercat-servo/servo.hal"
WAVES = "loadrt threads name1=fast period1=100000\nloadrt siggen names=wave.[0..15]\n" + "".join(
    f"setp wave.{n}.frequency {n + 3}\nnet wave{n}-sine wave.{n}.sine\naddf wave.{n}.update fast\n"
    for n in range(16)
)


class Pictures(Page):
    def run_machine(self, netlist, height, view):
        """Starts a machine and the panel, and opens a view of this height."""
        self.netlist = netlist
        self.start_machine()
        self.process, self.port, self.token = start_panel(self)
        self.browser = self.kind(self)
        self.browser.size(WIDTH, height)
        self.open(view)

    def start_machine(self):
        self.machine = self.start("run", self.netlist, loaded=False)
        wait_until(lambda: self.shell("show", "thread").returncode == 0, "the machine runs")

    def restart(self):
        self.end(self.machine)
        self.start_machine()
        self.browser.wait("document.getElementById('banner').hidden")

    def until_balanced(self):
        for _ in range(ATTEMPTS):
            end = time.monotonic() + 8
            while time.monotonic() < end:
                if self.value("furuta-control.0.balanced") == "TRUE":
                    return
                time.sleep(0.05)
            self.restart()
        self.fail(f"the pendulum was not upright in {ATTEMPTS} runs of 8 s")

    def save(self, name):
        path = ROOT / f"docs/panel-{name}.png"
        self.browser.screenshot(path)
        if shutil.which("pngquant"):  # a third of the size
            subprocess.run(["pngquant", "--force", "--output", path, path], check=True)

    def test_overview(self):
        self.run_machine(AXES, 620, "overview")
        for _ in range(ATTEMPTS):
            time.sleep(4)
            text = self.browser.evaluate("document.body.innerText")
            if "No faults" in text and "no period missed" in text:
                return self.save("overview")
            self.restart()
        self.fail(
            f"a period was missed in each of {ATTEMPTS} runs; use a computer without other load\n{text}"
        )

    def test_graph(self):
        self.run_machine(PENDULUM, 620, "graph?around=furuta-control.0&depth=1")
        self.until_balanced()
        time.sleep(1)
        self.save("graph")

    def test_watch(self):
        names = "arm-angle,pendulum-angle,balanced,motor-effort,arm-trajectory.maxv"
        self.run_machine(PENDULUM, 560, f"watch?names={names}")
        self.until_balanced()
        time.sleep(8)
        self.save("watch")

    def test_swing_up(self):
        self.run_machine(
            PENDULUM, 600, "scope?ch=pendulum-angle:3:-2,arm-angle:1:2.5,motor-effort:4:-3&base=0.5"
        )
        self.until_balanced()
        time.sleep(2)
        self.say("setp", "furuta.push", "1")
        time.sleep(2.5)
        self.save("swing-up")

    def test_timeline(self):
        journal_incident(self)
        self.process, self.port = start_past(self)
        self.browser = self.kind(self)
        self.browser.size(WIDTH, 620)
        self.browser.open(
            f"http://localhost:{self.port}/#/scope?"
            "ch=sine:0.5:1,smoothed:0.5:1,canopen.0.io.online:1:-3&base=0.05"
        )
        self.browser.wait("window.halcyon?.past?.moment?.ended")
        self.browser.evaluate("document.getElementById('fault-back').click()")
        self.browser.wait("window.halcyon.past.moment.ended === false")
        time.sleep(2)
        self.save("timeline")

    def test_scope(self):
        channels = ",".join(f"wave{n}-sine" for n in range(16))
        self.run_machine(
            self.write("waves.hal", WAVES),
            920,
            f"scope?ch={channels}&base=0.05&mode=normal&trigger=wave0-sine",
        )
        time.sleep(3)
        self.browser.evaluate(
            "[...document.querySelectorAll('button')].find(b => b.textContent === 'Auto scale').click()"
        )
        time.sleep(1.5)
        self.save("scope")


if __name__ == "__main__":
    main()
