#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: panel
"""User panels and PyVCP panels in headless Chromium: their widgets, and what happens when the page is lost."""
import os
import signal

from harness import SERVO, suspend, wait_until
from panel_page import Page, main

WIDGETS = """<pyvcp><vbox>
<label><text>"Spindle"</text></label>
<led halpin="lamp"/><rectled halpin="off" disable_pin="True"/>
<number halpin="n"><format>"+4.2f"</format></number><s32 halpin="count"/><u32 halpin="mask"><format>"x"</format></u32>
<multilabel halpin="m"><legends>["cold","warm","hot"]</legends></multilabel>
<bar halpin="load"><range1>(0,50,"green")</range1></bar><meter halpin="rpm"><text>"rpm"</text></meter><timer halpin="t"/>
<button halpin="go"><text>"Go"</text></button>
<checkbutton halpin="c"><text>"Coolant"</text></checkbutton>
<radiobutton halpin="r"><choices>["one","two","three"]</choices><initval>1</initval></radiobutton>
<spinbox halpin="s" param_pin="1" halparam="s-in"><min_>-5</min_><max_>10</max_><resolution>0.5</resolution></spinbox>
<scale halpin="x"><min_>0</min_><max_>10</max_><resolution>0.1</resolution><orient>HORIZONTAL</orient></scale>
<dial halpin="d" halparam="d-in"><min_>0</min_><max_>3</max_><resolution>0.5</resolution></dial>
<jogwheel halpin="j"><clear_pin>1</clear_pin><scale_pin>1</scale_pin></jogwheel>
<tabs><names>["First","Second"]</names><vbox><led halpin="a"/></vbox><vbox><led halpin="b"/></vbox></tabs>
<table><tablerow/><label><text>"A"</text></label><tablespan columns="2"/><label><text>"B"</text></label>
<tablerow/><number halpin="t1"/><number halpin="t2"/><number halpin="t3"/></table>
</vbox></pyvcp>
"""


