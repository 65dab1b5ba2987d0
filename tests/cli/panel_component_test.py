#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: panel
"""A panel whose component the machine rejects states it where it was started."""
import sys
import unittest

from harness import SERVO, Case, wait_until
from web import PANEL, start_panel


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


if __name__ == "__main__":
    if not PANEL.exists():
        print("hal-panel is not built: install libwebsockets-dev and libpugixml-dev")
        sys.exit(77)
    unittest.main()
