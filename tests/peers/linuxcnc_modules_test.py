#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: linuxcnc
"""linuxcnc_modules_test.py HAL [--figures]: LinuxCNC's compiled modules as the Debian package linuxcnc-uspace installs them, unmodified. The
steps are those of the ladder in docs/linuxcnc-test-runs.md. --figures prints what each module does. LINUXCNC_HOME names another LinuxCNC, such as a
source tree of 2.10 that was built in place. 77: the package is not installed."""
import os
import re
import signal
import subprocess
import sys
import unittest
from ctypes import CDLL
from pathlib import Path

HERE = Path(__file__).resolve().parent
os.environ["HAL_BIN"] = sys.argv[1]
sys.path.insert(0, str(HERE.parent / "cli"))
from harness import HAL, SANITIZED, Case, wait_until  # noqa: E402

HOME = Path(os.environ.get("LINUXCNC_HOME", "/usr"))
FOLDER = HOME / "rtlib" if (HOME / "rtlib").is_dir() else HOME / "lib/linuxcnc/modules"
FIGURES = "--figures" in sys.argv
NEWER = (
    b"hal_pin_new_bool" in (FOLDER / "hal_lib.so").read_bytes()
    if (FOLDER / "hal_lib.so").exists()
    else False
)  # 2.10
MODULES = sorted(path.stem for path in FOLDER.glob("*.so") if path.stem != "hal_lib")
BEFORE = {"motmod": ["tpmod", "homemod", "trivkins"]}
for one in (
    "hm2_7i43",
    "hm2_7i90",
    "hm2_eth",
    "hm2_pci",
    "hm2_rpspi",
    "hm2_spi",
    "hm2_test",
    "mesa_7i65",
    "mesa_uart",
    "mesa_pktgyro_test",
    "setsserial",
    "hm2_modbus",
    "hm2_spix",
):
    BEFORE[one] = ["hostmot2"]
# What a module needs beyond its name: a parameter without which it does nothing.
WITH = {
    "debounce": "cfg=2",
    "lcd": "fmt_strings=%d",
    "message": 'names=m messages="hello"',
    "mux_generic": "config=bb2",
    "pwmgen": "output_type=0",
    "sampler": "cfg=f depth=10",
    "streamer": "cfg=f depth=10",
    "stepgen": "step_type=0",
    "setsserial": 'cmd="nothing"',
    "watchdog": "num_inputs=1",
    "weighted_sum": "wsum_sizes=2",
    "gantry": "personality=2",
    "hm2_test": "test_pattern=12",
    "demux_generic": "config=bb2",
    "enum": 'enums="E;one;two"',
    "hm2_modbus": "ports=none",
    "pushmsg": 'msgs="e|pin|hello"',
    "joint_axis_mapper": "coord=XYZA",
    "histobinstream": "names=h keys=4711",
    "latencybinstream": "names=l keys=4712",
    "bitslice": "personality=8",
    "lincurve": "personality=4",
    "logic": "personality=0x104",
}
# Modules that do not run without their hardware or root, with a piece of the reason that the error must give; docs/linuxcnc-test-runs.md.
PORTS = "I/O ports"  # their access needs a capability, or is not possible with this kernel
DECLINE = {
    "hal_bb_gpio": "cannot open /dev/mem",
    "hal_gm": "no such card in /sys/bus/pci/devices",
    "hal_parport": PORTS,
    "hal_pi_gpio": "unrecognized Raspberry revision",
    "hal_ppmc": PORTS,
    "hal_speaker": "ioperm() failed",
    "hm2_7i43": PORTS,
    "hm2_7i90": PORTS,
    "hm2_pci": "no such card in /sys/bus/pci/devices",
    "hm2_rpspi": "Cannot stat '/proc/device-tree/model'",
    "hm2_spi": "No such file or directory (-2)",
    "mesa_pktgyro_test": "can not be loaded using the 'count' parameter",
    "setsserial": "Unable to find sserial remote",
    "mesa_uart": "can not be loaded using the 'count' parameter",
}
# What hostmot2 prints about hm2_test's patterns 0 to 14..
PATTERNS = (
    "invalid cookie",
    "invalid config name",
    "invalid IDROM type 0",
    "invalid IDROM type 4660",
    "invalid IDROM PortWidth 0",
    "invalid IDROM PortWidth 29",
    "IDROM IOPorts is 0",
    "IDROM IOWidth is 99",
    "IDROM IOPorts is 2",
    "IDROM ClockLow is 12345",
    "IDROM ClockHigh is 0",
    "pin 0 primary tag is 0",
    "hm2_set_pin_source: invalid pin number 0",
    "invalid IDROM PortWidth 24, this board has",
    "IDROM IOPorts is 0",
)
DECLINE_NEWER = {
    "hm2_modbus": "Missing mbccb file path",
    "hm2_spix": "cannot open /proc/device-tree/compatible",
    "scope_rt": "hal_reference_map, which is a function of LinuxCNC 2.10 that",
}
CRASH = (
    {} if NEWER else {"boss_plc": "rtapi_app_main crashed (segmentation fault)"}
)  # in LinuxCNC too
MOTION = """loadrt trivkins
loadrt tpmod
loadrt homemod
loadrt motmod servo_period_nsec=1000000 base_period_nsec=100000 num_joints=3
"""


