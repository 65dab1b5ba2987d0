#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: linuxcnc
"""LinuxCNC's compiled modules: what a module may do, and what goes wrong with one. The modules are in modules/, compiled here; LinuxCNC is
not needed (tests/peers/linuxcnc_modules_test.py runs its own)."""

import re
import signal
import subprocess
import unittest
from pathlib import Path

import harness
from module_case import CC, THREAD, ModuleCase

GUARDED = harness.HAL.parent / "rt-guard" / "hal"  # the program with the real-time guard


@unittest.skipUnless(CC, "no C compiler")
class Modules(ModuleCase):
    # --- what works ------------------------------------------------------------------------------------------------------

    def test_a_module_computes_with_pins_parameters_and_arguments(self):
        self.build("gain")
        out = self.sim(THREAD + """loadrt gain count=2 offset=0x10 steps=1,3
addf gain.0 t
addf gain.1 t
net x gain.0.out => gain.1.in
setp gain.0.in 1.5
start
advance 4 cycles
getp gain.0.gain
getp gain.0.out
getp gain.1.out
getp gain.0.threaded
getp gain.0.cycles
getp gain.1.cycles
setp gain.1.limit 5
setp gain.0.gain 4
advance 1 cycles
getp gain.1.cycles
gets x
""")
        self.assertEqual(("", "2\n19\n54\nTRUE\n4\n12\n0\n22\n"), (out.stderr, out.stdout))

    def test_memory_by_key_belongs_to_one_machine(self):
        self.build("planner", "follow")
        loaded = "loadrt planner\nloadrt follow\n"
        machine = self.start(
            "run",
            self.write(
                "first.hal", "loadrt threads name1=servo period1=1000000\n" + loaded + "start\n"
            ),
        )
        done = self.sim(loaded)
        self.assertEqual(1, done.returncode, done.stdout + done.stderr)
        self.assertIn(
            f"shared memory with key 0x48414c99 belongs to another machine, process {machine.pid}; end that one, or give each a key "
            "(motmod: key=, [EMCMOT]SHMEM_KEY)",
            done.stderr,
        )
        self.end(machine)
        self.assertEqual(0, self.sim(loaded).returncode)

    def test_names_go_to_the_module(self):
        self.build("gain")
        out = self.sim(
            THREAD
            + 'loadrt gain names="left"\naddf left t\nsetp left.in 3\nstart\nadvance 1 cycles\ngetp left.out\n'
        )
        self.assertEqual(("", "6\n"), (out.stderr, out.stdout))

    def test_it_is_read_only_where_the_module_says_so(self):
        self.build("gain")
        self.assertIn("gain.0.cycles", self.error("loadrt gain\nsetp gain.0.cycles 3\n"))

    def test_modules_call_each_other_and_make_threads(self):
        self.build("planner", "follow")
        out = self.sim("""loadrt planner
loadrt follow period=2000000
loadrt --native sum2 names=sum
net step sum.out => planner.scale
net seen planner.last
setp sum.in0 0.5
addf sum follow-thread
addf follow follow-thread
start
advance 3 cycles
getp follow.position
gets seen
show thread
""")
        self.assertEqual("", out.stderr)
        self.assertEqual(["1.5", "1.5"], out.stdout.split()[:2])
        self.assertRegex(out.stdout, r"2000000 .*follow-thread|follow-thread.*2000000")

    def test_a_module_can_be_loaded_again_with_its_first_values(self):
        self.build("planner", "follow")
        out = self.sim("""loadrt planner
loadrt follow
setp planner.scale 1
addf follow follow-thread
start
advance 3 cycles
getp follow.position
unloadrt follow
unloadrt planner
advance 1 cycles
loadrt planner
loadrt follow
addf follow follow-thread
start
advance 1 cycles
getp follow.position
getp planner.scale
""")
        self.assertEqual(("", ["3", "0", "0"]), (out.stderr, re.findall(r"(?m)^\d+$", out.stdout)))
        self.assertIn(
            "it is still loaded: an unload in the same transaction takes effect at its end",
            self.error("loadrt planner\nunloadrt planner\nloadrt planner\n"),
        )

    def test_the_thread_of_a_module_outlives_it_and_is_used_again(self):
        self.build("planner", "follow")
        out = self.sim("""loadrt planner
loadrt follow
addf follow follow-thread
start
advance 2 cycles
unloadrt follow
advance 2 cycles
getp follow-thread.threadbeat
loadrt follow
addf follow follow-thread
setp planner.scale 2
advance 2 cycles
getp follow.position
""")
        self.assertEqual(("", "4\n4\n"), (out.stderr, out.stdout))

    def test_what_save_prints_loads_again(self):
        self.build("planner", "follow")
        self.build("sum2", source="gain")  # a component of ours has that name
        first = self.sim(
            "loadrt planner\nloadrt follow period=2000000\nloadrt --linuxcnc sum2 count=2\naddf follow follow-thread\naddf gain.0 follow-thread\naddf gain.1 follow-thread\nsave all\n"
        )
        self.assertEqual("", first.stderr)
        self.assertIn(
            "loadrt follow period=2000000\nloadrt --linuxcnc sum2 count=2\n", first.stdout
        )
        again = self.sim(first.stdout + "save all\n")
        self.assertEqual(("", first.stdout), (again.stderr, again.stdout))

    def test_messages_of_a_cycle_are_printed_by_another_thread_within_a_limit(self):
        self.build("troubled")
        out = self.sim(
            THREAD + "loadrt troubled fault=talk\naddf troubled t\nstart\nadvance 1000 cycles\n"
        )
        self.assertEqual(0, out.returncode, out.stderr)
        lines = out.stderr.splitlines()
        self.assertEqual("troubled: hello", lines[0])
        self.assertIn(
            "troubled: message 1", lines
        )  # on a busy host, how many were lost comes first
        self.assertLess(len(lines), 400)
        withheld = [
            int(line.split()[1]) for line in lines if "not printed (limit 100 per second)" in line
        ]
        self.assertEqual(
            1000, sum(withheld) + sum("message" in line and "troubled" in line for line in lines)
        )

    def test_threads_are_not_stopped_by_a_module(self):
        self.build("stopper")
        done = self.sim(
            THREAD
            + "loadrt stopper\naddf stopper t\nstart\nadvance 3 cycles\ngetp stopper.result\nunloadrt stopper\nadvance 2 cycles\ngetp t.threadbeat\n"
        )
        self.assertEqual((0, "-1\n5\n"), (done.returncode, done.stdout), done.stderr)
        self.assertEqual(
            [
                "hal_del_funct_from_thread: 'other': not a function of this module, which is being unloaded",
                "stopper: 0 0 -22",
            ],
            done.stderr.splitlines(),
        )

    def test_messages_of_a_cycle_are_formatted_without_the_c_library(self):
        self.build("speaker")
        for program in [p for p in (harness.HAL, GUARDED) if p.exists()]:
            netlist = self.write(
                "m.hal", THREAD + "loadrt speaker\naddf speaker t\nstart\nadvance 1 cycles\n"
            )
            done = subprocess.run(
                [str(program), "sim", "--quiet", netlist],
                cwd=self.folder,
                env=self.environment,
                capture_output=True,
                text=True,
                timeout=harness.TIMEOUT,
            )
            self.assertEqual(("", 0), (done.stdout, done.returncode), done.stderr)
            self.assertEqual(
                [
                    "speaker: 7 -0x00ff text    3.25 1e+10",
                    "speaker: 0.1"
                    + "000000000000000055511151231257827021181583404541015625"
                    + "0" * 445,
                    f"speaker: {7:990}|",
                    "speaker: %1$d",
                    "speaker: a=0003 6",
                ],
                [line for line in done.stderr.splitlines()],
            )

    def test_records_of_a_stream_come_out_in_order_and_lost_ones_are_counted(self):
        self.build("stream")
        names = (
            "written",
            "got",
            "real",
            "bit",
            "s32",
            "u32",
            "number",
            "depth",
            "overruns",
            "underruns",
        )
        show = "".join(f"getp stream.{name}\n" for name in names)
        # two cycles of writing, then five: a stream of depth 4 holds 3 records; then reading; then both; then an empty stream
        done = self.sim(
            THREAD
            + "loadrt stream\naddf stream t\nstart\nsetp stream.write TRUE\nadvance 2 cycles\n"
            + show
            + "advance 3 cycles\n"
            + show
            + "setp stream.write FALSE\nsetp stream.read TRUE\nadvance 2 cycles\n"
            + show
            + "setp stream.write TRUE\nadvance 3 cycles\n"
            + show
            + "setp stream.write FALSE\nadvance 2 cycles\n"
            + show
        )
        self.assertEqual((0, ""), (done.returncode, done.stderr))
        words = done.stdout.split()
        self.assertEqual(
            [
                ["0", "0", "0", "FALSE", "0", "0", "0", "2", "0", "0"],
                ["-28", "0", "0", "FALSE", "0", "0", "0", "3", "2", "0"],
                ["-28", "0", "1", "FALSE", "-2", "4000000002", "2", "1", "2", "0"],
                ["0", "0", "4.5", "TRUE", "-9", "4000000009", "5", "1", "2", "0"],
                ["0", "-28", "5", "FALSE", "-10", "4000000010", "6", "0", "2", "1"],
            ],
            [words[i : i + len(names)] for i in range(0, len(words), len(names))],
        )

    def test_firmware_is_read_from_its_folder_only(self):
        self.build("firmware")
        for name, number in (("no-such-firmware.bin", -2), ("../hostname", -22)):
            error = self.error(f"loadrt firmware file={name}\n")
            self.assertIn(f"firmware: {name}: {number} (rtapi_app_main: ", error)
        files = (
            sorted(path for path in Path("/lib/firmware").rglob("*") if path.is_file())
            if Path("/lib/firmware").is_dir()
            else []
        )
        for path in files[:1]:
            data = path.read_bytes()
            done = self.sim(f"loadrt firmware file={path.relative_to('/lib/firmware')}\n")
            self.assertEqual(
                (0, f"firmware: {len(data)} bytes, sum {sum(data)}\n"),
                (done.returncode, done.stdout + done.stderr),
            )

    def test_ours_is_loaded_first_unless_told_otherwise(self):
        self.build("sum2", source="gain")
        self.assertEqual(
            "0\n",
            self.good("sim", "--quiet", self.write("m.hal", "loadrt sum2\ngetp sum2.0.in0\n")),
        )
        self.assertEqual(
            "2\n",
            self.good(
                "sim", "--quiet", self.write("m.hal", "loadrt --linuxcnc sum2\ngetp gain.0.gain\n")
            ),
        )
        self.build("gain")
        self.assertIn("unknown component 'gain'", self.error("loadrt --native gain\n"))
        self.assertEqual(
            "0\n",
            self.good(
                "sim", "--quiet", self.write("m.hal", "loadrt --native sum2\ngetp sum2.0.in0\n")
            ),
        )

    def test_a_driver_of_linuxcnc_comes_first_where_it_is_installed(self):
        """Other modules of LinuxCNC use its hostmot2."""
        text = "loadrt hostmot2\ngetp gain.0.gain\n"
        self.assertIn("unknown pin or parameter 'gain.0.gain'", self.error(text))
        self.build("hostmot2", source="gain")
        self.assertEqual("2\n", self.good("sim", "--quiet", self.write("m.hal", text)))
        ours = "loadrt --native hostmot2\nreload hostmot2\n"
        self.good("sim", "--quiet", self.write("m.hal", ours))
        self.assertIn(
            "unknown pin or parameter 'gain.0.gain'", self.error(ours + "getp gain.0.gain\n")
        )

    def test_linuxcncs_modules_come_first_where_the_environment_says_so(self):
        self.build("sum2", source="gain")
        self.environment["HALCYON_MODULES"] = "linuxcnc"
        text = "loadrt sum2\ngetp gain.0.gain\nloadrt or2\ngetp or2.0.out\n"
        self.assertEqual("2\nFALSE\n", self.good("sim", "--quiet", self.write("m.hal", text)))
        self.assertEqual(
            "0\n",
            self.good(
                "sim", "--quiet", self.write("m.hal", "loadrt --native sum2\ngetp sum2.0.in0\n")
            ),
        )
        self.assertEqual(
            "0\n",
            self.good(
                "sim",
                "--quiet",
                self.write(
                    "m.hal", "loadrt --native sum2 names=a\nloadrt sum2 names=b\ngetp b.in0\n"
                ),
            ),
        )

    def test_another_preference_is_an_error_and_not_ignored(self):
        self.environment["HALCYON_MODULES"] = "linuxnc"
        self.assertEqual(
            """m.hal:1:8: error: HALCYON_MODULES is 'linuxnc' in the environment of the machine; its only value is 'linuxcnc' [wrong-arguments]
    1 | loadrt or2
      |        ^^^
      = help: unset HALCYON_MODULES, or export HALCYON_MODULES=linuxcnc to load LinuxCNC's modules first; then start the machine again
""",
            self.error("loadrt or2\n").split("\n\n")[0] + "\n",
        )
        self.good("sim", "--quiet", self.write("m.hal", "loadrt --native or2\n"))

    def test_a_component_is_taken_from_one_place(self):
        self.assertEqual(
            """m.hal:1:17: error: --native and --linuxcnc are both given: a component is taken from one place [wrong-arguments]
    1 | loadrt --native --linuxcnc gain
      |        -------- ^^^^^^^^^^ and the other
      |        one option
      = help: loadrt --native NAME loads Halcyon's component, loadrt --linuxcnc NAME LinuxCNC's module
""",
            self.error("loadrt --native --linuxcnc gain\n").split("\n\n")[0] + "\n",
        )
        for options in ("--linuxcnc", "--native --native"):
            self.assertIn(
                "the name of a component is missing after the option [wrong-arguments]",
                self.error(f"loadrt {options}\n"),
            )
        self.assertIn(
            "loadrt [--native|--linuxcnc] COMPONENT",
            self.good("sim", "--quiet", self.write("m.hal", "help loadrt\n")),
        )

    def test_doc_describes_a_module_without_running_it(self):
        self.build("gain")
        page = self.good("doc", "gain")
        for text in (
            "Multiplies",
            "count",
            "number of instances",
            "offset",
            "pin: in:the input",
            f"A compiled module of LinuxCNC: {self.modules}/gain.so",
        ):
            self.assertIn(text, page)

    def test_check_does_not_run_a_module(self):
        self.build("troubled")
        done = self.run_program(
            "check",
            self.write(
                "m.hal",
                THREAD + "loadrt troubled fault=main\naddf troubled t\nsetp troubled.out 1\n",
            ),
        )
        self.assertEqual(0, done.returncode, done.stderr)

    def test_check_knows_that_drivers_of_mesa_cards_need_hostmot2(self):
        self.build("hostmot2", "hm2_eth", source="gain")
        right = "loadrt hostmot2\nloadrt hm2_eth board_ip=10.10.10.10\n"
        done = self.run_program("check", self.write("m.hal", right))
        self.assertEqual(0, done.returncode, done.stderr)
        wrong = "loadrt hm2_eth board_ip=10.10.10.10\nloadrt hostmot2\n"
        done = self.run_program("check", self.write("m.hal", wrong))
        self.assertEqual(1, done.returncode)
        self.assertEqual(
            """m.hal:1:8: error: module 'hm2_eth' uses 'hostmot2', which is not loaded before it [construct-failed]
    1 | loadrt hm2_eth board_ip=10.10.10.10
      |        ^^^^^^^
      = help: load that first: loadrt hostmot2

1 error
""",
            done.stderr.replace(f"{self.folder}/", ""),
        )

    # --- what goes wrong -------------------------------------------------------------------------------------------------

    def test_a_component_that_only_linuxcnc_has_names_what_takes_its_place(self):
        self.environment["HAL_RTMOD_DIR"] = "/nowhere"
        failed = self.error("loadrt laserpower\n")
        self.assertIn(
            "component 'laserpower' is one of LinuxCNC's that Halcyon does not have", failed
        )
        self.assertIn("= help: use mult2 and limit1, or compile LinuxCNC's", failed)

    def test_a_missing_folder_names_the_package(self):
        self.environment["HAL_RTMOD_DIR"] = "/nowhere"
        self.assertEqual(
            """m.hal:1:8: error: unknown component 'motmod' [no-such-component]
    1 | loadrt motmod
      |        ^^^^^^
      = help: hal doc lists all components; if it is a module of LinuxCNC, which is not installed: sudo apt-get install linuxcnc-uspace
""",
            self.error("loadrt motmod\n").split("\n\n")[0] + "\n",
        )
        self.assertIn(
            "'motmod' is a module of LinuxCNC, which is not installed: /nowhere does not exist [no-such-component]",
            self.error("loadrt --linuxcnc motmod\n"),
        )
        self.assertNotIn("LinuxCNC", self.error("loadrt adn2\n"))  # and2 is meant

    def test_a_missing_module(self):
        self.assertIn(
            f"m.hal:1:19: error: LinuxCNC module 'and2' does not exist in {self.modules} [no-such-component]",
            self.error("loadrt --linuxcnc and2\n"),
        )

    def test_a_module_for_another_machine(self):
        self.build("gain")
        path = self.modules / "gain.so"
        data = bytearray(path.read_bytes())
        data[18:20] = (8).to_bytes(2, "little")  # MIPS
        path.write_bytes(data)
        self.assertRegex(
            self.error("loadrt gain\n"),
            r"error: '.*/gain\.so' is not a usable LinuxCNC module: it is built for machine type 8, this program for \S+ \[bad-plugin\]",
        )

    def test_a_file_that_is_not_a_module(self):
        (self.modules / "gain.so").write_text("hello")
        self.assertIn(
            "is not a usable LinuxCNC module: it is not a shared object",
            self.error("loadrt gain\n"),
        )
        self.build("gain")
        path = self.modules / "gain.so"
        path.write_bytes(path.read_bytes()[:3000])
        self.assertIn(
            "is not a usable LinuxCNC module: the file is cut short", self.error("loadrt gain\n")
        )
        (self.folder / "plain.c").write_text("int nothing;\n")
        subprocess.run(
            [CC, "-shared", "-fPIC", "-o", str(path), str(self.folder / "plain.c")], check=True
        )
        self.assertIn(
            "it is not a LinuxCNC module: it does not export rtapi_app_main",
            self.error("loadrt gain\n"),
        )

    def test_an_unknown_parameter(self):
        self.build("gain")
        self.assertEqual(
            """m.hal:1:13: error: component 'gain' has no argument 'cout' [unknown-argument]
    1 | loadrt gain cout=1
      |             ^^^^^^ did you mean 'count'?
      = help: its arguments: count, names, offset, steps
""",
            self.error("loadrt gain cout=1\n").split("\n\n")[0] + "\n",
        )

    def test_values_that_do_not_fit(self):
        self.build("gain")
        for given, why in (
            ("count=x", "count=x is not a whole number"),
            ("count=1.5", "count=1.5 is not a whole number"),
            ("count=3000000000", "count=3000000000 is not a whole number"),
            ("steps=1,2,3,4,5", "steps=1,2,3,4,5 has more than 4 values"),
        ):
            with self.subTest(given):
                self.assertIn(
                    f"error: component 'gain': {why} [bad-argument]",
                    self.error(f"loadrt gain {given}\n"),
                )

    def test_an_empty_number_is_0_and_integers_are_read_as_in_c(self):
        self.build("gain")
        netlist = (
            "newthread t 1000000\nloadrt gain count=0x2 steps=3,,\naddf gain.0 t\naddf gain.1 t\nstart\nadvance 2 cycles\n"
            "getp gain.0.cycles\ngetp gain.1.cycles\n"
        )
        done = self.run_program("sim", "--quiet", self.write("m.hal", netlist))
        self.assertEqual(("6\n0\n", ""), (done.stdout, done.stderr))

    def test_a_failed_main_leaves_nothing_and_its_messages_are_lines_before_the_error(self):
        self.build("gain", "troubled")
        done = self.run_program(
            "sim",
            "--quiet",
            "-k",
            self.write(
                "m.hal",
                "loadrt gain count=2 names=a\nshow comp\nloadrt troubled fault=fail\nloadrt gain\ngetp gain.0.gain\n",
            ),
        )
        self.assertIn(
            "component 'gain' cannot make 'gain': count= and names= are mutually exclusive (rtapi_app_main: Invalid argument (-22)) [construct-failed]",
            done.stderr,
        )
        self.assertIn(
            "component 'troubled' cannot make 'troubled': troubled: no card (rtapi_app_main: No such device (-19)) [construct-failed]",
            done.stderr,
        )
        self.assertIn(
            "\ntroubled: begins\ntroubled: loading a driver without a card\ntroubled: no card\ntroubled: giving up\n",
            done.stderr,
        )
        self.assertEqual(1, done.stderr.count("troubled: loading"), done.stderr)
        self.assertLess(
            done.stderr.index("\ntroubled: no card\n"), done.stderr.index("cannot make 'troubled'")
        )
        self.assertNotIn("never printed", done.stderr)
        self.assertTrue(done.stdout.endswith("2\n"), done.stdout)

    def test_a_failed_driver_of_mesa_cards_names_the_one_of_halcyon(self):
        self.build("hm2_eth", source="troubled")
        failed = self.error("loadrt hm2_eth fault=fail\n")
        self.assertIn("component 'hm2_eth' cannot make 'hm2-eth': troubled: no card", failed)
        self.assertIn("= help: Halcyon has a driver of its own: loadrt --native hm2_eth\n", failed)
        self.build("troubled")
        self.assertNotIn("a driver of its own", self.error("loadrt troubled fault=fail\n"))

    @unittest.skipIf(harness.SANITIZED, "the sanitizer takes crash signals")
    def test_a_crash_in_main_is_an_error_and_the_machine_goes_on(self):
        self.build("troubled", "gain")
        done = self.run_program(
            "sim",
            "--quiet",
            "-k",
            self.write(
                "m.hal",
                "loadrt gain\nloadrt troubled fault=main\nloadrt troubled\ngetp gain.0.gain\n",
            ),
        )
        self.assertIn(
            "component 'troubled' cannot make 'troubled': rtapi_app_main crashed (segmentation fault) [construct-failed]",
            done.stderr,
        )
        self.assertEqual("2\n", done.stdout)

    @unittest.skipIf(harness.SANITIZED, "the sanitizer takes crash signals")
    def test_a_crash_in_exit_is_reported(self):
        self.build("troubled")
        done = self.sim("loadrt troubled fault=exit\nunloadrt troubled\nshow comp\n")
        self.assertEqual(0, done.returncode)
        self.assertIn("troubled: rtapi_app_exit crashed (segmentation fault)", done.stderr)

    @unittest.skipIf(harness.SANITIZED, "the sanitizer takes crash signals")
    def test_a_crash_in_a_function_names_the_module(self):
        self.build("troubled")
        done = self.sim(
            THREAD + "loadrt troubled fault=cycle\naddf troubled t\nstart\nadvance 5 cycles\n"
        )
        self.assertEqual(-signal.SIGSEGV, done.returncode)
        self.assertIn(
            "hal: troubled: function 'troubled' crashed (segmentation fault) at cycle 2; outputs were set to their safe values; the process ends",
            done.stderr,
        )

    def test_a_function_that_ends_the_process_is_named(self):
        self.build("blocker")
        done = self.sim(
            THREAD + "loadrt blocker fault=exit\naddf blocker.update t\nstart\nadvance 5 cycles\n"
        )
        self.assertEqual(
            (
                3,
                "hal: blocker: function 'blocker.update' called exit() at cycle 2; outputs were set to their safe values; the process ends\n",
            ),
            (done.returncode, done.stderr),
        )

    @unittest.skipUnless(GUARDED.exists(), "no clang 19: no real-time guard")
    def test_the_real_time_guard_names_a_function_that_allocates_or_blocks(self):
        self.build("blocker")
        for call in ("malloc", "usleep", "write", "fprintf"):
            with self.subTest(call):
                netlist = self.write(
                    "m.hal",
                    THREAD
                    + f"loadrt blocker fault={call}\naddf blocker.update t\nstart\nadvance 5 cycles\n",
                )
                done = subprocess.run(
                    [str(GUARDED), "sim", "--quiet", netlist],
                    cwd=self.folder,
                    env=self.environment,
                    capture_output=True,
                    text=True,
                    timeout=harness.TIMEOUT,
                )
                self.assertEqual(1, done.returncode, done.stderr)
                self.assertRegex(done.stderr, f"Real-time violation: .*`{call}`")
                self.assertIn(
                    "hal: blocker: function 'blocker.update' made the call that the real-time guard prints above, at cycle 2; outputs were set to their safe values; the process ends\n",
                    done.stderr,
                )

    def test_a_missing_symbol_names_the_module_that_has_it(self):
        self.build("planner", "follow")
        self.assertEqual(
            """m.hal:1:8: error: component 'follow' cannot make 'follow': it uses planner_next, which is defined by module 'planner' [construct-failed]
    1 | loadrt follow
      |        ^^^^^^
      = help: load that first: loadrt planner
""",
            self.error("loadrt follow\n").split("\n\n")[0] + "\n",
        )
        (self.modules / "planner.so").unlink()
        self.assertIn(
            "it uses planner_next, which is defined neither by this runtime nor by a module in",
            self.error("loadrt follow\n"),
        )

    def test_a_module_of_another_version_of_linuxcnc(self):
        symbol = "hal_init_future"
        why = "is not in the interface of LinuxCNC 2.9 or 2.10: the module is built for another version"
        for more, extra in (
            (", a_neighbour(void)", f" and 1 more missing symbols; {symbol}"),
            ("", ", which"),
        ):
            (self.folder / "other.c").write_text(
                f"int {symbol}(void){more};\nint rtapi_app_main(void) {{ return {symbol}(){' + a_neighbour()' if more else ''}; }}\nvoid rtapi_app_exit(void) {{}}\n"
            )
            subprocess.run(
                [
                    CC,
                    "-shared",
                    "-fPIC",
                    "-o",
                    str(self.modules / "other.so"),
                    str(self.folder / "other.c"),
                ],
                check=True,
            )
            with self.subTest(extra):
                error = self.error("loadrt other\n")
                self.assertIn(
                    f"cannot make 'other': it uses {symbol}{extra} {why} [construct-failed]", error
                )
                self.assertIn(
                    "= help: use the module of LinuxCNC 2.9 (linuxcnc-uspace) or 2.10, or build this one again with the halcompile of one of these\n",
                    error,
                )

    def test_a_module_in_use_stays(self):
        self.build("planner", "follow")
        self.build("second", source="user")
        both = "loadrt planner\nloadrt follow\nloadrt second\nunloadrt planner\n"
        self.assertEqual(
            """m.hal:4:10: error: 'planner' cannot be unloaded: its code is used by follow, second [module-in-use]
    4 | unloadrt planner
      |          ^^^^^^^
      = help: unload what uses it first: unloadrt follow, then unloadrt second
""",
            self.error(both).split("\n\n")[0] + "\n",
        )
        done = self.sim(
            "loadrt planner\nloadrt follow\nbegin\nunloadrt follow\nunloadrt planner\ncommit\nshow comp\n"
        )
        self.assertEqual((0, ""), (done.returncode, done.stderr))
        self.assertNotIn("planner", done.stdout)

    def test_a_module_is_loaded_once_and_not_reloaded(self):
        self.build("gain")
        self.assertIn(
            "'gain' is a LinuxCNC module, which is loaded once, and it is already loaded [name-taken]",
            self.error("loadrt gain\nloadrt gain names=b\n"),
        )
        self.assertIn(
            "'gain' is a LinuxCNC module, whose static variables allow one copy at a time [reload-conflict]",
            self.error("loadrt gain\nreload gain\n"),
        )

    def test_an_edit_that_fails_later_unloads_the_module(self):
        self.build("gain")
        done = self.run_program(
            "sim", "--quiet", self.write("m.hal", "loadrt gain\nnet x nothing.out\n")
        )
        self.assertEqual(1, done.returncode)
        done = self.run_program(
            "sim",
            "--quiet",
            "-k",
            self.write(
                "m.hal",
                "begin\nloadrt gain\nnet x nothing.out\ncommit\nloadrt gain\ngetp gain.0.gain\n",
            ),
        )
        self.assertTrue(done.stdout.endswith("2\n"), done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