class Widgets(Page):
    def pin(self, name):
        return f"document.querySelector('[data-pin=\"{name}\"]')"

    def operate(self, *words, text=WIDGETS, name="p.xml"):
        self.write(name, text)
        self.begin(name, "--write", *words, netlist=SERVO, view="panel")
        self.browser.wait(
            "document.querySelector('[data-output]') !== null && [...document.querySelectorAll('[data-output]')].every(one => !one.disabled)"
        )

    def becomes(self, name, value):
        wait_until(lambda: self.value(name) == value, f"{name} = {value}")

    def key(self, name, key):
        self.browser.evaluate(f"{self.pin(name)}.focus()")
        for kind in ("keyDown", "keyUp"):
            self.browser.call("Input.dispatchKeyEvent", type=kind, key=key, code=key)

    def test_a_button_of_a_user_panel_is_true_while_it_is_pressed(self):
        self.operate(
            text="component jog\nbutton go\nslider speed min=-1 max=1 safe=0\ngauge total of=total max=10\n",
            name="jog.panel",
        )
        self.browser.wait("document.querySelector('[data-widget=meter]').dataset.value === '5'")
        x, y = self.browser.evaluate(
            "(r => [r.x + 5, r.y + 5])(document.querySelector('[data-pin=go]').getBoundingClientRect())"
        )
        self.browser.call(
            "Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, button="left", clickCount=1
        )
        wait_until(lambda: self.value("jog.go") == "TRUE", "pressed")
        self.browser.call(
            "Input.dispatchMouseEvent", type="mouseReleased", x=x, y=y, button="left", clickCount=1
        )
        wait_until(lambda: self.value("jog.go") == "FALSE", "released")
        self.browser.evaluate(
            "const s = document.querySelector('input[type=range]'); s.value = 0.5; s.dispatchEvent(new Event('input'))"
        )
        wait_until(lambda: self.value("jog.speed") == "0.5", "moved")
        self.browser.open("about:blank")
        wait_until(lambda: self.value("jog.speed") == "0", "the page is lost")

    def test_a_page_that_hangs_loses_its_outputs_after_the_timeout(self):
        self.operate(
            text="component jog\ntimeout 400ms\nslider speed min=-1 max=1 safe=0.2\ntoggle keep\n",
            name="jog.panel",
        )
        self.browser.evaluate(
            "const s = document.querySelector('input[type=range]'); s.value = 0.5; s.dispatchEvent(new Event('input')); document.querySelector('input[type=checkbox]').click()"
        )
        self.becomes("jog.speed", "0.5")
        self.becomes("jog.keep", "TRUE")
        os.killpg(self.browser.process.pid, signal.SIGSTOP)  # its connection stays open
        try:
            self.becomes("jog.speed", "0.2")
            self.assertEqual("TRUE", self.value("jog.keep"))
        finally:
            os.killpg(self.browser.process.pid, signal.SIGCONT)
        self.browser.wait("document.querySelector('input[type=range]').value === '0.2'")
        self.browser.evaluate(
            "document.querySelector('input[type=range]').value = -1; document.querySelector('input[type=range]').dispatchEvent(new Event('input'))"
        )
        self.becomes("jog.speed", "-1")

    def test_outputs_stay_safe_after_a_server_that_stood_still(self):
        self.operate(
            text="component jog\ntimeout 400ms\nslider speed min=-1 max=1 safe=0.2\n",
            name="jog.panel",
        )
        move = "document.querySelector('input[type=range]').value = {}; document.querySelector('input[type=range]').dispatchEvent(new Event('input'))"
        self.browser.evaluate(move.format(0.5))
        self.becomes("jog.speed", "0.5")
        suspend(self.process.pid)
        try:
            self.becomes("jog.speed", "0.2")  # by the runtime
        finally:
            os.kill(self.process.pid, signal.SIGCONT)
        self.browser.wait("document.querySelector('input[type=range]').value === '0.2'")
        self.assertEqual("0.2", self.value("jog.speed"))
        self.browser.evaluate(move.format(-1))
        self.becomes("jog.speed", "-1")

    def test_a_killed_browser_and_a_killed_server_lose_the_outputs(self):
        text = "component jog\ntimeout 2s\nslider speed min=-1 max=1 safe=0\n"
        move = "document.querySelector('input[type=range]').value = 0.5; document.querySelector('input[type=range]').dispatchEvent(new Event('input'))"
        self.operate(text=text, name="jog.panel")
        self.browser.evaluate(move)
        self.becomes("jog.speed", "0.5")
        self.browser.end()
        self.becomes("jog.speed", "0")
        self.browser = self.kind(self, folder="browser-2")
        self.open("panel")
        self.browser.wait(
            "document.querySelector('[data-output]') !== null && !document.querySelector('[data-output]').disabled"
        )
        self.browser.evaluate(move)
        self.becomes("jog.speed", "0.5")
        self.process.kill()
        self.becomes("jog.speed", "0")  # by the runtime
        self.browser.wait(
            "/No connection to hal panel/.test(document.getElementById('banner').textContent)"
        )
        self.browser.errors.clear()  # the browser reports each attempt to connect

    def test_outputs_of_pyvcp_widgets(self):
        self.operate()
        self.browser.evaluate(f"{self.pin('c')}.querySelector('input').click()")
        self.becomes("pyvcp.c", "TRUE")
        self.good("shell", "setp", "pyvcp.c.changepin", "TRUE")  # a rising edge toggles
        self.becomes("pyvcp.c", "FALSE")
        self.assertEqual(
            ("FALSE", "TRUE", "FALSE"),
            tuple(self.value(f"pyvcp.r.{name}") for name in ("one", "two", "three")),
        )
        self.browser.evaluate(
            "document.querySelectorAll('[data-widget=radiobutton] input')[2].click()"
        )
        self.becomes("pyvcp.r.three", "TRUE")
        self.becomes("pyvcp.r.two", "FALSE")
        self.browser.evaluate(
            f"const s = {self.pin('s')}; s.value = '99'; s.dispatchEvent(new Event('change'))"
        )
        self.becomes("pyvcp.s", "10")  # its limit
        self.good("shell", "setp", "pyvcp.s-in", "-2")
        self.becomes("pyvcp.s", "-2")
        self.browser.evaluate(
            f"const x = {self.pin('x-f')}.querySelector('input'); x.value = '2.6'; x.dispatchEvent(new Event('input'))"
        )
        self.becomes("pyvcp.x-f", "2.6")
        self.assertEqual("2", self.value("pyvcp.x-i"))
        for _ in range(8):
            self.key("d", "ArrowUp")
        self.becomes("pyvcp.d", "3")  # its limit
        self.good("shell", "setp", "pyvcp.j.scale", "0.5")
        wait_until(
            lambda: (
                self.key("j", "PageUp"),
                float(self.value("pyvcp.j")) % 1 == 0 and float(self.value("pyvcp.j")) > 0,
            )[1],
            "steps of 0.5",
        )
        self.good("shell", "setp", "pyvcp.j.reset", "TRUE")
        self.becomes("pyvcp.j", "0")
        self.key("go", " ")
        self.becomes("pyvcp.go", "FALSE")

    def test_inputs_of_pyvcp_widgets(self):
        self.operate()
        text = lambda name: f"{self.pin(name)}.textContent"  # noqa: E731
        for name, value in (
            ("lamp", "TRUE"),
            ("off", "TRUE"),
            ("n", "12.345"),
            ("count", "-7"),
            ("mask", "255"),
            ("load", "40"),
            ("rpm", "60"),
            ("t1", "1.28"),
            ("off.disable", "TRUE"),
            ("m.legend2", "TRUE"),
            ("t.run", "TRUE"),
        ):
            self.good("shell", "setp", f"pyvcp.{name}", value)
        self.browser.wait(f"{self.pin('lamp')}.querySelector('.w-led').dataset.on === 'true'")
        self.browser.wait(
            f"/disabled/.test({self.pin('off')}.querySelector('.w-led').getAttribute('aria-label'))"
        )
        self.browser.wait(
            f"{text('n')} === '+12.35' && {text('count')} === '-7' && {text('mask')} === 'ff' && {text('t1')} === '1.3'"
        )
        self.browser.wait(
            "document.querySelector('[data-widget=multilabel]').textContent === 'hot'"
        )
        self.browser.wait(
            f"{self.pin('load')}.dataset.value === '40' && {self.pin('rpm')}.dataset.value === '60'"
        )
        self.browser.wait(
            "/00:00:0[1-9]/.test(document.querySelector('[data-widget=timer]').textContent)"
        )
        self.good("shell", "setp", "pyvcp.t.run", "FALSE")
        self.good("shell", "setp", "pyvcp.t.reset", "TRUE")
        self.browser.wait(
            "document.querySelector('[data-widget=timer]').textContent === '00:00:00'"
        )
        self.assertEqual(
            [True, False],
            self.browser.evaluate(
                f"[{self.pin('a')}.offsetParent !== null, {self.pin('b')}.offsetParent !== null]"
            ),
        )
        self.browser.evaluate("document.querySelectorAll('[role=tab]')[1].click()")
        self.assertEqual(
            [False, True],
            self.browser.evaluate(
                f"[{self.pin('a')}.offsetParent !== null, {self.pin('b')}.offsetParent !== null]"
            ),
        )
        columns = self.browser.evaluate(
            "(r => r.map(e => Math.round(e.getBoundingClientRect().width > 0 && e.style.gridColumnStart)))([...document.querySelector('[data-widget=table]').children])"
        )
        self.assertEqual([1, 2, 1, 2, 3], columns)


if __name__ == "__main__":
    main()
