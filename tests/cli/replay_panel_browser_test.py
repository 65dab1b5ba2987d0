#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen panel
"""The page of `hal panel` on a replayed machine, in headless Chromium: the time line moves every view."""

import re
import sys
import unittest

from harness import SANITIZED, Case, wait_until
from past_panel import Client, journal_incident, start_past
from web import PANEL, Browser, have_browser

NAMES = ["sine", "smoothed", "canopen.0.io.online", "canopen.0.io.heartbeat-age-ms", "smooth.gain"]


@unittest.skipIf(SANITIZED, "a sanitizer has a thread, which cannot be copied")
class TimeLine(Case):
    def begin(self, view):
        journal_incident(self)
        self.process, self.port = start_past(self)
        self.client = Client(self)
        self.browser = Browser(self)
        self.open(view)
        self.settled("window.halcyon.past.moment.ended")
        self.timeline = self.browser.evaluate("halcyon.past.timeline")

    def open(self, view):
        self.browser.open(f"http://localhost:{self.port}/#/{view}")
        self.settled("window.halcyon?.past?.timeline && window.halcyon.past.moment.cycles > 0")

    def tearDown(self):
        self.assertEqual([], self.browser.errors)

    def settled(self, condition="true"):
        self.browser.wait(f"!window.halcyon.past.moment.moving && Boolean({condition})")

    def moment(self):
        return self.browser.evaluate("halcyon.past.moment")

    def click(self, identity):
        self.browser.evaluate(f"document.getElementById('{identity}').click()")

    def key(self, key):
        for kind in ("rawKeyDown", "keyUp"):
            self.browser.call("Input.dispatchKeyEvent", type=kind, key=key, code=key)

    def shell_values(self, names):
        """The values in the replay shell after as many cycles."""
        lines = [f"step {self.moment()['cycles']}"]
        for name in names:
            lines.append(f"{'gets' if '.' not in name else 'getp'} {name}")
        done = self.run_program(
            "replay", "--exact", "run.mcap", "--shell", given="\n".join(lines) + "\n"
        )
        return done.stdout.splitlines()[1:]

    def drag(self, *shares):
        """Presses at the first share of the time line, and moves over all others."""
        left, top, width = self.browser.evaluate(
            "(() => { const r = document.getElementById('timeline').getBoundingClientRect(); "
            "return [r.left, r.top + r.height / 2, r.width]; })()"
        )
        for i, share in enumerate(shares):
            self.browser.call(
                "Input.dispatchMouseEvent",
                type="mousePressed" if i == 0 else "mouseMoved",
                x=left + share * width,
                y=top,
                button="left",
                buttons=1,
                clickCount=1,
            )
        self.browser.call(
            "Input.dispatchMouseEvent",
            type="mouseReleased",
            x=left + shares[-1] * width,
            y=top,
            button="left",
            clickCount=1,
        )

    def compare_watch(self):
        """Waits until the watch view, which is drawn after the move, shows the shell's values."""
        for name, value in zip(NAMES, self.shell_values(NAMES)):
            read = f"document.querySelector('[data-value=\"{name}\"]').textContent.trim()"
            wait_until(
                lambda: self.same(value, self.browser.evaluate(read)), f"{name} is shown as {value}"
            )

    @staticmethod
    def same(value, shown):
        """Compares numbers, as the page leaves out zeros that the shell prints."""
        if value in ("TRUE", "FALSE") or shown in ("", "–"):
            return value == shown
        return float(value) == float(shown)

    def test_dragging_shows_the_values_of_that_moment(self):
        self.begin("watch?names=" + ",".join(NAMES))
        self.assertEqual(
            "run.mcap", self.browser.evaluate("document.getElementById('machine').textContent")
        )
        end_ns = self.timeline["end_ns"]
        for shares in ([0.9, 0.7, 0.5, 0.3, 0.35], [0.1, 0.2, 0.62]):
            self.drag(*shares)
            wanted = shares[-1] * end_ns
            self.settled(
                f"Math.abs(window.halcyon.past.moment.time_ns - {wanted}) < {0.01 * end_ns + 2e7}"
            )
            moment = self.moment()
            self.compare_watch()
            percent = 100 * moment["time_ns"] / end_ns
            position = "parseFloat(document.querySelector('.thumb').style.left)"
            self.browser.wait(f"Math.abs({position} - {percent}) < 0.01")
        self.assertEqual(
            ["none"],
            self.browser.evaluate(
                "[...new Set([...document.querySelectorAll('.set-cell')].map(e => getComputedStyle(e).display))]"
            ),
        )
        self.assertTrue(self.browser.evaluate("document.getElementById('control').hidden"))

    def test_keys_and_buttons_move_by_cycles_seconds_and_faults(self):
        self.begin("watch?names=" + ",".join(NAMES))
        self.browser.evaluate("document.getElementById('timeline').focus()")
        self.key("Home")
        self.settled("window.halcyon.past.moment.time_ns < 20e6")
        first = self.moment()["cycles"]
        for _ in range(3):
            self.key("ArrowRight")
        self.settled(f"window.halcyon.past.moment.cycles === {first + 3}")
        self.key("ArrowLeft")
        self.settled(f"window.halcyon.past.moment.cycles === {first + 2}")
        self.key("PageDown")
        self.settled(
            "window.halcyon.past.moment.time_ns >= 1e9 || window.halcyon.past.moment.ended"
        )
        self.compare_watch()
        self.key("End")
        self.settled(f"window.halcyon.past.moment.time_ns === {self.timeline['end_ns']}")

        fault = next(one for one in self.timeline["marks"] if one["kind"] == "fault")
        self.click("fault-back")
        self.settled(f"window.halcyon.past.moment.cycles === {fault['cycles']}")
        self.compare_watch()
        self.click("fault-back")
        note = "document.getElementById('moment-note').textContent"
        self.browser.wait(f"{note} === 'no earlier fault'")
        self.click("step-back")
        self.settled(f"window.halcyon.past.moment.cycles === {fault['cycles'] - 1}")
        self.assertEqual("", self.browser.evaluate(note))
        self.browser.evaluate(
            "(() => { const c = document.getElementById('condition'); "
            "c.value = 'canopen-io.0.power < 0.5'; c.dispatchEvent(new Event('change')); })()"
        )
        self.settled("window.halcyon.past.moment.condition === 'canopen-io.0.power < 0.5'")
        self.click("reverse")
        off = next(one for one in self.timeline["marks"] if one["kind"] == "edit")
        self.settled(f"window.halcyon.past.moment.cycles === {off['cycles']}")
        self.click("continue")
        self.settled("window.halcyon.past.moment.ended")
        self.browser.wait(f"{note} === 'the journal has no further cycle'")
        stop = next(one for one in self.timeline["marks"] if one["kind"] == "stop")
        index = self.timeline["marks"].index(stop)
        self.browser.evaluate(
            "(() => { const c = document.getElementById('happened'); "
            f"c.value = '{index}'; c.dispatchEvent(new Event('change')); }})()"
        )
        self.settled(f"window.halcyon.past.moment.cycles === {stop['cycles']}")
        self.browser.wait(
            "document.getElementById('banner').textContent === "
            "'The machine was stopped at this moment: its functions did not run.'"
        )

    def test_every_view_shows_the_moment(self):
        self.begin("networks")
        fault = next(one for one in self.timeline["marks"] if one["kind"] == "fault")
        self.click("fault-back")
        self.browser.wait("document.querySelectorAll('.station.faulty').length === 1")
        self.click("step-back")
        self.browser.wait("document.querySelectorAll('.station.operational').length === 1")
        self.assertTrue(self.browser.evaluate("document.getElementById('faults').hidden"))

        self.open("graph?pin=sine")
        self.click("fault-next")
        self.settled(f"window.halcyon.past.moment.cycles === {fault['cycles']}")
        (sine,) = self.shell_values(["sine"])
        shown = "Number(document.querySelector('[data-live=sine]')?.textContent)"
        self.browser.wait(f"{shown} === {float(sine)}")

        self.open("overview")
        self.browser.wait("/no heartbeat/.test(document.getElementById('main').innerText)")
        self.browser.wait("document.querySelectorAll('[data-thread]').length === 2")
        self.click("step-back")
        self.browser.wait("/No faults/.test(document.getElementById('main').innerText)")

        self.open("log")
        texts = "document.getElementById('log').innerText"
        self.browser.wait(f"/power FALSE/.test({texts}) && !/no heartbeat/.test({texts})")
        self.click("step")
        self.browser.wait(f"/no heartbeat/.test({texts}) && !/power TRUE/.test({texts})")

    def test_the_scope_shows_the_traces_around_the_moment(self):
        self.begin("scope?ch=sine,canopen.0.io.online&base=0.02")
        fault = next(one for one in self.timeline["marks"] if one["kind"] == "fault")
        for before_ns in (250_000_000, 40_000_000):
            wanted = fault["time_ns"] - before_ns
            self.client.run("goto", f"{wanted}ns")
            cycle = self.client.ask(moment=True)["moment"]["cycles"]
            self.settled(f"window.halcyon.past.moment.cycles === {cycle}")
            time_ns = self.moment()["time_ns"]
            self.browser.wait(f"document.querySelector('canvas').dataset.moment === '{time_ns}'")
            self.browser.wait(
                f"halcyonScope.range[0] < {time_ns / 1e9} && halcyonScope.range[1] > {time_ns / 1e9}"
            )
            self.assertGreater(self.browser.evaluate("halcyonScope.rows"), 100)
        self.browser.wait("halcyonScope.faults.length === 1")
        text = self.browser.evaluate("document.body.innerText")
        self.assertRegex(text, re.escape(f"around {time_ns / 1e9:.6f} s"))


if __name__ == "__main__":
    if not PANEL.exists():
        print("hal-panel is not built: install libwebsockets-dev and libpugixml-dev")
        sys.exit(77)
    if not have_browser():
        print("no browser: install the Debian package chromium")
        sys.exit(77)
    unittest.main()
