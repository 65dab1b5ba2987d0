#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: linuxcnc
"""liblinuxcnchal.so.0: programs that are linked to LinuxCNC's library connect to a running machine. The programs are in linuxcnc_programs/, compiled here;
LinuxCNC is not needed (tests/peers runs its own)."""
import shutil
import signal
import subprocess
import sys
import unittest
from pathlib import Path

import harness
from harness import wait_until

SOURCES = Path(__file__).resolve().parent
CC = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
LIBRARY = harness.HAL.parent.parent / "lib/halcyon/linuxcnc"
NETLIST = """newthread servo 1000000
loadrt sum2 names=adder
addf adder servo
start
setp adder.in0 5
"""


@unittest.skipUnless(CC, "no C compiler")
class LinuxcncPrograms(harness.Case):
    def setUp(self):
        super().setUp()
        self.programs = self.folder / "bin"
        self.programs.mkdir()
        self.environment["PATH"] = f"{self.programs}:{self.environment['PATH']}"
        self.environment["HAL_RTMOD_DIR"] = str(self.programs)

    def build(self, name):
        """Linked as LinuxCNC's are: to the name of the library, without a path to it."""
        subprocess.run(
            [
                CC,
                "-O1",
                "-o",
                str(self.programs / name),
                str(SOURCES / f"linuxcnc_programs/{name}.c"),
                f"-L{LIBRARY}",
                "-l:liblinuxcnchal.so.0",
            ],
            check=True,
        )

    def machine(self, text=NETLIST):
        return self.start("run", self.write("m.hal", text))

    def test_a_library_that_follows_pointers_ends_with_a_sentence_and_what_only_tests_them_works(
        self,
    ):
        library = self.programs / "walking.so"
        subprocess.run(
            [
                CC,
                "-O1",
                "-shared",
                "-fPIC",
                "-o",
                str(library),
                str(SOURCES / "linuxcnc_programs/walking_library.c"),
                f"-L{LIBRARY}",
                "-l:liblinuxcnchal.so.0",
            ],
            check=True,
        )
        self.machine()
        self.say("newsig", "x", "float")
        load = f"import ctypes; it = ctypes.CDLL('{library}'); "

        def python(script):
            self.write("walk.py", load + script + "\n")
            done = self.shell("loadusr", "-w", "-i", sys.executable, "walk.py")
            return done.stdout + done.stderr

        self.assertEqual("0 0 1\n", python("print(it.has_memory(), it.begin(), it.has_memory())"))
        self.assertEqual(
            "1 0 0\n",
            python(
                "it.begin(); print(it.exists(b'sum2'), it.exists(b'sum'), it.exists(b'nothing'))"
            ),
        )
        self.assertEqual("0\n", python("it.begin(); print(it.connects(b'adder.in1', b'x'))"))
        self.assertIn("adder.in1", self.say("show", "sig", "x"))
        for call in ("it.is_ready(b'sum2')", "it.first_pin()"):
            self.assertRegex(
                python(f"it.begin(); print({call})"),
                r"\A.*: this program reads LinuxCNC's memory directly, which a machine of Halcyon does not have. In its place: Python's and Tcl's hal "
                r"of Halcyon, which loadusr and hal linuxcnc find first where they are built\n\Z",
            )
        self.write("walk.py", load + "it.begin(); ctypes.string_at(0)\n")
        self.assertIn(
            "was terminated by signal 11",
            self.shell("loadusr", "-w", sys.executable, "walk.py").stderr,
        )  # another address: a crash like any other

    # --- what works ------------------------------------------------------------------------------------------------------

    def test_loads_and_stores_are_pins_of_the_machine(self):
        self.build("gauge")
        machine = self.machine()
        self.say("loadusr", "-Wn", "gauge", "gauge")
        components = self.say("show", "comp")
        self.assertRegex(components, r"User  gauge +\d+ ready\n")
        self.assertRegex(components, r"User  gauge-helper +\d+ ready\n")
        self.assertEqual("-7", self.value("gauge.count"))
        self.say("net", "a", "adder.out", "gauge.0.in")
        self.comes("gauge.0.twice", "10")
        self.say("setp", "gauge.gain", "4")
        self.comes("gauge.0.twice", "20")
        self.say(
            "net", "b", "gauge.0.twice", "adder.in1"
        )  # through both, every time twice the change
        self.say("setp", "gauge.gain", "0.5")
        self.comes("gauge.0.twice", "5")
        self.say("setp", "gauge.on", "1")
        self.comes("gauge.seen", "TRUE")
        self.say("setp", "gauge.count", "12")
        self.comes("gauge.count", "12")
        before = int(self.value("gauge.steps"))
        wait_until(lambda: int(self.value("gauge.steps")) > before, "it counts")
        self.say("unload", "gauge")
        wait_until(lambda: "gauge" not in self.say("show", "comp"), "both components are gone")
        self.end(machine)

    def test_a_program_wires_the_machine_and_asks_for_values(self):
        self.build("wire")
        machine = self.machine(
            "newthread servo 1000000\nloadrt sum2 names=adder\nloadrt scale names=gain\nsetp adder.in0 5\nstart\n"
        )
        done = self.shell("loadusr", "-w", "wire")
        self.assertEqual(
            (
                "new 0\nlink 0 0\naddf 0 0\nstart 0\nset 0\nadder.out: float 5 1\nadder.in1: float 0 0\nx: float 5 1\n"
                "adder.tmax: type 3 0\nadder.ou: EINVAL\nlink -22\nunlink 0 delete 0\n",
                "wire: linkps failed: wire:1:8: error: unknown pin 'nothing.out' [no-such-pin]\n",
            ),
            (done.stdout, done.stderr),
        )
        self.assertEqual("15", self.value("gain.out"))
        self.end(machine)

    def test_programs_and_modules_meet_in_streams(self):
        self.build("reader")
        subprocess.run(
            [
                CC,
                "-shared",
                "-fPIC",
                "-O1",
                "-o",
                str(self.programs / "samples.so"),
                str(SOURCES / "modules/samples.c"),
            ],
            check=True,
        )
        machine = self.machine(
            NETLIST
            + "loadrt samples\naddf samples servo\nsetp samples.real 2.5\nsetp samples.whole -3\n"
        )
        done = self.shell("loadusr", "-w", "reader")
        self.assertEqual(
            ("other key -2, other types -22\n" + "2.5 -3, the next: 1\n" * 2, ""),
            (done.stdout, done.stderr),
        )
        self.end(machine)

    def test_bytes_go_through_ports_in_order_to_and_from_a_module(self):
        self.build("talker")
        subprocess.run(
            [
                CC,
                "-shared",
                "-fPIC",
                "-O1",
                "-o",
                str(self.programs / "bytes.so"),
                str(SOURCES / "modules/bytes.c"),
            ],
            check=True,
        )
        machine = self.machine(
            "newthread servo 200000\nloadrt bytes\naddf bytes.read servo\naddf bytes.write servo\nnewsig up port\nsets up 200\n"
            "newsig down port\nsets down 200\nlinkps bytes.to up\nlinkps bytes.from down\n"
        )
        program = subprocess.Popen(
            [self.programs / "talker"],
            env={**self.environment, "LD_LIBRARY_PATH": str(LIBRARY)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(program.kill)
        self.assertEqual("id 4, unlinked 0 0 0 0 0\n", program.stdout.readline())
        wait_until(
            lambda: "ready"
            in "".join(line for line in self.say("show", "comp").splitlines() if "talker" in line),
            "it is ready",
        )
        self.say("net", "up", "talker.from")
        self.say("net", "down", "talker.to")
        self.say("start")
        wait_until(lambda: int(self.value("bytes.read")) >= 3900, "nearly all bytes have arrived")
        wait_until(lambda: int(self.value("bytes.waiting")) < 4, "the rest has arrived")
        wait_until(lambda: int(self.value("bytes.room")) < 5, "the program reads no longer")
        program.terminate()
        out, err = program.communicate(timeout=harness.TIMEOUT)
        transmitted = int(out.split("transmitted ")[1].split()[0])
        self.assertEqual(
            (
                "wrong 0 0 0 0 0 0\nsize 200, received 1, transmitted %d\nstopped by 15, lock 0, other -22, allocated 0, set 0 3, reset 0 0\n"
                % transmitted,
                "talker: talker.both: port pin 'talker.both' must be in or out\n"
                "talker.to: port 'talker.to' is an output: use write\ntalker.from: port 'talker.from' is an input: use read or peek\n"
                "talker: hal_set_lock: a program sets 0 (none), 3 (tune) or 255 (all), not 8\n"
                "talker: hal_port_alloc: a signal of type port gets its buffer by the command: sets SIGNAL 10\n",
            ),
            (out, err),
        )
        self.assertGreaterEqual(transmitted, 4000)
        self.assertEqual(
            ("TRUE", str(transmitted - transmitted % 4)),
            (self.value("bytes.good"), self.value("bytes.read")),
        )
        self.end(machine)

    # --- what goes wrong --------------------------------------------------------------------------------------------------

    def test_a_killed_program_is_dead_and_its_successor_takes_its_pins(self):
        self.build("gauge")
        machine = self.machine()
        self.say("loadusr", "-Wn", "gauge", "gauge")
        self.say("net", "a", "adder.out", "gauge.0.in")
        self.comes("gauge.0.twice", "10")
        pid = next(
            line.split()[3] for line in self.say("show", "comp").splitlines() if " gauge " in line
        )
        subprocess.run(["kill", "-9", pid], check=True)
        wait_until(lambda: "dead since" in self.say("show", "comp"), "it is dead")
        self.comes("gauge.0.twice", "10")  # the last value
        self.say("loadusr", "-Wn", "gauge", "gauge")
        self.say("setp", "adder.in0", "6")
        self.comes("gauge.0.twice", "12")
        self.end(machine)

    def test_without_a_machine(self):
        self.build("gauge")
        done = subprocess.run(
            [self.programs / "gauge"],
            env={**self.environment, "LD_LIBRARY_PATH": str(LIBRARY)},
            capture_output=True,
            text=True,
        )
        self.assertEqual(
            (
                1,
                "gauge-helper: no machine 'default' is running (hal run FILE.hal; HALCYON_INSTANCE names another)\n"
                "gauge: no machine 'default' is running (hal run FILE.hal; HALCYON_INSTANCE names another)\n",
            ),
            (done.returncode, done.stderr),
        )

    def test_a_program_that_reads_linuxcncs_memory(self):
        for name, instead in (
            ("walker", "hal shell, hal panel, or Python's hal module"),
            ("halscope", "hal scope, or hal panel in a browser"),
        ):
            self.build("walker")
            if name != "walker":
                (self.programs / "walker").rename(self.programs / name)
            done = subprocess.run(
                [self.programs / name],
                env={**self.environment, "LD_LIBRARY_PATH": str(LIBRARY)},
                capture_output=True,
                text=True,
            )
            self.assertEqual(
                (
                    1,
                    f"{name}: this program reads LinuxCNC's memory directly, which a machine of Halcyon does not have. "
                    f"In its place: {instead}\n",
                ),
                (done.returncode, done.stderr),
            )

    def test_classicladder_without_its_window_runs(self):
        self.build("walker")
        (self.programs / "walker").rename(self.programs / "classicladder")
        for words, status in (
            (["x.clp"], 1),
            (["--nogui", "x.clp"], -signal.SIGSEGV),
        ):  # the stand-in for it goes on, and reads that memory
            done = subprocess.run(
                [self.programs / "classicladder", *words],
                env={**self.environment, "LD_LIBRARY_PATH": str(LIBRARY)},
                capture_output=True,
                text=True,
            )
            self.assertEqual(
                (status, status == 1),
                (done.returncode, "In its place: classicladder --nogui FILE.clp" in done.stderr),
                done.stderr,
            )

    def test_the_machine_is_killed(self):
        self.build("gauge")
        machine = self.machine()
        self.say("loadusr", "-Wn", "gauge", "gauge")
        pid = next(
            line.split()[3] for line in self.say("show", "comp").splitlines() if " gauge " in line
        )
        machine.send_signal(signal.SIGKILL)
        machine.wait()
        wait_until(lambda: not Path("/proc", pid).exists(), "the program ends with it")


if __name__ == "__main__":
    unittest.main()
