#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: panel
"""linuxcnc_panels_test.py HAL [FOLDER]: each PyVCP panel of LinuxCNC in FOLDER (a source tree, or where Debian's packages put the example
configurations) is read, its component exists in a running machine, and headless Chromium draws all of its widgets without an error. Panels
with a list of pins beside them (`expected` of LinuxCNC's own test) must have exactly these. 77: no panels, no hal-panel, no browser."""
import os
import sys
from pathlib import Path

from checks import skip

HERE = Path(__file__).resolve().parent
os.environ["HAL_BIN"] = sys.argv[1]
sys.path.insert(0, str(HERE.parent / "cli"))
from harness import SERVO, Case, wait_until  # noqa: E402
from web import PANEL, Browser, have_browser, start_panel  # noqa: E402

PLACES = sys.argv[2:] or [
    "/usr/share/linuxcnc",
    "/usr/share/doc/linuxcnc",
    "/usr/share/doc/linuxcnc-doc-en",
]
# Widgets of the layout that the server sends, and those that the page has made of them.
COUNT = """(() => {
    const count = node => node.widget === 'tablerow' ? 0 : 1 + (node.children ?? []).reduce((sum, child) => sum + count(child), 0);
    return [count(halcyon.panel.root), document.querySelectorAll('.w-root, .w-root [data-widget]').length];
})()"""


def panels():
    for place in PLACES:
        for path in sorted(Path(place).rglob("*.xml")):
            if b"<pyvcp" in path.read_bytes():
                yield path


class Peer(Case):
    def runTest(self):
        pass

    def expected_pins(self, path):
        """Name, type and direction of the pins that LinuxCNC's test lists, as `show pin` prints them; the component comes first."""
        lines = [line.split() for line in (path.parent / "expected").read_text().splitlines()]
        return lines[0][0], sorted(
            (name.partition(".")[2], kind, direction) for _, kind, direction, _, name in lines
        )

    def shows(self, path, browser):
        """A sentence about what is wrong, or an empty text."""
        expected = path.name == "test.xml" and (path.parent / "expected").exists()
        component, pins = self.expected_pins(path) if expected else ("pyvcp", None)
        process, port, token = start_panel(self, path, "--write", "--component", component)
        try:
            browser.errors.clear()
            browser.open(f"http://localhost:{port}/#t={token}")
            browser.wait(
                "halcyon.panel && halcyon.held && document.querySelector('.w-root') !== null"
            )
            wanted, drawn = browser.evaluate(COUNT)
            browser.wait(
                "[...document.querySelectorAll('.w-root [data-output]')].every(one => !one.disabled)"
            )
            if browser.errors:
                return browser.errors[0]
            if wanted != drawn:
                return f"{drawn} of {wanted} widgets drawn"
            if pins is None:
                return ""
            wait_until(
                lambda: f"{component}." in self.shell("list", "pin").stdout, "the pins exist"
            )
            rows = [
                line.split() for line in self.shell("show", "pin", component).stdout.splitlines()
            ]
            found = sorted(
                (row[4].partition(".")[2], row[1], row[2])
                for row in rows
                if len(row) > 4 and row[4].startswith(component + ".")
            )
            return "" if found == pins else f"pins differ: {sorted(set(found) ^ set(pins))}"
        finally:
            browser.open("about:blank")
            process.kill()
            process.communicate()


if not PANEL.exists():
    skip("hal-panel is not built: install libwebsockets-dev and libpugixml-dev")
if not have_browser():
    skip("no browser: install the Debian package chromium")
files = list(panels())
if not files:
    skip(
        "no panels of LinuxCNC here: install the Debian package linuxcnc-uspace, or name the folder of a source tree"
    )
case = Peer()
case.setUp()
failed = 0
try:
    case.start("run", case.write("m.hal", SERVO))
    page = Browser(case)
    for file in files:
        try:
            problem = case.shows(file, page)
        except AssertionError as error:
            problem = str(error)
        failed += problem != ""
        print(f"{'FAIL' if problem else 'ok  '} {file} {problem}".rstrip(), flush=True)
finally:
    case.doCleanups()
print(f"{len(files) - failed} of {len(files)} panels are shown")
sys.exit(failed != 0)
