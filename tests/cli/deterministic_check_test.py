# SPDX-License-Identifier: MIT
"""hal check --deterministic: components that compute other values from the same inputs are named."""

import re
import unittest
from pathlib import Path

from harness import ROOT, SANITIZED, Case, needs_package

KINDS = ["address", "clock", "time", "memory", "thread", "process", "hash", "random", "rand"]
KINDS += ["socket", "flags", "image"]
VIOLATIONS = {
    "flags": r"changed the floating-point modes \(rounding\)",
    "socket": "reads a socket or a file that no journal has",
}
SEEDS = (
    "loadrt threads name1=servo period1=1000000\n"
    f"loadrt seeds names=clean,source,{','.join(KINDS)}\n"
    "loadrt sum2 names=after,later\n"
    + "".join(f"setp {name}.kind {number + 1}\n" for number, name in enumerate(KINDS))
    + "net a clock.out => after.in0\nnet b after.out => later.in0\nnet c later.out => clean.in\n"
    + "net d source.out => image.in\n"
    + "".join(f"addf {name} servo\n" for name in ["source", *KINDS, "after", "later", "clean"])
)
OUTSIDE = {
    name: 100 + number
    for number, name in enumerate(
        "read readv pread preadv recv recvfrom recvmsg recvmmsg ioctl fread fgets fgetc getc "
        "getline getdelim fscanf read-chk pread-chk recv-chk recvfrom-chk fread-chk fgets-chk".split()
    )
}
CLEAN = """loadrt threads name1=servo period1=1000000
loadrt siggen
loadrt noise
loadrt lowpass
addf siggen.0.update servo
addf noise.0 servo
addf lowpass.0 servo
net wave siggen.0.sine => lowpass.0.in
getp lowpass.0.out
"""


