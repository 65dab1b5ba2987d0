#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Components that hal compile made of LinuxCNC's, in a running machine: reload, unload, several threads, read-only parameters."""
import unittest
from pathlib import Path

from harness import PLUGINS, Case, wait_until

GAUGE = Path(__file__).parent / "sources/gauge.c"
SCALE = """component scale2 "In times a factor";
pin in float in; pin out float out; pin io s32 cycles;
param rw float gain = 1.0; param r u32 runs "how often it ran"; param r float peak;
function update; function tally;
license "MIT";
;;
FUNCTION(update) { out = in * gain * FACTOR; if (out > peak) peak = out; runs++; }
FUNCTION(tally) { cycles++; }
"""
NETLIST = """newthread servo 1000000
newthread slow 2000000
loadrt NAME
loadrt sum2 names=adder
setp PREFIX.gain 3
net value PREFIX.in
sets value 2
net result PREFIX.out => adder.in0
net cycles PREFIX.cycles
addf PREFIX.update servo
addf adder servo
addf PREFIX.tally COUNTS
start
"""


class Compiled(Case):
    def setUp(self):
        super().setUp()
        self.plugins = self.folder / "plugins"
        self.environment["HALCYON_PLUGIN_PATH"] = f"{self.plugins}:{PLUGINS}"

    def version(self, kind, factor):
        text = GAUGE.read_text() if kind == "c" else SCALE
        file = self.write(
            "gauge.c" if kind == "c" else "scale2.comp",
            text.replace("FACTOR", str(factor))
            if kind != "c"
            else f"#define FACTOR {factor}\n" + text,
        )
        self.good("compile", "--output", self.plugins, file)

    def machine(self, kind, counts="slow"):
        self.version(kind, 10)
        name, prefix = ("gauge", "gauge") if kind == "c" else ("scale2", "scale2.0")
        return (
            self.start(
                "run",
                self.write(
                    "m.hal",
                    NETLIST.replace("NAME", name)
                    .replace("PREFIX", prefix)
                    .replace("COUNTS", counts),
                ),
            ),
            name,
            prefix,
        )

    def life(self, kind):
        machine, name, prefix = self.machine(kind)
        self.comes("adder.out", "60")
        self.comes(f"{prefix}.peak", "60")
        self.version(kind, 100)
        self.say("reload", name)
        self.comes("adder.out", "600")
        self.comes(f"{prefix}.peak", "600")
        self.say("sets", "value", "4")
        self.comes("adder.out", "1200")
        self.say("setp", f"{prefix}.gain", "1")
        self.comes("adder.out", "400")
        runs, cycles = int(self.value(f"{prefix}.runs"), 0), int(self.value(f"{prefix}.cycles"))
        wait_until(
            lambda: int(self.value(f"{prefix}.runs"), 0) > runs + 10
            and int(self.value(f"{prefix}.cycles")) > cycles + 10,
            "both functions run",
        )
        for factor in (2, 3, 4):
            self.version(kind, factor)
            self.say("reload", name)
            self.comes("adder.out", str(4 * factor))
        removed = self.shell("delf", f"{prefix}.update", "servo")
        self.assertEqual(0, removed.returncode)
        self.assertIn("[unthreaded-function]", removed.stderr)
        unloaded = self.shell("unload", name)
        self.assertEqual(0, unloaded.returncode)
        self.assertIn("signal 'result' has no writer any more", unloaded.stderr)
        self.assertEqual("", self.say("list", "pin", prefix).strip())
        self.comes("adder.out", self.say("gets", "result").strip())
        self.say("loadrt", name)
        self.say("net", "value", f"{prefix}.in")
        self.say("sets", "value", "4")
        self.say("net", "result", f"{prefix}.out")
        self.say("setp", f"{prefix}.gain", "1")
        self.say("addf", f"{prefix}.update", "servo")
        self.comes("adder.out", "16")
        self.assertIsNone(machine.poll())

    def test_a_c_component_is_reloaded_and_unloaded_while_it_is_linked(self):
        self.life("c")

    def test_a_comp_component_is_reloaded_and_unloaded_while_it_is_linked(self):
        self.life("comp")

    def read_only(self, kind):
        machine, name, prefix = self.machine(kind, "servo")
        self.comes(f"{prefix}.peak", "60")
        rows = {
            line.split()[-1]: line.split()
            for line in self.say("show", "param", prefix).splitlines()
            if prefix in line
        }
        dirs = {full: "RO" if "RO" in row else "RW" for full, row in rows.items()}
        self.assertEqual(
            {f"{prefix}.gain": "RW", f"{prefix}.runs": "RO", f"{prefix}.peak": "RO"},
            {k: v for k, v in dirs.items() if "tmax" not in k},
            rows,
        )
        done = self.shell("setp", f"{prefix}.peak", "5")
        self.assertEqual(1, done.returncode)
        self.assertIn(
            f"parameter '{prefix}.peak' is read-only: only its component sets it", done.stderr
        )
        self.assertEqual("60", self.value(f"{prefix}.peak"))
        saved = self.say("save", "param")
        self.assertIn(f"setp {prefix}.gain", saved)
        self.assertNotIn("peak", saved)
        self.assertIsNone(machine.poll())

    def test_a_c_component_shows_parameters_that_only_it_sets(self):
        self.read_only("c")

    def test_a_comp_component_shows_parameters_that_only_it_sets(self):
        self.read_only("comp")


if __name__ == "__main__":
    unittest.main()
