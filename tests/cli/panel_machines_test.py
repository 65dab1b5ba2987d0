#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: panel
"""A page of `hal panel` chooses among several machines: the menu in its header, and what hal panel allows."""


from harness import SERVO, wait_until
from panel_page import Page, main
from web import WebSocket, start_panel

NAMES = ("left", "right")
MENU = "document.getElementById('machines')"
TEXTS = f"[...{MENU}.options].map(one => one.textContent)"


class Machines(Page):
    def begin_both(self, *words):
        self.machines = {name: self.start_one(name) for name in NAMES}
        self.process, self.port, self.token = start_panel(self, "--name", "left", *words)

    def start_one(self, name):
        constant = {"left": 2, "right": 20}[name]
        netlist = self.write(f"{name}.hal", SERVO + f"setp adder.in0 {constant}\n")
        machine = self.start("run", "--name", name, netlist, loaded=False)
        wait_until(
            lambda: self.run_program("shell", "--name", name, "gets", "total").returncode == 0,
            "the machine runs",
        )
        return machine

    def text_of(self, name, state):
        return f"{name}: {name}.hal, process {self.machines[name].pid}, {state}"

    def page(self, **hello):
        socket = WebSocket(self.port, origin=f"http://localhost:{self.port}")
        self.addCleanup(socket.close)
        socket.send({"hello": hello})
        return socket

    def choose(self, name):
        self.browser.evaluate(
            f"{MENU}.value = '{name}'; {MENU}.dispatchEvent(new Event('change'))"
        )
        self.browser.wait(f"window.halcyon?.instance === '{name}' && halcyon.machine")

    def test_the_menu_shows_both_and_switches_the_view(self):
        self.begin_both()
        self.browser = self.kind(self)
        self.open("watch?names=total")
        value = "document.querySelector('[data-value=total]')?.textContent"
        self.browser.wait(f"{value} === '5'")
        both = " | ".join(self.text_of(name, "running") for name in NAMES)
        self.browser.wait(f"{TEXTS}.join(' | ') === '{both}'")
        self.assertEqual("left", self.browser.evaluate(f"{MENU}.value"))
        self.choose("right")
        self.browser.wait(f"{value} === '23'")
        self.browser.wait(f"{MENU}.value === 'right'")
        self.assertIn("names=total", self.browser.evaluate("location.hash"))
        self.assertEqual("?machine=right", self.browser.evaluate("location.search"))
        self.choose("left")
        self.browser.wait(f"{value} === '5'")
        self.assertEqual("", self.browser.evaluate("location.search"))

    def test_a_stopped_and_an_ended_machine_are_shown_as_such(self):
        self.begin_both()
        self.browser = self.kind(self)
        self.open("overview")
        self.good("shell", "--name", "right", "stop")
        self.browser.wait(f"{TEXTS}[1] === '{self.text_of('right', 'stopped')}'")
        self.end(self.machines["right"], 9)
        self.browser.wait(f"{TEXTS}[1] === '{self.text_of('right', 'ended')}'")
        self.browser.evaluate(
            f"{MENU}.value = 'right'; {MENU}.dispatchEvent(new Event('change'))"
        )
        self.browser.wait(
            "/Machine 'right' is not running/.test(document.getElementById('banner').textContent)"
        )
        self.machines["right"] = self.start_one("right")
        self.browser.wait("document.getElementById('banner').hidden && halcyon.machine")
        self.browser.wait(f"{TEXTS}[1] === '{self.text_of('right', 'running')}'")

    def test_one_machine_has_no_menu(self):
        self.begin(token=False)
        self.browser.wait("halcyon.machines.length === 1")
        self.assertTrue(self.browser.evaluate(f"{MENU}.hidden"))
        self.assertEqual("default", self.browser.evaluate("document.querySelector('h1').innerText"))

    def test_each_machine_has_a_page_in_control_and_its_own_log(self):
        self.begin_both("--write")
        pages = {name: self.page(token=self.token, machine=name) for name in NAMES}
        for name, page in pages.items():
            page.expect(lambda m: m.get("event") == "control" and m["held"])
            page.expect(lambda m: m.get("event") == "machine" and m["up"])
            page.send({"id": 1, "set": {"adder.in1": 7}})
        for name, title in (("left", "client 1"), ("right", "client 2 at 'right'")):
            entry = pages[name].expect(lambda m: m.get("kind") == "write")
            self.assertEqual(f"{title}: adder.in1: 3 -> 7", entry["text"])
            pages[name].expect(lambda m: m.get("id") == 1 and m["ok"])
        totals = [self.good("shell", "--name", name, "gets", "total").strip() for name in NAMES]
        self.assertEqual(["9", "27"], totals)
        second = self.page(token=self.token, machine="right")
        self.assertFalse(second.expect(lambda m: m.get("event") == "control")["held"])

    def test_a_panel_with_only_offers_no_other_machine(self):
        self.begin_both("--only")
        page = self.page(machine="right")
        self.assertIsNone(page.read())
        self.assertEqual((1008, "this hal panel shows 'left' only"), page.closed)
        self.assertEqual("left", self.page(machine="left").read()["instance"])

    def test_a_name_that_is_none_is_rejected(self):
        self.begin_both()
        for name in ("../left", "", 7, "x" * 65):
            page = self.page(machine=name)
            self.assertIsNone(page.read())
            self.assertEqual((1008, "invalid name of a machine"), page.closed)


if __name__ == "__main__":
    main()
