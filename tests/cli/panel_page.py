# SPDX-License-Identifier: MIT
"""What the tests of the page share: a machine, `hal panel`, a headless browser with the page open."""
import sys
import unittest

from harness import SERVO, Case
from web import PANEL, Browser, have_browser, start_panel

WAVE = (
    SERVO
    + """loadrt siggen names=wave
addf wave.update servo
setp wave.frequency 5
net sine wave.sine
"""
)


class Page(Case):
    kind = Browser

    def begin(self, *words, netlist=WAVE, view="overview", token=True):
        self.machine = self.start("run", self.write("m.hal", netlist))
        self.process, self.port, self.token = start_panel(self, *words)
        self.browser = self.kind(self)
        self.open(view, token)

    def open(self, view, token=True):
        if token and self.token:
            self.browser.open(f"http://localhost:{self.port}/#t={self.token}")
            self.browser.wait("window.halcyon?.machine && location.hash.startsWith('#/')")
            self.browser.evaluate(f"location.hash = '#/{view}'")
        else:
            self.browser.open(f"http://localhost:{self.port}/#/{view}")
        self.browser.wait(
            "window.halcyon?.machine && document.getElementById('main').children.length > 0"
        )

    def tearDown(self):
        if hasattr(self, "browser"):
            self.assertEqual([], self.browser.errors)


def main(available=have_browser, package="chromium"):
    """Runs the tests of a file; skipped without a browser."""
    if not PANEL.exists():
        print("hal-panel is not built: install libwebsockets-dev and libpugixml-dev")
        sys.exit(77)
    if not available():
        print(f"no browser: install the Debian package {package}")
        sys.exit(77)
    unittest.main()
