#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: panel
"""The component of a panel: when the machine rejects it, and what its outputs have when the panel starts again."""
import sys
import unittest

from harness import SERVO, Case, wait_until
from web import PANEL, WebSocket, start_panel

SWING = """component swing
timeout 60s
dial speed min=0 max=10 initial=3
toggle lamp initial=TRUE
slider push min=-1 max=1 initial=0.5 safe=0.25
"""


class PanelComponent(Case):
    def test_a_component_that_exists(self):
        self.start("run", self.write("m.hal", SERVO))
        self.write("jog.panel", "component jog\ntoggle pump\n")
        start_panel(self, "jog.panel", "--write")
        wait_until(lambda: self.value("jog.pump") == "FALSE", "the first panel has its pins")
        start_panel(self, "jog.panel", "--write")
        errors = self.folder / "panel.err"
        wait_until(lambda: errors.read_text().endswith("\n"), "the second one is rejected")
        self.assertRegex(
            errors.read_text(),
            r"^hal panel: the machine rejects the panel's component: the name 'jog' is in use by process \d+ \(ready\)\n$",
        )

    def page(self):
        """Starts the panel and a page that has control."""
        self.write("swing.panel", SWING)
        self.panel, port, token = start_panel(self, "swing.panel", "--write")
        page = WebSocket(port, origin=f"http://localhost:{port}")
        self.addCleanup(page.close)
        page.send({"hello": {"token": token}})
        self.values = page.expect(lambda m: m.get("event") == "panel" and m["ready"])["values"]
        return page

    def kill_panel(self):
        self.panel.kill()
        self.panel.wait()
        wait_until(lambda: "dead" in self.good("shell", "show", "comp", "swing"), "it is dead")

    def outputs(self):
        return [self.value("swing." + pin) for pin in ("speed", "lamp", "push")]

    def test_outputs_without_a_safe_value_keep_theirs_when_the_panel_is_started_again(self):
        self.machine = self.start(
            "run", self.write("m.hal", SERVO + "loadrt minmax\naddf minmax.0 servo\n")
        )
        page = self.page()
        self.assertEqual(["3", "TRUE", "0.25"], self.outputs())
        page.send({"panel": {"write": {"speed": 7, "lamp": False, "push": -1}}})
        wait_until(lambda: self.outputs() == ["7", "FALSE", "-1"], "the values arrive")
        self.good("shell", "net", "speed", "swing.speed", "=>", "minmax.0.in")
        self.good("shell", "setp", "minmax.0.reset", "TRUE")
        wait_until(lambda: self.value("minmax.0.min") == "7", "the limits start again")
        self.good("shell", "setp", "minmax.0.reset", "FALSE")

        self.kill_panel()
        page = self.page()
        self.assertEqual({"speed": 7, "lamp": False, "push": 0.25}, self.values)
        wait_until(lambda: self.outputs() == ["7", "FALSE", "0.25"], "the panel has its pins")
        page.send({"panel": {}})
        wait_until(lambda: self.value("swing.push") == "0.5", "the page has control")
        self.assertEqual(["7", "7"], [self.value(f"minmax.0.{limit}") for limit in ("min", "max")])

        # a panel that runs gives its values to a machine that is started again
        self.end(self.machine, 9)
        page.expect(lambda m: m.get("event") == "machine" and not m["up"])
        page.send({"panel": {"write": {"lamp": True}}})
        self.machine = self.start("run", "m.hal")
        page.expect(lambda m: m.get("event") == "panel" and m["ready"])
        wait_until(lambda: self.outputs() == ["7", "TRUE", "0.5"], "the new machine has them")

        # without a machine that kept them, the initial values count
        self.panel.kill()
        self.panel.wait()
        self.end(self.machine, 9)
        self.machine = self.start("run", "m.hal")
        self.page()
        self.assertEqual(["3", "TRUE", "0.25"], self.outputs())


if __name__ == "__main__":
    if not PANEL.exists():
        print("hal-panel is not built: install libwebsockets-dev and libpugixml-dev")
        sys.exit(77)
    unittest.main()
