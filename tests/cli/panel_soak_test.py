#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: panel
"""The page of `hal panel` in headless Chromium for 20 s: its memory and that of the server do not grow."""
import re
import time
from pathlib import Path

from harness import SANITIZED
from panel_page import Page, main


class Soak(Page):
    def test_a_page_that_is_open_for_long_does_not_grow(self):
        names = ",".join(f"wave{i}.sine" for i in range(16))
        netlist = (
            "loadrt threads name1=servo period1=100000\nloadrt siggen names="
            + ",".join(f"wave{i}" for i in range(16))
            + "\n"
        )
        self.begin(
            netlist=netlist
            + "".join(
                f"setp wave{i}.frequency {i + 1}\naddf wave{i}.update servo\n" for i in range(16)
            ),
            view=f"scope?ch={names}",
            token=False,
        )
        views = (
            f"scope?ch={names}",
            "overview",
            "graph",
            f"watch?names={names}",
            "networks",
            "log",
        )

        def round_of_views():
            """Each view for half a second; then KB of the page's heap, of the server, and how many nodes and listeners remain."""
            for view in views[1:] + views[:1]:
                self.browser.evaluate(f"location.hash = '#/{view}'")
                self.browser.wait(
                    f"document.getElementById('main').children.length > 0 && location.hash.startsWith('#/{view.partition('?')[0]}')"
                )
                rows = self.browser.evaluate("halcyon.stats.bytes")
                self.browser.wait(f"halcyon.stats.bytes > {rows} + 100")
            self.browser.wait("halcyonScope.rows > 5000")
            self.browser.call("HeapProfiler.collectGarbage")
            seen = {
                one["name"]: one["value"]
                for one in self.browser.call("Performance.getMetrics")["metrics"]
            }
            rss = int(
                re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{self.process.pid}/status").read_text())[
                    1
                ]
            )
            return seen["JSHeapUsedSize"] / 1000, rss, seen["Nodes"], seen["JSEventListeners"]

        self.browser.call("Performance.enable")
        for _ in range(2):
            first = round_of_views()
        deadline = time.monotonic() + 20
        while time.monotonic() < deadline:
            last = round_of_views()
        for what, before, after, most in zip(
            ("KB of the page", "KB of the server", "nodes", "listeners"),
            first,
            last,
            (1500, 3000, 400, 60),
        ):
            if SANITIZED and what == "KB of the server":
                continue  # the sanitizer keeps what is freed
            self.assertLess(after - before, most, f"{what}: from {before} to {after}")


if __name__ == "__main__":
    main()
