#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Photographs the views of the panel for docs/panel.md and the README: pictures.py [Pictures.VIEW ...], on a computer with chromium.

Each picture is of a good run: a machine that has missed a period or has a fault is started again, up to ATTEMPTS times. The pictures
depend on time and browser, so no test compares them. Look at each one before you commit it."""

import re
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
BUS = """[bus]
link      = sim:panel
bitrate   = 1M
sync      = cycle
[node 3 io]
device    = cia401
heartbeat = 20ms
[node 80 force]
device    = jr3
heartbeat = 20ms
"""
STATIONS = """loadrt threads name1=servo period1=1000000
loadrt canopen config=bus.canopen
loadrt canopen_io link=sim:panel id=3 inputs=8 outputs=8
loadrt canopen_jr3 link=sim:panel id=0x50
addf canopen.0.receive servo
addf canopen.0.transmit servo
addf canopen-io.0.update servo
addf canopen-jr3.0.update servo
start
"""
PYVCP = """<pyvcp><hbox>
<labelframe text="Spindle"><vbox>
  <meter halpin="rpm"><text>"rpm"</text><min_>0</min_><max_>3000</max_><majorscale>500</majorscale>
    <minorscale>100</minorscale><region1>(0,2000,"green")</region1><region2>(2000,2500,"yellow")</region2>
    <region3>(2500,3000,"red")</region3></meter>
  <hbox><button halpin="run"><text>"Start"</text></button><button halpin="halt"><text>"Stop"</text></button>
    <led halpin="turns"/></hbox>
</vbox></labelframe>
<vbox>
  <labelframe text="Load"><bar halpin="load"><min_>0</min_><max_>100</max_><range1>(0,80,"green")</range1></bar></labelframe>
  <labelframe text="Coolant"><vbox><radiobutton halpin="coolant"><choices>["off","mist","flood"]</choices>
    <initval>1</initval></radiobutton><checkbutton halpin="inside"><text>"through the spindle"</text></checkbutton></vbox></labelframe>
</vbox>
<vbox>
  <labelframe text="Jog"><vbox><dial halpin="x"><text>"X"</text></dial>
    <hbox><label><text>"step"</text></label><spinbox halpin="step"><min_>0.1</min_><max_>10</max_>
      <resolution>0.1</resolution></spinbox></hbox></vbox></labelframe>
</vbox>
</hbox></pyvcp>
"""
IN_CONTROL = "document.querySelector('[data-output]') !== null && [...document.querySelectorAll('[data-output]')].every(one => !one.disabled)"


def of_page(name):
    """The text of a file of docs/panel.md."""
    page = (ROOT / "docs/panel.md").read_text()
    return re.search(rf"(?s)```text file={re.escape(name)}\n(.*?)```", page)[1]


class Pictures(Page):
    def run_machine(self, netlist, height, view, *words):
        """Starts a machine and the panel with these words, and opens a view of this height."""
        self.netlist = netlist
        self.start_machine()
        self.process, self.port, self.token = start_panel(self, *words)
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

    def test_phone(self):
        self.run_machine(PENDULUM, 620, "overview")
        self.browser.size(390, 844)
        self.open("graph")
        self.browser.wait("Number(document.querySelector('canvas')?.dataset.values) > 0")
        self.until_balanced()
        time.sleep(1)
        self.save("phone")

    def test_watch(self):
        names = "arm-angle,pendulum-angle,balanced,motor-effort,arm-trajectory.maxv"
        self.run_machine(PENDULUM, 560, f"watch?names={names}")
        self.until_balanced()
        time.sleep(8)
        self.save("watch")

    def test_swing_up(self):
        self.run_machine(
            PENDULUM, 600, "scope?ch=pendulum-angle:3:-1,arm-angle:2:3,motor-effort:4:-3&base=0.5"
        )
        self.until_balanced()
        time.sleep(4)
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
            1240,
            f"scope?ch={channels}&base=0.05&mode=normal&trigger=wave0-sine",
        )
        time.sleep(3)
        self.browser.evaluate(
            "[...document.querySelectorAll('button')].find(b => b.textContent === 'Auto scale').click()"
        )
        for _ in range(ATTEMPTS):
            time.sleep(1.5)
            if int(self.value("fast.missed")) < 0.01 * int(self.value("fast.threadbeat")):
                return self.save("scope")
            self.restart()
            time.sleep(3)
        self.fail(f"more than 1 % of the periods were missed in each of {ATTEMPTS} runs")

    def test_user(self):
        self.write("swing.panel", of_page("swing.panel"))
        links = self.write("links.hal", of_page("links.hal"))
        self.run_machine(PENDULUM, 420, "panel", "--write", "swing.panel")
        self.until_balanced()
        for command in ("loadrt abs", "net motor-effort abs.0.in", "addf abs.0 servo-thread"):
            self.good("shell", *command.split())
        self.good("shell", "source", links)
        self.browser.wait(IN_CONTROL)
        time.sleep(1)
        self.browser.wait("document.querySelector('.w-led').dataset.on === 'true'")
        self.save("user")

    def test_pyvcp(self):
        self.write("widgets.xml", PYVCP)
        self.run_machine(
            self.write("m.hal", STATIONS.splitlines()[0] + "\nstart\n"),
            400,
            "panel",
            "--write",
            "widgets.xml",
        )
        self.browser.wait(IN_CONTROL)
        for pin, value in (("rpm", "1850"), ("turns", "TRUE"), ("load", "42")):
            self.good("shell", "setp", f"pyvcp.{pin}", value)
        time.sleep(1)
        self.save("pyvcp")

    def test_networks(self):
        self.write("bus.canopen", BUS)
        self.run_machine(self.write("m.hal", STATIONS), 310, "networks")
        self.browser.wait("document.querySelectorAll('.station.operational').length === 2")
        self.good("shell", "setp", "canopen-jr3.0.fz", "-220")
        self.browser.wait("document.querySelectorAll('.station.faulty').length === 1")
        self.save("networks")

    def test_log(self):
        self.run_machine(self.write("m.hal", WAVES), 330, "watch?names=wave.0.amplitude", "--write")
        self.browser.wait("!document.querySelector('button.set').disabled")
        self.browser.evaluate(
            "document.querySelector('input.set').value = '2'; document.querySelector('button.set').click()"
        )
        self.browser.wait("halcyon.log.some(entry => /wave.0.amplitude/.test(entry.text))")
        self.good("shell", "loadrt", "lowpass", "names=smooth")
        self.good("shell", "net", "wave0-sine", "smooth.in")
        self.good("shell", "addf", "smooth", "fast")
        self.browser.evaluate("location.hash = '#/log'")
        self.browser.wait("/addf smooth/.test(document.getElementById('log')?.innerText)")
        self.save("log")


if __name__ == "__main__":
    main()
