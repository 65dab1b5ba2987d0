#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen panel
"""Each view of the page of `hal panel` in headless Firefox, without errors in its console."""
from firefox import Firefox, have_firefox
from panel_page import Page, main


class InFirefox(Page):
    kind = Firefox

    def test_each_view_shows_the_machine(self):
        self.write(
            "p.panel",
            "gauge total of=total max=10\nslider speed min=-1 max=1\nchart sine of=sine min=-1 max=1\n",
        )
        self.begin("p.panel", view="log")
        for view, ready in (
            (
                "overview",
                "Number(document.querySelector('[data-thread=servo] .figures dd:nth-of-type(2)')?.textContent) > 10",
            ),
            (
                "graph",
                "Number(document.querySelector('canvas')?.dataset.boxes) === 2 && Number(document.querySelector('canvas').dataset.values) >= 1",
            ),
            (
                "scope?ch=sine,total&mode=auto&trigger=sine&base=0.02",
                "window.halcyonScope?.rows > 100 && halcyonScope.lost === 0",
            ),
            (
                "watch?names=total,sine",
                "document.querySelector('[data-value=total]')?.textContent === '5'",
            ),
            ("networks", "/no CANopen/.test(document.getElementById('main').innerText)"),
            ("log", "/is running/.test(document.getElementById('log').innerText)"),
            ("panel", "document.querySelector('[data-widget=meter]').dataset.value === '5'"),
        ):
            self.browser.evaluate(f"location.hash = '#/{view}'")
            self.browser.wait(ready)
        self.end(self.machine, 9)
        self.browser.wait("/not running/.test(document.getElementById('banner').textContent)")


if __name__ == "__main__":
    main(have_firefox, "firefox-esr")