class Ladder(Case):
    def setUp(self):
        super().setUp()
        self.environment["HAL_RTMOD_DIR"] = str(FOLDER)

    def sim(self, text, *words):
        return self.run_program("sim", "--quiet", *words, self.write("m.hal", text))

    def good_sim(self, text):
        done = self.sim(text)
        self.assertEqual(0, done.returncode, done.stdout + done.stderr)
        return done.stdout

    def test_2_and2_in_a_thread_of_threads(self):
        out = self.good_sim(
            """loadrt --linuxcnc threads name1=t period1=1000000
loadrt --linuxcnc and2 count=1
addf and2.0 t
net a and2.0.in0
net b and2.0.in1
sets a TRUE
sets b TRUE
start
advance 2 cycles
getp and2.0.out
show thread
"""
        )
        self.assertTrue(out.startswith("TRUE\n"), out)
        self.assertRegex(out, r"1000000 .*t\b")

    def one(self, name):
        """What happens to a module: ("runs", cycles), ("declines", reason) or ("crashes", reason)."""
        loads = "".join(f"loadrt --linuxcnc {other}\n" for other in BEFORE.get(name, ()))
        thread = (
            "loadrt --native threads name1=t period1=1000000\n"
            if name != "threads"
            else "newthread t 1000000\n"
        )
        text = f"{thread}{loads}loadrt --linuxcnc {name} {WITH.get(name, '')}\n"
        done = self.sim(text + "list funct\n")
        if done.returncode < 0:
            return "crashes", done.stderr.strip().splitlines()[-1]
        if done.returncode:
            return "crashes" if "crashed" in done.stderr else "declines", re.sub(
                r"^\S*: error: ",
                "",
                next(line for line in done.stderr.splitlines() if "error:" in line),
            )
        functions = done.stdout.split("\n")[
            0
        ].split()  # what follows, modules print when they are unloaded
        adds = "".join(f"addf {function} t\n" for function in functions)
        done = self.sim(
            text + adds + "start\nadvance 1000 cycles\ngetp t.threadbeat\nshow fault\nunload all\n"
        )
        if done.returncode < 0:
            return "crashes", next(
                (line for line in done.stderr.splitlines() if "crashed" in line),
                f"signal {-done.returncode}",
            )
        if done.returncode:
            return "declines", done.stderr
        return "runs", f"{len(functions)} functions"

    def test_3_every_module_loads_runs_1000_cycles_and_exits(self):
        results = {name: self.one(name) for name in MODULES}
        counts = {
            kind: [name for name, (what, _) in results.items() if what == kind]
            for kind in ("runs", "declines", "crashes")
        }
        if FIGURES:
            for name, (what, why) in results.items():
                print(f"{name:24} {what:9} {why}")
            print(
                f"{len(MODULES)} modules:",
                ", ".join(f"{len(names)} {kind}" for kind, names in counts.items()),
            )
        self.assertEqual(sorted(DECLINE | (DECLINE_NEWER if NEWER else {})), counts["declines"])
        self.assertEqual(sorted(CRASH), counts["crashes"])
        for name, piece in {**DECLINE, **(DECLINE_NEWER if NEWER else {}), **CRASH}.items():
            self.assertIn(piece, results[name][1], name)

    def test_4_errors(self):
        for text, piece in (
            ("loadrt --linuxcnc and2 cout=1", "component 'and2' has no argument 'cout'"),
            ("loadrt --linuxcnc and2 count=2 names=a", "count= and names= are mutually exclusive"),
            ("loadrt --linuxcnc nothing", "LinuxCNC module 'nothing' does not exist"),
            ("loadrt motmod", "missing symbols"),
        ):
            with self.subTest(text):
                done = self.sim(text + "\n")
                self.assertEqual(1, done.returncode)
                self.assertIn(piece, done.stderr)
        done = self.run_program(
            "sim",
            "--quiet",
            "-k",
            self.write(
                "m.hal",
                "loadrt --linuxcnc and2 count=2 names=a\nloadrt --linuxcnc and2\ngetp and2.0.out\n",
            ),
        )
        self.assertTrue(done.stdout.endswith("FALSE\n"), done.stdout + done.stderr)

    def test_5_the_motion_controller(self):
        out = self.good_sim(MOTION + "list comp\nlist pin\nlist param\nlist funct\nshow thread\n")
        lines = out.splitlines()
        self.assertEqual({"trivkins", "tpmod", "homemod", "motmod"}, set(lines[0].split()))
        motion = [
            name
            for name in (lines[1] + " " + lines[2]).split()
            if re.match(r"joint\.|axis\.|motion\.|spindle\.|motion-", name)
        ]
        # LinuxCNC counts 360 pins and 29 parameters: two pins and two parameters of its threads among them
        pins = [name for name in lines[1].split() if not re.match(r".*-thread\.", name)]
        self.assertEqual({"motion-command-handler", "motion-controller"}, set(lines[3].split()))
        self.assertEqual(
            371 if NEWER else 358,
            len(set(pins) - {name for name in pins if name.endswith(".tmax-increased")}),
            motion,
        )
        self.assertRegex(out, r"1000000 .*servo-thread")
        self.assertRegex(out, r"100000 .*base-thread")

    def test_6_the_motion_controller_runs_and_leaves_its_thread(self):
        self.write(
            "m.hal",
            MOTION
            + "addf motion-command-handler servo-thread\naddf motion-controller servo-thread\nstart\n",
        )
        machine = self.start("run", "m.hal", loaded=False)
        wait_until(
            lambda: machine.poll() is not None
            or self.value("servo-thread.threadbeat") not in ("", "0"),
            "the machine runs",
        )
        self.assertIsNone(machine.poll())
        wait_until(
            lambda: float(self.value("motion.servo.last-period") or 0) > 100000, "two cycles"
        )
        self.assertEqual("FALSE", self.value("motion.motion-enabled"))
        refused = self.shell("unloadrt", "tpmod")
        self.assertIn("'tpmod' cannot be unloaded: its code is used by motmod", refused.stderr)
        unloaded = self.shell("unloadrt", "motmod")
        self.assertEqual(0, unloaded.returncode, unloaded.stderr)
        self.assertNotEqual("", self.value("servo-thread.threadbeat"))
        self.assertEqual(0, self.shell("unloadrt", "tpmod").returncode)
        self.assertEqual(
            "",
            subprocess.run(["ipcs", "-m"], capture_output=True, text=True)
            .stdout.replace("\n", "")
            .partition("0x00000064")[1],
        )

    def test_7_the_patterns_of_hm2_test(self):
        for number, piece in enumerate(PATTERNS):
            with self.subTest(pattern=number):
                done = self.sim(
                    f"loadrt hostmot2 debug_idrom=1 debug_pin_descriptors=1 debug_module_descriptors=1\nloadrt hm2_test test_pattern={number}\n"
                )
                self.assertRegex(done.stderr, r"hm2/hm2_test\.0: " + piece)

    def test_streams_of_sampler_and_streamer_by_the_package_s_programs(self):
        self.write(
            "m.hal",
            """loadrt threads name1=t period1=1000000
loadrt --linuxcnc sampler cfg=fb depth=1000
loadrt --linuxcnc streamer cfg=fs depth=100
loadrt sum2 names=sum
net s sum.out => sum.in0 sampler.0.pin.0
setp sum.in1 1
addf sum t
addf sampler.0 t
addf streamer.0 t
start
""",
        )
        machine = self.start("run", "m.hal", loaded=False)
        wait_until(
            lambda: machine.poll() is not None
            or self.value("sampler.0.curr-depth") not in ("", "0"),
            "samples",
        )
        sampled = subprocess.run(
            ["halsampler", "-c", "0", "-n", "3", "-t"], capture_output=True, text=True, timeout=60
        )
        self.assertEqual(
            (0, ["0 1.000000 0", "1 2.000000 0", "2 3.000000 0"]),
            (sampled.returncode, [line.rstrip() for line in sampled.stdout.splitlines()]),
            sampled.stderr,
        )
        played = subprocess.run(
            ["halstreamer", "-c", "0"],
            input="1.5 7\n2.5 8\n",
            capture_output=True,
            text=True,
            timeout=60,
        )
        self.assertEqual(0, played.returncode, played.stderr)
        wait_until(lambda: self.value("streamer.0.pin.1") == "8", "the last record")
        self.assertEqual("2.5", self.value("streamer.0.pin.0"))

    def journaled(self, text, fed=""):
        """Runs a machine with a journal for 500 cycles of its thread t; what its re-execution prints."""
        machine = self.start(
            "run", self.write("m.hal", text), "--journal", "run.mcap", "--values", "*", loaded=False
        )

        def cycles():
            self.assertIsNone(machine.poll())
            return int(self.value("t.threadbeat") or 0)

        wait_until(lambda: cycles() > 100, "the machine runs")
        if fed:
            played = subprocess.run(
                ["halstreamer", "-c", "0"], input=fed, capture_output=True, text=True, timeout=60
            )
            self.assertEqual(0, played.returncode, played.stderr)
        wait_until(lambda: cycles() > 500, "500 cycles")
        out, error = self.end(machine)
        self.assertEqual(0, machine.returncode, out + error)
        return self.run_program("replay", "--exact", "run.mcap")

    @unittest.skipIf(SANITIZED, "a sanitizer has the functions of the clock")
    def test_a_journal_has_what_motion_computes(self):
        done = self.journaled("""loadrt threads name1=t period1=1000000
loadrt trivkins
loadrt tpmod
loadrt homemod
loadrt motmod num_joints=3
loadrt --linuxcnc sampler cfg=ff depth=100
loadrt siggen names=wave
net position joint.0.motor-pos-cmd => joint.0.motor-pos-fb sampler.0.pin.0
net sine wave.sine => sampler.0.pin.1
addf motion-command-handler t
addf motion-controller t
addf wave.update t
addf sampler.0 t
""")
        self.assertEqual(0, done.returncode, done.stdout + done.stderr)
        self.assertRegex(done.stdout, r"^\d{3,} cycles of 2 threads")
        self.assertRegex(done.stdout, r"\nno difference, \d{5,} values compared\n$")

    @unittest.skipIf(SANITIZED, "a sanitizer has the functions of the clock")
    def test_a_journal_does_not_have_what_a_program_puts_into_shared_memory(self):
        done = self.journaled(
            """loadrt threads name1=t period1=1000000
loadrt --linuxcnc streamer cfg=fs depth=100
addf streamer.0 t
""",
            fed="1.5 7\n2.5 8\n",
        )
        self.assertEqual(1, done.returncode, done.stdout + done.stderr)
        self.assertRegex(
            done.stdout, r"(?m)^first difference: 'streamer\.0\.\S+' \('streamer' of streamer, "
        )

    def test_our_halsampler_becomes_the_package_s_for_its_module(self):
        self.write(
            "m.hal",
            """loadrt threads name1=t period1=1000000
loadrt --linuxcnc sampler cfg=f depth=1000
loadrt sum2 names=sum
net s sum.out => sum.in0 sampler.0.pin.0
setp sum.in1 1
addf sum t
addf sampler.0 t
start
""",
        )
        machine = self.start("run", "m.hal", loaded=False)
        wait_until(
            lambda: machine.poll() is not None
            or self.value("sampler.0.curr-depth") not in ("", "0"),
            "samples",
        )
        sampled = subprocess.run(
            [HAL.parent / "halsampler", "-n", "3", "-t"],
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=60,
        )
        self.assertEqual(
            (0, ["0 1.000000", "1 2.000000", "2 3.000000"]),
            (sampled.returncode, [line.rstrip() for line in sampled.stdout.splitlines()]),
            sampled.stderr,
        )
        missing = subprocess.run(
            [HAL.parent / "halsampler", "-c", "1"],
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=60,
        )
        self.assertEqual(1, missing.returncode)
        self.assertIn("unknown stream 'sampler.1'", missing.stderr)

    def test_twopass_merges_the_loads_of_a_module(self):
        self.environment["HALCYON_MODULES"] = "linuxcnc"
        self.write("a.hal", "loadrt and2 names=first\nloadrt or2 count=1\n")
        self.write("b.hal", "loadrt and2 names=second\nloadrt or2 count=2\nlist pin *.out\n")
        machine = "[HAL]\n{}HALFILE = a.hal\nHALFILE = b.hal\n"
        done = self.run_program(
            "sim", "--quiet", self.write("m.ini", machine.format("TWOPASS = on\n"))
        )
        self.assertEqual(
            (0, "first.out or2.0.out or2.1.out or2.2.out second.out"),
            (done.returncode, " ".join(sorted(done.stdout.split()))),
            done.stderr,
        )
        self.assertIn(
            "which is loaded once",
            self.run_program("sim", "--quiet", self.write("m.ini", machine.format(""))).stderr,
        )

    def test_7_the_drivers_of_mesa_cards(self):
        self.assertNotIn(
            "hm2_eth.0", self.good_sim("loadrt hostmot2\nloadrt hm2_eth\nlist pin\nlist comp\n")
        )
        done = self.sim("loadrt hostmot2\nloadrt hm2_eth board_ip=10.99.99.99\n")
        self.assertEqual(1, done.returncode)
        self.assertIn("10.99.99.99", done.stderr)
        if os.geteuid() == 0:
            rules = subprocess.run(
                ["sh", "-c", "iptables -S"], capture_output=True, text=True
            ).stdout
            self.assertNotIn("hm2-eth", rules)


def main():
    if not MODULES:
        print(
            f"{FOLDER} is missing; type: sudo apt-get install --no-install-recommends linuxcnc-uspace"
        )
        sys.exit(77)
    CDLL(None).prctl(
        24, 17, 0, 0, 0
    )  # PR_CAPBSET_DROP, CAP_SYS_RAWIO: as root, nothing here may write to a parallel port of this computer
    sys.argv[1:] = [word for word in sys.argv[2:] if word != "--figures"]
    unittest.main()


if __name__ == "__main__":
    main()
