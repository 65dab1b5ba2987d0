#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen panel
"""The page of `hal panel` in headless Chromium, driven over the DevTools protocol: its views."""

from pathlib import Path

from harness import SERVO, wait_until
from panel_page import WAVE, Page, main
from web import start_panel


class Views(Page):
    def test_overview_shows_the_threads_and_a_killed_machine(self):
        self.begin()
        self.browser.wait(
            "Number(document.querySelector('[data-thread=servo] .figures dd:nth-of-type(2)')?.textContent) > 10"
        )
        self.browser.wait("/No faults/.test(document.body.innerText)")
        self.end(self.machine, 9)
        self.browser.wait(
            "document.body.classList.contains('stale') && /not running/.test(document.getElementById('banner').textContent)"
        )
        self.machine = self.start("run", self.write("m.hal", WAVE))
        self.browser.wait(
            "!document.body.classList.contains('stale') && document.getElementById('banner').hidden"
        )
        before = self.browser.evaluate(
            "Number(document.querySelector('[data-thread=servo] .figures dd:nth-of-type(2)').textContent)"
        )
        self.browser.wait(
            f"Number(document.querySelector('[data-thread=servo] .figures dd:nth-of-type(2)').textContent) != {before}"
        )

    def test_a_stopped_machine_is_shown_as_not_responding(self):
        self.begin()
        self.machine.send_signal(19)
        try:
            self.browser.wait(
                "/does not respond/.test(document.getElementById('banner').textContent)"
            )
        finally:
            self.machine.send_signal(18)
        self.browser.wait("document.getElementById('banner').hidden")

    def test_watch_sets_values_only_with_the_token(self):
        self.begin("--write", view="watch?names=total,adder.in0", token=False)
        self.browser.wait("document.querySelector('[data-value=total]')?.textContent === '5'")
        self.assertTrue(self.browser.evaluate("document.querySelector('button.set').disabled"))
        self.assertEqual(
            "read-only: no token",
            self.browser.evaluate("document.getElementById('role').textContent"),
        )
        self.open("watch?names=total,adder.in0")
        self.browser.wait(
            "document.querySelector('button.set') && !document.querySelector('button.set').disabled"
        )
        self.assertNotIn(self.token, self.browser.evaluate("location.href"))
        self.browser.evaluate(
            "document.querySelector('input.set').value = '40'; document.querySelector('button.set').click()"
        )
        self.browser.wait("document.querySelector('[data-value=total]').textContent === '43'")
        self.assertEqual("40", self.value("adder.in0"))

    def test_watch_rejects_values_beyond_their_type_and_undoes_the_last_change(self):
        netlist = WAVE + "newsig count s32\n"
        self.begin("--write", netlist=netlist, view="watch?names=adder.in0,count,wave.frequency")
        self.browser.wait("document.querySelectorAll('input.set:not(:disabled)').length === 3")
        self.browser.evaluate("""window.put = (row, value) => {
            const line = document.querySelectorAll('tbody tr')[row];
            line.querySelector('input.set').value = value;
            line.querySelector('button.set').click();
        }""")
        problem = "document.getElementById('watch-problem').textContent"
        undo = "document.getElementById('undo')"
        self.assertTrue(self.browser.evaluate(f"{undo}.hidden"))
        self.browser.evaluate("put(1, '3000000000')")
        self.assertEqual(
            "count: 3000000000 is out of the range of s32: -2147483648 .. 2147483647",
            self.browser.evaluate(problem),
        )
        self.browser.evaluate("put(0, '1,5')")
        self.assertEqual(
            "adder.in0: '1,5' is not a number; write 1.5", self.browser.evaluate(problem)
        )
        self.assertEqual(
            ("2", "0"), (self.value("adder.in0"), self.good("shell", "gets", "count").strip())
        )
        self.browser.evaluate("put(0, '1.5')")
        self.browser.wait(f"{undo}.textContent === 'Undo: adder.in0 back to 2'")
        self.assertEqual(("1.5", ""), (self.value("adder.in0"), self.browser.evaluate(problem)))
        self.browser.evaluate("put(1, '-7')")
        self.browser.wait(f"{undo}.textContent === 'Undo: count back to 0'")
        self.browser.evaluate(f"{undo}.click()")
        self.browser.wait(f"{undo}.textContent === 'Undo: count back to -7'")
        self.assertEqual(
            ("1.5", "0"), (self.value("adder.in0"), self.good("shell", "gets", "count").strip())
        )
        self.browser.wait("document.querySelectorAll('.setter')[2].textContent.startsWith('Hz')")

    def test_watch_lists_are_saved_by_name(self):
        self.begin(view="watch?names=total,adder.in0", token=False)
        button = "[...document.querySelectorAll('button')].find(b => b.textContent === '{}')"
        self.browser.wait("document.querySelector('[data-value=total]')?.textContent === '5'")
        self.assertTrue(self.browser.evaluate(button.format("Save list") + ".disabled"))
        self.browser.evaluate(
            "(() => { const t = document.querySelector('[aria-label=\"Name of the list\"]'); t.value = 'sums'; t.dispatchEvent(new Event('input')); })()"
        )
        self.browser.evaluate(button.format("Save list") + ".click()")
        self.open("watch", token=False)
        choice = "document.querySelector('[aria-label=\"Saved watch list\"]')"
        self.browser.wait(
            f"{choice}?.options.length === 2 && !document.querySelector('[data-value]')"
        )
        self.browser.evaluate(
            f"{choice}.value = 'sums'; {choice}.dispatchEvent(new Event('change'))"
        )
        self.browser.wait("document.querySelector('[data-value=total]')?.textContent === '5'")
        self.assertIn("names=total%2Cadder.in0", self.browser.evaluate("location.href"))
        self.browser.evaluate(button.format("Delete list") + ".click()")
        self.browser.wait(f"{choice}.disabled")

    def test_names_are_in_natural_order(self):
        netlist = SERVO + "loadrt siggen names=axis10,axis9,axis2\n"
        self.begin(netlist=netlist, view="watch?filter=sine")
        leaves = "[...document.querySelectorAll('.leaf')].map(leaf => leaf.textContent).filter(name => name.endsWith('.sine'))"
        self.assertEqual(
            ["axis2.sine", "axis9.sine", "axis10.sine"],
            self.browser.wait(f"{leaves}.length === 3 && {leaves}"),
        )

    def test_a_view_is_restored_from_its_address(self):
        self.begin(view="watch?names=total", token=False)
        self.browser.wait("document.querySelector('[data-value=total]')?.textContent === '5'")
        self.browser.evaluate(
            "[...document.querySelectorAll('.tree summary')].forEach(s => s.parentNode.open = true)"
        )
        self.browser.evaluate(
            "const f = document.querySelector('input[type=search]'); f.value = 'wave.sine'; f.dispatchEvent(new Event('input'))"
        )
        self.browser.wait("document.querySelectorAll('.tree button.leaf').length === 1")
        self.browser.evaluate("document.querySelector('.tree button.leaf').click()")
        address = self.browser.evaluate("location.href")
        self.assertIn("names=total%2Cwave.sine", address)
        self.browser.open("about:blank")
        self.browser.open(address)
        self.browser.wait(
            "document.querySelector('[data-value=\"wave.sine\"]')?.textContent.length > 1"
        )

    def test_the_graph_shows_boxes_values_and_the_latency_of_a_reader(self):
        self.begin(
            netlist=WAVE + "loadrt sum2 names=next\naddf next servo\nnet total next.in0\n",
            view="graph?pin=total",
        )
        self.browser.wait(
            "Number(document.querySelector('canvas')?.dataset.boxes) === 3 && Number(document.querySelector('canvas')?.dataset.values) >= 1"
        )
        self.browser.wait(
            "/^next\\.in0\\n0 cycles \\(servo[^\"]*\\)$/.test(document.querySelector('.floating li')?.innerText)"
        )
        self.assertIn(
            "written by adder.out",
            self.browser.evaluate("document.querySelector('.floating').innerText"),
        )

    def test_a_graph_without_boxes_says_why(self):
        netlist = "loadrt threads name1=servo period1=1000000\nloadrt sum2 names=a,b\nstart\n"
        self.begin(netlist=netlist, view="graph", token=False)
        shown = "document.getElementById('graph-empty')"
        self.browser.wait(f"{shown}.hidden === false")
        self.assertEqual(
            "No instance has links. The button above lists the instances.",
            self.browser.evaluate(f"{shown}.textContent"),
        )
        self.assertIn(
            "2 instances without links",
            self.browser.evaluate("document.querySelector('.bar').textContent"),
        )
        self.good("shell", "net", "s", "a.out", "b.in0")
        self.browser.evaluate("location.reload()")
        self.browser.wait(
            f"{shown}.hidden && document.querySelector('canvas').dataset.boxes === '2'"
        )

    def test_the_graph_of_300_instances_folds_groups_and_search_opens_them(self):
        axes, parts = range(25), ("siggen", "limit3", "pid", "scale", "lowpass", "integ")
        netlist = "loadrt threads name1=servo period1=1000000\n"
        for part in parts + ("sum2", "comp", "wcomp", "mux2", "and2", "not"):
            netlist += f"loadrt {part} names={','.join(f'axis{n}-{part}' for n in axes)}\n"
        for n in axes:
            netlist += f"""net target{n} axis{n}-siggen.sine => axis{n}-limit3.in
net command{n} axis{n}-limit3.out => axis{n}-pid.command
net output{n} axis{n}-pid.output => axis{n}-scale.in
net drive{n} axis{n}-scale.out => axis{n}-lowpass.in
net speed{n} axis{n}-lowpass.out => axis{n}-integ.in
net position{n} axis{n}-integ.out => axis{n}-pid.feedback
"""
        netlist += "net follow axis0-pid.error => axis1-sum2.in0\n"
        self.begin(netlist=netlist, view="graph", token=False)
        boxes = "Number(document.querySelector('canvas')?.dataset.boxes)"
        self.browser.wait(f"{boxes} === 25")
        bar = "document.querySelector('.bar').textContent"
        self.assertIn("149 instances without links", self.browser.evaluate(bar))
        self.assertIn("25 boxes, 1 link", self.browser.evaluate(bar))
        search = "(text => {{ const i = document.querySelector('input[type=search]'); i.value = text; i.dispatchEvent(new Event('change')); }})('{}')"
        self.browser.evaluate(search.format("axis7-pid.output"))
        self.browser.wait(f"{boxes} === 24 + 6")
        self.browser.wait("/signal output7/.test(document.querySelector('.floating').innerText)")
        self.assertIn("open=axis7", self.browser.evaluate("location.hash"))
        self.browser.evaluate(search.format("axis9-and2"))
        self.browser.wait("/no pin is linked/.test(document.querySelector('.floating').innerText)")
        press = "[...document.querySelectorAll('button')].find(b => b.textContent === '{}').click()"
        self.browser.evaluate(press.format("Fold groups"))
        self.browser.wait(f"{boxes} === 25")
        self.browser.evaluate(press.format("Open groups"))
        self.browser.wait(f"{boxes} === 151")
        self.browser.evaluate(
            "(() => { const s = document.querySelector('[aria-label=Groups]'); s.value = 'component'; s.dispatchEvent(new Event('change')); })()"
        )
        self.browser.wait(f"{boxes} === 7")
        self.assertIn("group=component", self.browser.evaluate("location.hash"))

    def test_the_graph_of_a_phone_is_readable_and_moves_under_fingers(self):
        machine = Path(__file__).resolve().parents[2] / "halfiles/canopen-robot/match.hal"
        self.start("run", str(machine), loaded=False)
        wait_until(lambda: self.shell("show", "thread").returncode == 0, "the machine runs")
        self.process, self.port, self.token = start_panel(self)
        self.browser = self.kind(self)
        self.browser.size(390, 844)
        self.browser.call("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
        self.open("graph")
        canvas = "document.querySelector('.fill > canvas')"

        def view():
            return [float(part) for part in self.browser.evaluate(f"{canvas}.dataset.view").split()]

        def touch(kind, *places):
            points = [{"x": x, "y": y + top, "id": i} for i, (x, y) in enumerate(places)]
            self.browser.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)

        self.browser.wait(f"Number({canvas}.dataset.boxes) === 38 && {canvas}.dataset.view")
        top = self.browser.evaluate(f"{canvas}.getBoundingClientRect().top")
        x, y, scale = view()
        self.assertGreaterEqual(12 * scale, 11)  # px of its text
        self.assertGreaterEqual(x, 0)
        touch("touchStart", (200, 500))
        touch("touchMove", (200, 450))
        touch("touchMove", (190, 300))
        touch("touchEnd")
        self.browser.wait(f"{canvas}.dataset.view === '{x - 10:.3f} {y - 200:.3f} {scale:.3f}'")
        touch("touchStart", (150, 400), (250, 400))
        touch("touchMove", (150, 400), (350, 400))
        touch("touchEnd")
        self.browser.wait(f"Math.abs({canvas}.dataset.view.split(' ')[2] - {2 * scale}) < 0.01")
        self.browser.evaluate(
            "(() => { const i = document.querySelector('input[type=search]'); i.value = 'base.x'; i.dispatchEvent(new Event('change')); })()"
        )
        self.browser.wait("/written by base.x/.test(document.querySelector('.floating').innerText)")
        self.browser.wait("location.hash.includes('expanded=base')")
        x, y, scale = view()
        self.assertGreaterEqual(12 * scale, 11)
        height, touched = self.browser.evaluate(f"{canvas}.clientHeight"), set()
        for across in range(20, 380, 20):  # one of them is in the box that the search has flown to
            touch("touchStart", (across, 0.27 * height))
            touch("touchEnd")
            touched.add(self.browser.evaluate("new URLSearchParams(location.hash).get('pin') ?? ''"))
        self.assertTrue([name for name in touched if name.startswith("base.")], touched)
        self.browser.size(844, 390)
        self.browser.wait(f"{canvas}.clientWidth > 600 && 12 * {canvas}.dataset.view.split(' ')[2] < 11")

    def test_the_scope_triggers_on_the_right_sample(self):
        self.begin(
            view="scope?ch=sine:0.5:0&mode=normal&trigger=sine&edge=rising&level=0.5&base=0.1"
        )
        self.browser.wait(
            "window.halcyonScope?.shownAt && halcyonScope.rows > 50 && halcyonScope.lost === 0"
        )
        # The samples on both sides of the trigger, which is at 20 % of the record.
        before, after = self.browser.evaluate(
            """(() => { const s = halcyonScope, at = s.shownAt - s.pre * 4, [g, c] = s.store.place.get('sine'), row = g.row(at);
            return [g.value(c, row - 1), g.value(c, row)]; })()"""
        )
        self.assertLess(before, 0.5 + 1e-9)
        self.assertGreaterEqual(after, 0.5 - 1e-9)
        frequency = self.browser.wait(
            "parseFloat(document.querySelector('[data-channel=sine]').children[10].textContent)"
        )
        self.assertAlmostEqual(5, frequency, delta=1)

    def test_an_unknown_channel_is_rejected_and_the_record_goes_on(self):
        self.begin(view="scope?ch=sine:0.5:0&base=0.1")
        self.browser.wait("window.halcyonScope?.rows > 50")
        self.browser.evaluate("window.store = halcyonScope.store")
        add = "(name => { const i = document.querySelector('[aria-label=\"Add a channel\"]'); i.value = name; i.dispatchEvent(new Event('change')); })"
        problem = "document.getElementById('scope-problem').textContent"
        self.browser.evaluate(f"{add}('totl')")
        self.browser.wait(f"{problem} === \"unknown name 'totl'; did you mean: total\"")
        rows = self.browser.evaluate("store.rows")
        self.browser.wait(f"store.rows > {rows} && store.place.has('sine')")
        self.assertIn("ch=sine:0.5:0&base=0.1", self.browser.evaluate("location.hash"))
        self.assertIn(
            "every cycle",
            self.browser.evaluate("document.getElementById('scope-status').textContent"),
        )
        self.browser.evaluate(f"{add}('sine')")
        self.browser.wait(f"{problem} === \"'sine' is already shown\"")
        self.browser.evaluate(f"{add}('totl')")
        self.browser.wait("document.querySelector('#scope-problem button') !== null")
        self.browser.evaluate("document.querySelector('#scope-problem button').click()")
        self.browser.wait("store.place.has('total') && store.place.has('sine') && store.rows > 50")
        self.assertEqual("", self.browser.evaluate(problem))

    def test_an_unknown_channel_of_an_address_leaves_the_others(self):
        self.begin(view="scope?ch=later,sine&base=0.1")
        name = "document.querySelector('[data-channel=later]').textContent"
        self.browser.wait("window.halcyonScope?.rows > 50 && halcyonScope.store.place.has('sine')")
        self.assertIn("unknown name", self.browser.evaluate(name))
        self.end(self.machine)
        self.machine = self.start(
            "run",
            self.write("m.hal", WAVE + "net later adder.in2\n".replace("adder.in2", "wave.cosine")),
        )
        self.browser.wait("halcyonScope.store.place.has('later') && halcyonScope.rows > 50")
        self.assertNotIn("unknown name", self.browser.evaluate(name))

    def test_the_scope_saves_a_table_and_a_picture(self):
        self.begin(view="scope?ch=sine:0.5:0,total:2:0&base=0.01")
        self.browser.wait("window.halcyonScope?.rows > 200")
        self.browser.evaluate("""window.saved = {};
            URL.createObjectURL = blob => { blob.arrayBuffer().then(b => saved[blob.type] = b); return 'blob:none'; };
            HTMLAnchorElement.prototype.click = function() { saved.name = this.download; };
            window.press = label => [...document.querySelectorAll('button')].find(b => b.textContent === label).click();
            press('Stop'); press('CSV');""")
        table = self.browser.wait(
            "saved['text/csv'] && new TextDecoder().decode(saved['text/csv'])"
        )
        self.assertEqual("scope.csv", self.browser.evaluate("saved.name"))
        lines = table.splitlines()
        self.assertEqual("time_s,sine,total", lines[0])
        self.assertAlmostEqual(100, len(lines) - 1, delta=5)  # 0.1 s of a thread of 1 ms
        rows = [line.split(",") for line in lines[1:]]
        self.assertEqual({"5"}, {row[2] for row in rows})
        self.assertGreater(len({row[1] for row in rows}), 50)
        self.browser.evaluate("press('PNG')")
        head = self.browser.wait(
            "saved['image/png'] && [...new Uint8Array(saved['image/png'].slice(0, 4))]"
        )
        self.assertEqual([0x89, 0x50, 0x4E, 0x47], head)

    def test_the_scope_measures_between_cursors(self):
        self.begin(view="scope?ch=wave.square:1:0&base=0.1&cursors=1")
        # Two periods of a square wave of 5 Hz lie between the cursors.
        self.browser.wait("window.halcyonScope?.rows > 1200")
        self.browser.evaluate(
            "[...document.querySelectorAll('button')].find(b => b.textContent === 'Stop').click()"
        )
        cell = "document.querySelector('[data-channel=\"wave.square\"]').children[{}].textContent"
        cells = lambda: [self.browser.evaluate(cell.format(i)) for i in range(5, 11)]
        self.browser.wait(cell.format(8) + " !== '–'")
        low, high, mean, rms, deviation = map(float, cells()[:5])
        self.assertEqual((-1, 1, 1), (low, high, rms))
        self.assertAlmostEqual(1, mean**2 + deviation**2, places=2)

    def test_the_scope_shows_the_spectrum_of_the_selected_channel(self):
        self.begin(view="scope?ch=sine:0.5:0&base=0.2&spectrum=1")
        self.browser.wait("window.halcyonScope?.rows > 2200")
        peak = self.browser.wait("halcyonScope.peak")
        self.assertAlmostEqual(5, peak["frequency"], delta=0.1)
        self.assertAlmostEqual(1, peak["amplitude"], delta=0.05)
        shown = "getComputedStyle(document.querySelector('.spectrum')).display"
        self.assertEqual("block", self.browser.evaluate(shown))
        self.browser.evaluate(
            "[...document.querySelectorAll('button')].find(b => b.textContent === 'Spectrum').click()"
        )
        self.assertEqual("none", self.browser.evaluate(shown))
        self.assertNotIn("spectrum", self.browser.evaluate("location.hash + location.search"))

    def test_a_stopped_machine_looks_stopped(self):
        self.begin(view="scope?ch=sine&base=0.1")
        self.browser.wait("window.halcyonScope?.rows > 50")
        self.assertEqual("", self.browser.evaluate("halcyonScope.notice"))
        self.good("shell", "stop")
        self.browser.wait("halcyonScope.notice === 'stopped: functions do not run'")
        self.browser.wait("/is stopped/.test(document.getElementById('banner').textContent)")
        self.browser.wait("halcyonScope.stops.length === 1 && halcyonScope.stops[0].to === null")
        self.good("shell", "start")
        self.browser.wait("document.getElementById('banner').hidden && halcyonScope.notice === ''")
        begin, end = self.browser.wait(
            "halcyonScope.stops[0].to && [halcyonScope.stops[0].from, halcyonScope.stops[0].to]"
        )
        self.assertLess(begin, end)
        self.machine.send_signal(19)
        try:
            self.browser.wait("/^no samples for|not responding/.test(halcyonScope.notice)")
        finally:
            self.machine.send_signal(18)
        self.browser.wait("halcyonScope.notice === ''")

    def test_a_stopped_machine_looks_stopped_in_other_views(self):
        self.begin(view="watch?names=sine")
        # The right end of the picture of the last 15 s: shaded from top to bottom?
        corner = "(() => { const c = document.querySelector('canvas.spark'); return c.getContext('2d').getImageData(c.width - 2, 0, 1, 1).data[3]; })()"
        self.browser.wait("document.querySelector('[data-value=sine]').textContent !== '–'")
        self.assertEqual(0, self.browser.evaluate(corner))
        self.good("shell", "stop")
        self.browser.wait(f"document.body.classList.contains('paused') && {corner} > 0")
        self.browser.evaluate("location.hash = '#/overview'")
        self.browser.wait(
            "/stopped: functions do not run/.test(document.querySelector('[data-thread=servo]').textContent)"
        )
        self.good("shell", "start")
        self.browser.wait(
            "/running/.test(document.querySelector('[data-thread=servo]').textContent) && !document.body.classList.contains('paused')"
        )
        self.browser.evaluate("location.hash = '#/watch?names=sine'")
        self.browser.wait(f"document.querySelector('canvas.spark') && {corner} === 0")

    def test_faults_are_marked_in_every_view_and_in_the_trace(self):
        self.write(
            "bus.canopen", "[bus]\nlink = sim:faulty\nbitrate = 1M\n[node 3 io]\ndevice = cia401\n"
        )
        self.begin(view="scope?ch=sine&base=0.5")
        mark = "document.getElementById('faults')"
        self.browser.wait("window.halcyonScope?.rows > 50")
        self.good("shell", "loadrt", "canopen", "config=bus.canopen")
        self.good("shell", "addf", "canopen.0.transmit", "servo")
        self.browser.wait(f"!{mark}.hidden && /^[1-9]\\d* faults?$/.test({mark}.textContent)")
        self.browser.wait("halcyonScope.faults.length > 0")
        at, text = self.browser.evaluate("[halcyonScope.faults[0].at, halcyonScope.faults[0].text]")
        self.assertIn("receive", text)
        self.assertGreater(at, 0)
        for view in ("watch", "graph", "log", "overview"):
            self.browser.evaluate(f"location.hash = '#/{view}'")
            self.assertFalse(self.browser.evaluate(f"{mark}.hidden"))

    def test_a_fault_triggers_the_scope(self):
        self.write(
            "bus.canopen", "[bus]\nlink = sim:faulty\nbitrate = 1M\n[node 3 io]\ndevice = cia401\n"
        )
        self.begin(view="scope?ch=sine&base=0.02&mode=single&trigger=fault:canopen.0")
        self.browser.wait("window.halcyonScope?.rows > 300")
        self.assertTrue(
            self.browser.evaluate(
                "document.querySelector('[aria-label=Edge]').hidden && document.querySelector('[aria-label^=Instance]').value === 'canopen.0'"
            )
        )
        self.good("shell", "loadrt", "canopen", "config=bus.canopen")
        self.good("shell", "addf", "canopen.0.transmit", "servo")
        self.browser.wait(
            "/single record/.test(document.getElementById('scope-status').textContent)"
        )
        at, begin, end = self.browser.wait(
            "halcyonScope.faults.length > 0 && [halcyonScope.faults[0].at, ...halcyonScope.range]"
        )
        self.assertAlmostEqual(begin + 0.2 * (end - begin), at, places=6)

    def test_the_scope_draws_what_moves_by_itself_twenty_times_a_second(self):
        self.begin(view="scope?ch=sine:0.5:0&base=0.01&mode=roll")
        self.browser.wait("window.halcyonScope?.rows > 0 && halcyonScope.frames > 0")
        pictures = """(async () => {
            const before = [halcyonScope.frames, performance.now()];
            await new Promise(done => setTimeout(done, 2500));
            return (halcyonScope.frames - before[0]) * 1000 / (performance.now() - before[1]);
        })()"""
        rate = self.browser.evaluate(pictures)
        self.assertGreater(rate, 1)
        self.assertLess(rate, 1000 / (50 - 17) + 2)  # of requestAnimationFrame(): 60

    def test_the_scope_scrolls_back_and_returns(self):
        self.begin(view="scope?ch=sine:0.5:0&base=0.01")
        self.browser.wait("window.halcyonScope?.rows > 1500")
        canvas = "document.querySelector('.pictures canvas')"
        press = canvas + ".dispatchEvent(new KeyboardEvent('keydown', {{key: '{}'}}))"
        self.browser.evaluate(press.format("PageUp"))
        self.browser.wait("/back of/.test(document.querySelector('.history').textContent)")
        more = "halcyonScope.rows > {} + 200 && halcyonScope.range"
        rows = self.browser.evaluate("halcyonScope.rows")
        begin, end = self.browser.wait(more.format(rows))
        rows = self.browser.evaluate("halcyonScope.rows")
        self.browser.wait(more.format(rows))
        self.assertEqual([begin, end], self.browser.evaluate("halcyonScope.range"))
        self.browser.evaluate(press.format("Home"))
        # all of the picture has samples
        self.browser.wait(
            "Math.abs(halcyonScope.range[0] - halcyonScope.store.oldest) < 1e-6 && (s => Math.abs(s.min - s.value) < 1e-6)(document.querySelector('[aria-label^=\"Scroll\"]'))"
        )
        self.browser.evaluate(press.format(" "))
        self.browser.wait("halcyonScope.store.newest - halcyonScope.range[1] < 0.5")

    def test_the_xy_view_draws_a_channel_over_another(self):
        self.begin(
            netlist=WAVE + "net cosine wave.cosine\n",
            view="scope?ch=sine:0.5:0,cosine:0.5:0&base=0.05&x=cosine",
        )
        self.browser.wait("window.halcyonScope?.rows > 600")
        pane = "document.querySelector('.xy')"
        self.browser.wait(f"!{pane}.hidden && halcyonScope.xy.length > 400")
        radii = self.browser.evaluate("halcyonScope.xy.map(([x, y]) => Math.hypot(x, y))")
        self.assertTrue(all(abs(radius - 1) < 1e-6 for radius in radii))
        self.browser.evaluate(
            "(() => { const s = document.querySelector('[aria-label^=\"X axis\"]'); s.value = ''; s.dispatchEvent(new Event('change')); })()"
        )
        self.assertTrue(self.browser.evaluate(f"{pane}.hidden"))
        self.assertNotIn("x=cosine", self.browser.evaluate("location.hash"))

    def test_the_scope_saves_a_recording_that_hal_plays(self):
        self.begin(view="scope?ch=sine:0.5:0,total:2:0&base=0.01")
        self.browser.wait("window.halcyonScope?.rows > 600")
        self.good("shell", "setp", "adder.in0", "2")
        self.browser.wait("halcyon.log.some(one => /adder.in0/.test(one.text))")
        rows = self.browser.evaluate("halcyonScope.rows")
        self.browser.wait(f"halcyonScope.rows > {rows} + 100")  # samples after the edit
        self.browser.evaluate("""window.saved = null;
            URL.createObjectURL = blob => { blob.arrayBuffer().then(b => { saved = [...new Uint8Array(b)]; }); return 'blob:none'; };
            HTMLAnchorElement.prototype.click = () => {};
            const press = label => [...document.querySelectorAll('button')].find(b => b.textContent === label).click();
            press('Stop'); press('MCAP');""")
        file = self.folder / "scope.mcap"
        file.write_bytes(bytes(self.browser.wait("saved")))
        netlist = self.write(
            "play.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt sum2 names=adder,copy\n"
            "addf adder servo\naddf copy servo\nsetp adder.in0 2\nsetp adder.in1 3\nnet total adder.out\n"
            "net sine copy.in0\n",
        )
        out = self.good("replay", str(file), netlist, "--tolerance", "0")
        self.assertRegex(out, r"total +equal in \d{3,} rows")
        self.good("plot", str(file), "sine", "-o", "scope.svg")
        self.assertIn("setp adder.in0 2", (self.folder / "scope.svg").read_text())
        try:
            from mcap.reader import make_reader
            from mcap_ros2.decoder import DecoderFactory
        except ImportError:
            return
        with file.open("rb") as opened:
            reader = make_reader(opened, decoder_factories=[DecoderFactory()])
            rows = [m for _, c, _, m in reader.iter_decoded_messages(topics=["/hal/servo"])]
            self.assertEqual({5.0}, {row.total for row in rows})
            self.assertGreater(len(rows), 600)

    def test_the_scope_shows_a_recording(self):
        self.machine = self.start("run", self.write("m.hal", WAVE))
        self.good("record", "crash.mcap", "sine", "total", "--for", "1s")
        self.process, self.port, self.token = start_panel(self, "--recording", "crash.mcap")
        self.browser = self.kind(self)
        self.open("scope?ch=sine:0.5:0&recording=crash.mcap", token=False)
        self.browser.wait("window.halcyonScope?.rows > 900")
        self.assertEqual(0.1, self.browser.evaluate("halcyonScope.base"))
        self.assertEqual([0, 0], self.browser.evaluate("[halcyonScope.lost, halcyonScope.gaps]"))
        rows = self.browser.evaluate("halcyonScope.rows")
        add = "(name => { const i = document.querySelector('[aria-label=\"Add a channel\"]'); i.value = name; i.dispatchEvent(new Event('change')); })"
        self.browser.evaluate(f"{add}('wave.cosine')")
        problem = "document.getElementById('scope-problem').textContent"
        self.browser.wait(f"{problem} === \"unknown name 'wave.cosine'\"")
        self.browser.evaluate(f"{add}('total')")
        self.browser.wait(
            "halcyonScope.store.place.has('total') && document.querySelector('[data-channel=total]').children[5].textContent === '5'"
        )
        self.assertEqual(rows, self.browser.evaluate("halcyonScope.rows"))
        self.assertTrue(self.browser.evaluate("document.querySelector('button.main').disabled"))
        self.end(self.machine)
        self.browser.wait("document.body.classList.contains('stale')")
        self.assertEqual(
            ["", "none"],
            self.browser.evaluate(
                "[halcyonScope.notice, getComputedStyle(document.querySelector('main')).filter]"
            ),
        )

    def show_recording(self, text, view, *words, token=False):
        """The scope with run.csv, without a machine."""
        self.write("run.csv", text)
        words = ("--recording", "run.csv", *words)
        self.process, self.port, self.token = start_panel(self, *words)
        self.browser = self.kind(self)
        self.browser.open(f"http://localhost:{self.port}/#/{view}")

    def test_a_recording_keeps_its_picture_when_a_channel_is_added_and_the_server_restarts(self):
        rows = "".join(f"{row / 1000},{row % 7},{row % 5}\n" for row in range(1000))
        self.show_recording("time_s,x,y\n" + rows, "scope?ch=x:1:0&recording=run.csv")
        self.browser.wait("window.halcyonScope?.rows === 1000 && halcyonScope.range[1] > 0.9")
        self.assertEqual(0.1, self.browser.evaluate("halcyonScope.base"))
        press = "document.querySelector('canvas').dispatchEvent(new KeyboardEvent('keydown', {key: '%s'}))"
        for key in ("ArrowLeft", "ArrowLeft", "ArrowLeft", "PageUp"):
            self.browser.evaluate(press % key)
        there = "JSON.stringify(halcyonScope.range.map(s => s.toFixed(6)))"
        self.browser.wait(f'{there} === \'["0.849000","0.949000"]\'')
        self.browser.evaluate(
            "(i => { i.value = 'y'; i.dispatchEvent(new Event('change')); })(document.querySelector('[aria-label=\"Add a channel\"]'))"
        )
        self.browser.wait("halcyonScope.store.place.has('y') && halcyonScope.rows === 1000")
        self.browser.wait("halcyonScope.frames > 0")
        self.assertEqual('["0.849000","0.949000"]', self.browser.evaluate(there))
        self.browser.evaluate("window.before = halcyonScope.store.groups[0]")
        self.process.kill()
        self.process.wait()
        self.process, _, _ = start_panel(self, "--port", self.port, "--recording", "run.csv")
        self.browser.wait(
            "halcyonScope.store.groups[0] && halcyonScope.store.groups[0] !== before && halcyonScope.rows === 1000"
        )
        self.assertEqual('["0.849000","0.949000"]', self.browser.evaluate(there))
        self.browser.errors.clear()  # of connections while the server was down

    def test_a_recording_that_hal_panel_does_not_have_is_reported(self):
        self.show_recording("time_s,x\n0,1\n1,2\n", "scope?ch=x:1:0&recording=gone.mcap")
        problem = "document.getElementById('scope-problem')?.textContent"
        self.browser.wait(
            f"{problem} === \"hal panel has no recording 'gone.mcap'; start it with --recording FILE\""
        )
        self.assertNotIn("recording", self.browser.evaluate("location.hash"))
        self.assertEqual(
            "",
            self.browser.evaluate("document.querySelector('[aria-label=\"Source\"]').value"),
        )
        self.browser.evaluate("location.hash = '#/scope?ch=x:1:0&recording=other.csv'")
        self.browser.wait(
            f"{problem} === \"hal panel has no recording 'other.csv'; start it with --recording FILE\""
        )
        self.browser.evaluate("location.hash = '#/scope?ch=x:1:0&recording=run.csv'")
        self.browser.wait(f"window.halcyonScope?.rows === 2 && {problem} === ''")

    def test_a_table_of_minima_and_maxima_alone_is_not_saved(self):
        rows = "".join(f"{row / 1000},{row % 7}\n" for row in range(300_000))
        self.show_recording("time_s,x\n" + rows, "scope?ch=x:1:0&base=1&recording=run.csv")
        self.browser.wait("window.halcyonScope?.rows === 300000 && halcyonScope.frames > 0")
        self.browser.evaluate("""window.saved = 0;
            URL.createObjectURL = () => { saved++; return 'blob:none'; };
            HTMLAnchorElement.prototype.click = () => {};
            window.press = label => [...document.querySelectorAll('button')].find(b => b.textContent === label).click();
            window.type = key => document.querySelector('.pictures canvas').dispatchEvent(new KeyboardEvent('keydown', {key}));
            type('Home');
            press('CSV');""")
        result = "[saved, document.getElementById('scope-problem').textContent]"
        self.assertEqual(
            [
                0,
                "no file is saved: only minima and maxima of this time are kept; "
                "scroll to the last 262.1 s, whose samples are kept",
            ],
            self.browser.evaluate(result),
        )
        self.browser.evaluate("type('End'); press('CSV')")
        self.assertEqual([1, ""], self.browser.evaluate(result))
        self.browser.evaluate("press('MCAP')")
        self.assertEqual(
            [
                2,
                "the file has the last 262.1 s: only minima and maxima of earlier samples are kept",
            ],
            self.browser.evaluate(result),
        )

    def test_the_scope_reports_what_a_cut_recording_lacks(self):
        self.show_recording("time_s,x\n0,1\n1,2\n2", "scope?ch=x:1:0&recording=run.csv")
        self.browser.wait(
            "document.getElementById('scope-problem')?.textContent === \"'run.csv', line 4: the line is cut off; rows after 1 s are missing, of x\""
        )

    def test_a_printed_address_with_the_token_opens_the_recording(self):
        text = "time_s,x\n0,1\n1,2\n"
        self.show_recording(text, "overview", "--write")
        self.browser.open("about:blank")
        self.browser.open(
            f"http://localhost:{self.port}/#/scope?recording=run.csv&ch=x&t={self.token}"
        )
        self.browser.wait("window.halcyonScope?.rows === 2 && window.halcyon?.token")
        self.assertNotIn(self.token, self.browser.evaluate("location.href"))

    def test_a_file_that_is_saved_of_a_recording_does_not_name_the_running_machine(self):
        self.show_recording("time_s,x\n0,1\n1,2\n", "scope?ch=x:1:0&recording=run.csv")
        self.browser.wait("window.halcyonScope?.rows === 2")
        self.browser.evaluate(
            """halcyon.instance = 'other'; halcyon.version = '9.9.9'; window.saved = null;
            URL.createObjectURL = blob => { blob.text().then(text => { saved = text; }); return 'blob:none'; };
            HTMLAnchorElement.prototype.click = () => {};
            [...document.querySelectorAll('button')].find(b => b.textContent === 'MCAP').click();"""
        )
        text = self.browser.wait("saved")
        self.assertIn("instance", text)
        self.assertNotIn("other", text)
        self.assertNotIn("9.9.9", text)

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
            store.samples({parts: [{group: 0, rows, lost: 3}], until_ns: 1000000000000 + rows * 100000}, view.buffer, {columns: [{type: 'float'}, {type: 's32'}]});
            const edges = new Trigger('x', 'rising', 0).scan(store), seen = measure(store, 'x', 0, 1);
            return {rows: store.rows, lost: store.lost, gaps: store.gaps, least: measure(store, 'n', 0, 1).min, edges: edges.map(t => Math.round(t * 1e6)), rms: seen.rms, frequency: seen.frequency};
        })()""")
        self.assertEqual(
            {
                "rows": 1000,
                "lost": 3,
                "gaps": 1,
                "least": -999,
                "edges": [20000, 40000, 60000, 80000],
            },
            {key: result[key] for key in ("rows", "lost", "gaps", "least", "edges")},
        )
        self.assertAlmostEqual(0.5**0.5, result["rms"], places=4)
        self.assertAlmostEqual(50, result["frequency"], places=4)

    def test_names_of_the_machine_are_text(self):
        self.begin(netlist=SERVO + "newsig <img/src=x> float\n", view="watch?filter=img")
        self.browser.wait("document.querySelector('.tree').textContent.includes('<img/src=x>')")
        self.assertEqual(0, self.browser.evaluate("document.querySelectorAll('main img').length"))

    def test_networks_show_stations_and_emergencies_in_words(self):
        self.write(
            "bus.canopen",
            "[bus]\nlink = sim:panel\nbitrate = 1M\nsync = cycle\n[node 3 io]\ndevice = cia401\nheartbeat = 20ms\n[node 80 force]\ndevice = jr3\nheartbeat = 20ms\n",
        )
        self.begin(
            netlist="""loadrt threads name1=servo period1=1000000