class DeterministicCheck(Case):
    def compile_seeds(self):
        done = self.run_program("compile", Path(__file__).parent / "sources/seeds.cpp")
        self.assertEqual(0, done.returncode, done.stderr)

    @unittest.skipIf(
        SANITIZED, "a sanitizer fills memory itself, and has the functions of the clock"
    )
    def test_components_that_depend_on_the_process_are_named(self):
        self.compile_seeds()
        netlist = self.write("a.hal", SEEDS)
        done = self.run_program("check", "--deterministic", "--for", "50ms", netlist)
        self.assertEqual(1, done.returncode, done.stderr)
        named = re.findall(
            r"(?m)^'(\w+)' \(seeds\) is not deterministic: function '\1' sets '\1\.out' to \S+ and "
            r"to \S+ in cycle \d+ of thread 'servo', from the same inputs$",
            done.stdout,
        )
        self.assertEqual(sorted(set(KINDS) - set(VIOLATIONS)), sorted(named), done.stdout)
        for name, reason in VIOLATIONS.items():
            line = (
                rf"(?m)^function '{name}' \(seeds\) {reason} at cycle \d+: it is not deterministic$"
            )
            self.assertRegex(done.stdout, line)
        self.assertIn(
            "\ntwo simulations differ: 12 instances are not deterministic, 3 instances differ "
            "because of them\n",
            done.stdout,
        )

    @unittest.skipIf(SANITIZED, "a sanitizer has these functions itself")
    def test_functions_that_read_outside_are_named_whatever_they_call(self):
        self.compile_seeds()
        netlist = self.write(
            "a.hal",
            f"loadrt threads name1=servo period1=1000000\nloadrt seeds names={','.join(OUTSIDE)}\n"
            + "".join(
                f"setp {name}.kind {kind}\naddf {name} servo\n" for name, kind in OUTSIDE.items()
            ),
        )
        done = self.run_program("check", "--deterministic", "--for", "20ms", netlist)
        self.assertEqual(1, done.returncode, done.stderr)
        lines = [
            f"function '{name}' (seeds) reads a socket or a file that no journal has at cycle 0: it "
            "is not deterministic"
            for name in OUTSIDE
        ]
        lines += [
            f"two simulations differ: {len(OUTSIDE)} instances are not deterministic, 0 instances "
            "differ because of them"
        ]
        self.assertEqual(lines, done.stdout.splitlines()[-len(lines) :], done.stdout)

    @unittest.skipIf(SANITIZED, "a sanitizer has the functions of the clock")
    def test_a_violation_by_an_unknown_function_is_a_difference(self):
        self.compile_seeds()
        netlist = self.write(
            "a.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt seeds names=once\n"
            "setp once.kind 13\naddf once servo\n",
        )
        done = self.run_program("check", "--deterministic", "--for", "3s", netlist)
        self.assertEqual(1, done.returncode, done.stdout + done.stderr)
        self.assertRegex(
            done.stdout,
            r"^a function changed the floating-point modes \(rounding\) at cycle 2 000: it is not "
            r"deterministic\ntwo simulations differ: 1 instance is not deterministic, 0 instances "
            r"differ because of them\n$",
        )

    def test_plans_that_cannot_be_exchanged_are_reported(self):
        netlist = self.write("a.hal", CLEAN + "loadrt lowpass names=determinism-check-servo\n")
        done = self.run_program("check", "--deterministic", "--for", "50ms", netlist)
        self.assertEqual((1, ""), (done.returncode, done.stdout))
        self.assertIn("hal sim: the plans could not be exchanged: ", done.stderr)

    def test_a_deterministic_machine_is_equal_in_all_values(self):
        netlist = self.write("a.hal", CLEAN)
        done = self.run_program("check", "--deterministic", "--for", "50ms", netlist)
        self.assertEqual(0, done.returncode, done.stdout + done.stderr)
        self.assertRegex(done.stdout, r"^two simulations are equal in \d{3,} values\n$")

    def test_a_link_to_other_programs_is_not_opened(self):
        text = (
            "loadrt threads name1=servo period1=1000000\n"
            "loadrt can_send link={} names=p id=0x10a fields=a:s32\naddf p.update servo\n"
        )
        netlist = self.write("a.hal", text.format("udp:127.0.0.1:43113"))
        done = self.run_program("check", "--deterministic", "--for", "50ms", netlist)
        self.assertEqual(1, done.returncode, done.stdout)
        self.assertIn("'udp:127.0.0.1:43113' leads to other programs or devices", done.stderr)
        netlist = self.write("a.hal", text.format("sim:inside"))
        done = self.run_program("check", "--deterministic", "--for", "50ms", netlist)
        self.assertEqual(0, done.returncode, done.stderr)

    @needs_package("dds")
    def test_dds_is_not_opened(self):
        netlist = self.write(
            "a.hal",
            "loadrt threads name1=servo period1=1000000\n"
            "loadrt dds_publish topic=check/a fields=a:float domain=230\naddf dds-publish.0 servo\n",
        )
        done = self.run_program("check", "--deterministic", "--for", "50ms", netlist)
        self.assertEqual(1, done.returncode, done.stdout)
        self.assertIn("DDS leads to other programs", done.stderr)

    def test_a_machine_of_thousands_of_values(self):
        netlist = self.write(
            "a.hal",
            "loadrt threads name1=servo period1=100000\nloadrt sum2 count=400\n"
            + "".join(f"addf sum2.{n} servo\n" for n in range(400)),
        )
        done = self.run_program("check", "--deterministic", "--for", "100ms", netlist)
        self.assertEqual(0, done.returncode, done.stderr)

    @needs_package("scocan")
    @needs_package("canopen")
    def test_machines_on_buses_need_their_ini_file(self):
        load = self.write("load.ini", "[LOAD]\nCOUNT = 24\n")
        yair = ROOT / "halfiles" / "yair"
        for ini, netlist in [
            (load, ROOT / "halfiles" / "jitter" / "plain.hal"),
            (load, ROOT / "halfiles" / "jitter" / "scocan.hal"),
            (yair / "yair.ini", yair / "yair.hal"),
        ]:
            words = ["check", "--deterministic", "--for", "100ms", netlist]
            self.assertIn("has no value: no INI file was given", self.run_program(*words).stderr)
            done = self.run_program(*words, "-i", ini)
            self.assertEqual(0, done.returncode, done.stderr)
            self.assertRegex(done.stdout, r"two simulations are equal in \d{5,} values")

    def test_an_error_of_the_netlist_comes_first(self):
        netlist = self.write("a.hal", "loadrt nothing-like-this\n")
        done = self.run_program("check", "--deterministic", netlist)
        self.assertEqual(1, done.returncode)
        self.assertNotIn("two simulations", done.stdout)


if __name__ == "__main__":
    unittest.main()
