# SPDX-License-Identifier: MIT
# packages: canopen
"""The bus of tests/demo_bus, the example of docs/internals/a-bus.md."""

import re
import unittest
from pathlib import Path

from harness import Case

ROOT = Path(__file__).resolve().parents[2]
BUS = """loadrt threads name1=bus period1=1000000
loadrt demo config=pumps.demo link=sim:pumps
loadrt can_send link=sim:pumps names=pump id=0x185 fields=counts:s32
loadrt can_receive link=sim:pumps names=seen id=0x205 fields=counts:s32
addf demo.0.receive bus
addf pump.update bus
addf seen.update bus
addf demo.0.transmit bus
setp pump.period 0.01
setp pump.counts 250
setp demo.0.pump.set-point 1.5
start
advance 50ms
"""


class DemoBus(Case):
    def netlist(self, more, config="[bus]\nsilence = 20ms\n[device 5 pump]\nscale = 0.01\n"):
        self.write("pumps.demo", config)
        return self.write("a.hal", BUS + more)

    def test_values_cross_the_bus(self):
        path = self.netlist("getp demo.0.pump.online\ngetp demo.0.pump.value\ngetp seen.counts\n")
        self.assertEqual("TRUE\n2.5\n150\n", self.run_program("sim", path).stdout)

    def test_a_silent_device_is_a_fault_that_lasts(self):
        more = "setp pump.period 0\nadvance 50ms\ngetp demo.0.pump.online\nshow fault\n"
        done = self.run_program("sim", self.netlist(more))
        self.assertIn("demo.0: device 5 (pump) is online\n", done.stderr)
        offline = "device 5 (pump) is offline: no value for "
        self.assertRegex(
            done.stderr, "demo.0: " + re.escape(offline) + r"0\.02\d* s; check its power and wiring"
        )
        self.assertIn("FALSE\n", done.stdout)
        self.assertIn(offline, done.stdout)
        again = more + "setp pump.period 0.01\nadvance 50ms\nshow fault\n"
        shown = self.run_program("sim", self.netlist(again)).stdout.splitlines()
        self.assertIn("(lasts)", shown[1])
        self.assertNotIn("(lasts)", shown[-2])

    def test_an_input_that_is_no_number_keeps_the_last_set_point(self):
        more = "setp demo.0.pump.set-point nan\nadvance 5ms\ngetp seen.counts\nshow fault\n"
        printed = self.run_program("sim", self.netlist(more)).stdout
        self.assertIn("150\n", printed)
        self.assertIn("an input pin is NaN or infinite", printed)

    def test_a_stopped_thread_begins_anew(self):
        more = "stop\nadvance 50ms\nstart\nadvance 50ms\ngetp demo.0.pump.online\n"
        self.assertEqual("TRUE\n", self.run_program("sim", self.netlist(more)).stdout)

    def test_errors_of_the_file_are_shown_at_their_place(self):
        config = "[bus]\nsilence = 0ms\n[device 500 pump]\n[device 6 fan]\nscale = 0\nspeed = 3\n"
        errors = self.bad("check", self.netlist("", config))
        for line in (
            "pumps.demo:2:11: error: invalid silence '0ms'",
            "pumps.demo:3:1: error: invalid device section",
            "pumps.demo:5:9: error: invalid scale '0'",
            "pumps.demo:6:1: error: unknown key 'speed' in [device 6]",
        ):
            self.assertIn(line, errors)


class Page(unittest.TestCase):
    def test_shows_the_files_as_they_are(self):
        page = (ROOT / "docs/internals/a-bus.md").read_text()
        shown = re.findall(r"`(tests/demo_bus/[\w/.]+)`:\n+( *)```cpp\n(.*?)\n *```", page, re.DOTALL)
        self.assertLess(4, len(shown))
        for file, indent, code in shown:
            text = (ROOT / file).read_text()
            lines = [line.removeprefix(indent) for line in code.splitlines()]
            self.assertIn("\n".join(lines), text, file)


if __name__ == "__main__":
    unittest.main()
