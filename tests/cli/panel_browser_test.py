#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The page of `hal panel` in headless Chromium, driven over the DevTools protocol."""
import sys
import unittest

from harness import SERVO, Case
from web import PANEL, Browser, have_browser, start_panel

WAVE = SERVO + """loadrt siggen names=wave
addf wave.update servo
setp wave.frequency 5
net sine wave.sine
"""


class Page(Case):
    def begin(self, *words, netlist=WAVE, view="overview", token=True):
        self.machine = self.start("run", self.write("m.hal", netlist))
        self.process, self.port, self.token = start_panel(self, *words)
        self.browser = Browser(self)
        self.open(view, token)

    def open(self, view, token=True):
        if token and self.token:
            self.browser.open(f"http://localhost:{self.port}/#t={self.token}")
            self.browser.wait("window.halcyon?.machine && location.hash.startsWith('#/')")
            self.browser.evaluate(f"location.hash = '#/{view}'")
        else:
            self.browser.open(f"http://localhost:{self.port}/#/{view}")
        self.browser.wait("window.halcyon?.machine && document.getElementById('main').children.length > 0")

    def tearDown(self):
        if hasattr(self, "browser"):
            self.assertEqual([], self.browser.errors)

    def test_overview_shows_the_threads_and_a_killed_machine(self):
        self.begin()
        self.browser.wait("Number(document.querySelector('[data-thread=servo] .figures dd:nth-of-type(2)')?.textContent) > 10")
        self.assertIn("No faults", self.browser.evaluate("document.body.innerText"))
        self.end(self.machine, 9)
        self.browser.wait("document.body.classList.contains('stale') && /not running/.test(document.getElementById('banner').textContent)")
        self.machine = self.start("run", self.write("m.hal", WAVE))
        self.browser.wait("!document.body.classList.contains('stale') && document.getElementById('banner').hidden")
        before = self.browser.evaluate("Number(document.querySelector('[data-thread=servo] .figures dd:nth-of-type(2)').textContent)")
        self.browser.wait(f"Number(document.querySelector('[data-thread=servo] .figures dd:nth-of-type(2)').textContent) != {before}")

    def test_a_stopped_machine_is_shown_as_not_responding(self):
        self.begin()
        self.machine.send_signal(19)
        try:
            self.browser.wait("/does not respond/.test(document.getElementById('banner').textContent)")
        finally:
            self.machine.send_signal(18)
        self.browser.wait("document.getElementById('banner').hidden")

    def test_watch_sets_values_only_with_the_token(self):
        self.begin("--write", view="watch?names=total,adder.in0", token=False)
        self.browser.wait("document.querySelector('[data-value=total]')?.textContent === '5'")
        self.assertTrue(self.browser.evaluate("document.querySelector('button.set').disabled"))
        self.assertEqual("read-only: no token", self.browser.evaluate("document.getElementById('role').textContent"))
        self.open("watch?names=total,adder.in0")
        self.browser.wait("document.querySelector('button.set') && !document.querySelector('button.set').disabled")
        self.assertNotIn(self.token, self.browser.evaluate("location.href"))
        self.browser.evaluate("document.querySelector('input.set').value = '40'; document.querySelector('button.set').click()")
        self.browser.wait("document.querySelector('[data-value=total]').textContent === '43'")
        self.assertEqual("40", self.value("adder.in0"))

    def test_a_view_is_restored_from_its_address(self):
        self.begin(view="watch?names=total", token=False)
        self.browser.wait("document.querySelector('[data-value=total]')?.textContent === '5'")
        self.browser.evaluate("[...document.querySelectorAll('.tree summary')].forEach(s => s.parentNode.open = true)")
        self.browser.evaluate("const f = document.querySelector('input[type=search]'); f.value = 'wave.sine'; f.dispatchEvent(new Event('input'))")
        self.browser.wait("document.querySelectorAll('.tree button.leaf').length === 1")
        self.browser.evaluate("document.querySelector('.tree button.leaf').click()")
        address = self.browser.evaluate("location.href")
        self.assertIn("names=total%2Cwave.sine", address)
        self.browser.open("about:blank")
        self.browser.open(address)
        self.browser.wait("document.querySelector('[data-value=\"wave.sine\"]')?.textContent.length > 1")

    def test_names_of_the_machine_are_text(self):
        self.begin(netlist=SERVO + "newsig <img/src=x> float\n", view="watch?filter=img")
        self.browser.wait("document.querySelector('.tree').textContent.includes('<img/src=x>')")
        self.assertEqual(0, self.browser.evaluate("document.querySelectorAll('main img').length"))


if __name__ == "__main__":
    if not PANEL.exists():
        print("hal-panel is not built: install libwebsockets-dev and libpugixml-dev")
        sys.exit(77)
    if not have_browser():
        print("no browser: install the Debian package chromium")
        sys.exit(77)
    unittest.main()
