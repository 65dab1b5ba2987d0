#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Programs that hal compile makes: of C files with main(), and of .comp files with `option userspace`; in a running machine."""
import signal
import subprocess
import unittest
from pathlib import Path

from harness import PLUGINS, Case, wait_until

FOLLOW = Path(__file__).parent / "sources/follow.c"
RAND = """component drift_by "Counts up";
option userspace; option userinit;
pin in s32 by = 1; pin out s32 out = 5; pin out bit level-#[2];
param rw float gain = 2.0; param r float scaled;
license "MIT";
;;
#include <stdio.h>
#include <unistd.h>
void userinit(int argc, char **argv) {
    printf("count=%d argc=%d %s %s\\n", count, argc, argc > 1 ? argv[1] : "", names[1] ? names[1] : "");
    fflush(stdout);
}
void user_mainloop(void) {
    for (;;) {
        FOR_ALL_INSTS() { out += by; level(1) = out > 100; scaled = out * gain; }
        usleep(1000);
    }
}
"""
NETLIST = """newthread servo 1000000
loadrt sum2 names=adder
addf adder servo
start
setp adder.in0 5
"""


class Programs(Case):
    def setUp(self):
        super().setUp()
        self.environment["HALCYON_PLUGIN_PATH"] = PLUGINS

    def machine(self):
        return self.start("run", self.write("m.hal", NETLIST))

    def test_a_program_in_c_has_pins_in_the_machine(self):
        said = self.good("compile", FOLLOW)
        self.assertIn("follow: a program; installed as ~/.local/share/halcyon/bin/follow\n", said)
        machine = self.machine()
        self.say("loadusr", "-Wn", "follow", "follow")
        self.say("net", "a", "adder.out", "follow.in")
        self.say("net", "b", "follow.out", "adder.in1")
        self.say("setp", "follow.gain", "0.5")
        self.comes("adder.out", "10")
        self.comes("follow.inside", "-3")
        self.say("setp", "follow.inside", "9")
        self.comes("follow.seen", "9")
        self.assertIn(
            "RO",
            next(
                line
                for line in self.say("show", "param", "follow.seen").splitlines()
                if "follow.seen" in line
            ),
        )
        self.assertIn("read-only", self.shell("setp", "follow.seen", "1").stderr)
        self.say("setp", "follow.inside", "100")  # it takes that back
        self.comes("follow.inside", "0")
        self.say("unloadusr", "follow")
        self.say("waitusr", "follow")
        self.assertNotIn("follow", self.say("show", "comp"))
        self.assertIsNone(machine.poll())

    def test_a_program_finds_the_machine_again(self):
        self.good("compile", FOLLOW)
        first = self.machine()
        self.environment["HALCYON_INSTANCE"] = "default"
        program = subprocess.Popen(
            [self.folder / ".local/share/halcyon/bin/follow"], env=self.environment
        )
        self.addCleanup(self.end, program, signal.SIGKILL)
        self.comes("follow.inside", "-3")
        self.say("setp", "follow.gain", "4")
        self.comes("follow.gain", "4")
        self.end(first)
        self.machine()
        self.comes("follow.gain", "4")
        self.say("setp", "follow.in", "2")
        self.comes("follow.out", "8")
        program.send_signal(signal.SIGTERM)
        self.assertEqual(0, program.wait(10))
        self.assertNotIn("follow", self.say("show", "comp"))

    def test_reports_a_missing_machine(self):
        self.good("compile", "--output", ".", FOLLOW)
        done = subprocess.run(
            [self.folder / "follow"],
            env=self.environment,
            stderr=subprocess.PIPE,
            text=True,
            timeout=10,
        )
        self.assertEqual(
            (
                1,
                "follow: no machine 'default' is running (hal run FILE.hal; HALCYON_INSTANCE names another)\n",
            ),
            (done.returncode, done.stderr),
        )

    def test_a_comp_file_of_userspace_is_a_program(self):
        self.write("drift_by.comp", RAND)
        self.assertIn("drift_by: a program", self.good("compile", "drift_by.comp"))
        machine = self.machine()
        self.say("loadusr", "-W", "drift_by", "names=a,b", "more")
        wait_until(lambda: self.value("a.level-1") == "TRUE", "it counts")
        self.say("setp", "b.by", "0")
        self.say("setp", "b.gain", "0")
        self.comes("b.scaled", "0")
        self.say("unloadusr", "drift_by")
        self.say("waitusr", "drift_by")
        self.say("loadusr", "-W", "drift_by", "count=2")
        self.assertEqual(
            "drift-by.0.by drift-by.1.by".split(), self.say("list", "pin", "drift-by.?.by").split()
        )
        self.assertIn("count=0 argc=2 more b\ncount=2 argc=1", self.end(machine)[0])

    def test_what_a_program_cannot_have(self):
        self.write(
            "wrong.comp",
            'component wrong;\noption userspace;\nfunction _;\npin out bit out;\nlicense "MIT";\n;;\nout = 1;\n',
        )
        said = self.bad("compile", "wrong.comp")
        self.assertIn("a program cannot have functions for threads", said)
        self.assertIn("the C code has no user_mainloop for this option", said)

    def test_a_comp_file_with_its_own_main(self):
        self.write(
            "pair.comp",
            'component pair "Two of one file";\npin in float in; pin out float out = 1;\nparam rw float gain = 3;\noption rtapi_app no;\nfunction _;\nlicense "MIT";\n;;\n'
            'static int how_many = 2;\nRTAPI_MP_INT(how_many, "instances");\n'
            'int rtapi_app_main(void) {\n    char name[20];\n    int i;\n    comp_id = hal_init("pair");\n    for (i = 0; i < how_many; i++) {\n'
            '        snprintf(name, sizeof name, "pair-%c", 97 + i);\n        if (export(name, i) < 0) return -1;\n    }\n    return hal_ready(comp_id);\n}\n'
            "void rtapi_app_exit(void) { hal_exit(comp_id); }\nFUNCTION(_) { out = in * gain; }\n",
        )
        self.good("compile", "pair.comp")
        self.write(
            "test.hal",
            "loadrt pair how_many=3\nloadrt threads name1=t period1=1000000\naddf pair-c t\nsetp pair-c.in 4\nstart\nadvance 2 cycles\n"
            "getp pair-c.out\ngetp pair-b.out\n",
        )
        del self.environment["HALCYON_PLUGIN_PATH"]
        self.assertEqual(["12", "1"], self.good("sim", "test.hal").split())


if __name__ == "__main__":
    unittest.main()