loadrt canopen config=bus.canopen
loadrt canopen_io link=sim:panel id=3 inputs=8 outputs=8
loadrt canopen_jr3 link=sim:panel id=0x50
addf canopen.0.receive servo
addf canopen.0.transmit servo
addf canopen-io.0.update servo
addf canopen-jr3.0.update servo
start
""",
            view="networks",
            token=False,
        )
        cell = "[...document.querySelectorAll('[data-node={}] td')][[...document.querySelectorAll('#bus-canopen\\\\.0 thead th')].findIndex(th => th.dataset.what === '{}')]?.textContent"
        self.browser.wait(cell.format("io", "operational") + " === 'yes'")
        self.browser.wait("document.querySelectorAll('.station.operational').length === 2")
        self.assertEqual("–", self.browser.evaluate(cell.format("force", "emcy")))
        self.good("shell", "setp", "canopen-jr3.0.fz", "-220")
        self.browser.wait(cell.format("force", "emcy") + " === 'FF01h device specific'")
        self.browser.wait("document.querySelectorAll('.station.faulty').length === 1")
        self.browser.size(1080, 800)  # the emergency wraps, and no column is cut off
        self.browser.wait(
            "(s => s.scrollWidth <= s.clientWidth)(document.querySelector('.scroll'))"
        )
        self.good("shell", "setp", "canopen-io.0.power", "FALSE")
        self.browser.wait(
            cell.format("io", "online")
            + " === 'no' && document.querySelectorAll('.station:not(.online):not(.master)').length === 1"
        )

    def test_the_log_has_writes_edits_and_faults_and_filters_them(self):
        self.begin("--write", view="watch?names=adder.in0")
        self.browser.wait("!document.querySelector('button.set').disabled")
        self.browser.evaluate(
            "document.querySelector('input.set').value = '40'; document.querySelector('button.set').click()"
        )
        self.browser.wait("halcyon.log.some(entry => /adder\\.in0: 2 -> 40/.test(entry.text))")
        self.browser.evaluate("location.hash = '#/log'")
        self.browser.wait(
            "/write\\s+client \\d+: adder\\.in0: 2 -> 40/.test(document.getElementById('log').innerText)"
        )
        self.good("shell", "loadrt", "sum2", "names=later")
        self.browser.wait(
            "/loadrt sum2 names=later/.test(document.getElementById('log').innerText)"
        )
        self.browser.evaluate(
            "[...document.querySelectorAll('button')].find(b => b.textContent === 'write').click()"
        )
        self.browser.wait("!/write\\s+client/.test(document.getElementById('log').innerText)")
        self.assertIn("hide=write", self.browser.evaluate("location.hash"))
        self.browser.evaluate(
            "const f = document.querySelector('input[type=search]'); f.value = 'later'; f.dispatchEvent(new Event('input'))"
        )
        self.browser.wait("document.querySelectorAll('#log li').length === 1")


if __name__ == "__main__":
    main()
