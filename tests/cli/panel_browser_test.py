#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The page of `hal panel` in headless Chromium, driven over the DevTools protocol."""
import sys
import unittest

from harness import SERVO, Case, wait_until
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

    def test_the_graph_shows_boxes_values_and_the_latency_of_a_reader(self):
        self.begin(netlist=WAVE + "loadrt sum2 names=next\naddf next servo\nnet total next.in0\n", view="graph?pin=total")
        self.browser.wait("Number(document.querySelector('canvas')?.dataset.boxes) === 3 && Number(document.querySelector('canvas')?.dataset.values) >= 1")
        self.browser.wait("/next\\.in0[^]*0 cycles/.test(document.querySelector('.floating').innerText)")
        self.assertIn("written by adder.out", self.browser.evaluate("document.querySelector('.floating').innerText"))

    def test_the_scope_triggers_on_the_right_sample(self):
        self.begin(view="scope?ch=sine:0.5:0&mode=normal&trigger=sine&edge=rising&level=0.5&base=0.1")
        self.browser.wait("window.halcyonScope?.shownAt && halcyonScope.rows > 50 && halcyonScope.lost === 0")
        # The samples on both sides of the trigger, which is at 20 % of the record.
        before, after = self.browser.evaluate("""(() => { const s = halcyonScope, at = s.shownAt - s.pre * 4, [g, c] = s.store.place.get('sine'), row = g.row(at);
            return [g.value(c, row - 1), g.value(c, row)]; })()""")
        self.assertLess(before, 0.5 + 1e-9)
        self.assertGreaterEqual(after, 0.5 - 1e-9)
        frequency = self.browser.wait("parseFloat(document.querySelector('[data-channel=sine]').children[5].textContent)")
        self.assertAlmostEqual(5, frequency, delta=1)

    def test_a_batch_of_a_probe_is_read_to_the_last_bit(self):
        self.begin()
        result = self.browser.evaluate("""(async () => {
            const {Store, Trigger, measure} = await import('./scope_data.js'), store = new Store(), rows = 1000, view = new DataView(new ArrayBuffer(rows * 32));
            store.layout([{columns: [0, 1]}], ['x', 'n']);
            for (let i = 0; i < rows; i++) {
                view.setBigUint64(32 * i, BigInt(i < 500 ? i : i + 3), true);
                view.setBigInt64(32 * i + 8, 1000000000000n + BigInt(i) * 100000n, true);
                view.setFloat64(32 * i + 16, Math.sin(2 * Math.PI * 50 * i * 1e-4), true);
                view.setBigInt64(32 * i + 24, BigInt(-i), true);
            }
            store.samples({parts: [{group: 0, rows, lost: 3}], until_ns: 1000000000000 + rows * 100000}, view, {columns: [{type: 'float'}, {type: 's32'}]});
            const edges = new Trigger('x', 'rising', 0).scan(store), seen = measure(store, 'x', 0, 1);
            return {rows: store.rows, lost: store.lost, gaps: store.gaps, least: measure(store, 'n', 0, 1).min, edges: edges.map(t => Math.round(t * 1e6)), rms: seen.rms, frequency: seen.frequency};
        })()""")
        self.assertEqual({"rows": 1000, "lost": 3, "gaps": 1, "least": -999, "edges": [20000, 40000, 60000, 80000]},
                         {key: result[key] for key in ("rows", "lost", "gaps", "least", "edges")})
        self.assertAlmostEqual(0.5 ** 0.5, result["rms"], places=4)
        self.assertAlmostEqual(50, result["frequency"], places=4)

    def test_a_button_of_a_user_panel_is_true_while_it_is_pressed(self):
        self.write("jog.panel", "component jog\nbutton go\nslider speed min=-1 max=1 safe=0\ngauge total of=total max=10\n")
        self.begin("jog.panel", "--write", view="panel")
        self.browser.wait("document.querySelector('[data-pin=go]') && !document.querySelector('[data-pin=go]').disabled")
        self.browser.wait("document.querySelector('[data-widget=meter]').dataset.value === '5'")
        x, y = self.browser.evaluate("(r => [r.x + 5, r.y + 5])(document.querySelector('[data-pin=go]').getBoundingClientRect())")
        self.browser.call("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, button="left", clickCount=1)
        wait_until(lambda: self.value("jog.go") == "TRUE", "pressed")
        self.browser.call("Input.dispatchMouseEvent", type="mouseReleased", x=x, y=y, button="left", clickCount=1)
        wait_until(lambda: self.value("jog.go") == "FALSE", "released")
        self.browser.evaluate("const s = document.querySelector('input[type=range]'); s.value = 0.5; s.dispatchEvent(new Event('input'))")
        wait_until(lambda: self.value("jog.speed") == "0.5", "moved")
        self.browser.open("about:blank")
        wait_until(lambda: self.value("jog.speed") == "0", "the page is lost")

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
